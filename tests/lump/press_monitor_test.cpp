// Presses of a block as they happen: their begin and end, their observations, and the report where none are
// possible.
#include "engine/palpation/press_monitor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "capture/synthetic/tissue.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Step = PressDetector::Step;

std::vector<Step> steps(PressDetector& detector, const std::vector<double>& forces_N) {
  std::vector<Step> steps;
  for (const double force_N : forces_N) steps.push_back(detector.add(force_N));
  return steps;
}

TEST(PressDetector, APressEndsBelowAShareOfItsHighestForce) {
  PressDetector detector(0.1);
  EXPECT_EQ(steps(detector, {0, 0.05, 0.2, 1.0, 0.7, 1.2, 0.8, 0.7}),
            (std::vector{Step::Rest, Step::Rest, Step::Began, Step::Pressing, Step::Pressing, Step::Pressing,
                         Step::Pressing, Step::Over}));
  EXPECT_EQ(detector.highest_N(), 1.2);
  // A force that falls, and trembles while it falls, is not a new press.
  EXPECT_EQ(steps(detector, {0.6, 0.5, 0.55, 0.3, 0.12, 0.2, 0.05, 0.09}), std::vector(8, Step::Rest));
  EXPECT_EQ(steps(detector, {0.15, 0.3}), (std::vector{Step::Began, Step::Pressing}));
  EXPECT_EQ(detector.highest_N(), 0.3) << "of the press before no longer";
}

TEST(PressDetector, PressedAgainBeforeItWasTakenAway) {
  PressDetector detector(0.1);
  EXPECT_EQ(steps(detector, {1.0, 0.5, 0.4, 0.5, 0.56, 0.9}),
            (std::vector{Step::Began, Step::Over, Step::Rest, Step::Rest, Step::Began, Step::Pressing}));
  detector.break_off();
  EXPECT_FALSE(detector.pressing());
  EXPECT_EQ(steps(detector, {0.9, 1.5, 2, 1.9, 0.5}), std::vector(5, Step::Rest))
      << "a press that was given up does not begin again by itself";
  EXPECT_EQ(steps(detector, {0, 0.4}), (std::vector{Step::Rest, Step::Began}));
}

TEST(PressReading, LoadsTakeFramesWhileTheForceRises) {
  //                                 0    1    2     3    4    5     6    7    8
  const std::vector<double> force_N{0.0, 0.5, 0.52, 1.0, 1.5, 1.98, 2.0, 1.0, 0.5};
  EXPECT_EQ(frames_near(force_N, 0.5, 2), (std::vector<size_t>{1, 2})) << "not 8: the force falls there";
  EXPECT_EQ(frames_near(force_N, 2, 2), (std::vector<size_t>{6, 5}));
  EXPECT_TRUE(frames_near(force_N, 1.75, 2).empty());
  EXPECT_EQ(frames_near(std::vector<double>(40, 1.0), 1, 1).size(), 12u);
  EXPECT_TRUE(frames_near({}, 1, 1).empty());
  EXPECT_EQ(even_loads(2, 4), (std::vector{0.5, 1.0, 1.5, 2.0}));
}

/// A small block that is solved in a second, and what its sensor says of each frame.
struct PressRun {
  explicit PressRun(const std::string& keys = "")
      : options(parse_tissue("synthetic:tissue?size=96x72&cells=16&rate=15&force=1.6&" + keys)),
        source(options),
        sensor(tissue_sensor(options)) {
    setup.block = {options.scene.block_mm, options.scene.young_Pa, {options.x_mm, options.y_mm}};
    setup.force = [this](uint64_t sequence) { return std::optional(source.block_force_N(sequence)); };
  }
  /// Plays frames `from` to `to` (not included) into a watch.
  void play(PressMonitor& watch, uint64_t from, uint64_t to) {
    Frame frame;
    ASSERT_TRUE(source.seek(from));
    for (uint64_t i = from; i < to && source.next(frame); ++i) {
      frame.after_gap = i == gap_at;
      Touch touch;
      touch.contact = source.block_force_N(i) > 0.02 && i < blind_from;
      watch.add(frame, touch);
    }
  }
  std::vector<PressAnswer> all(uint64_t every = 1) {
    PressMonitor watch(sensor, *source.own_background(), setup);
    for (uint64_t i = 0; i < *source.frame_count(); i += every) play(watch, i, i + 1);
    return watch.finish();
  }

  TissueOptions options;
  TissueSensor source;
  Sensor sensor;
  PressSetup setup;
  uint64_t gap_at = UINT64_MAX, blind_from = UINT64_MAX;
};

TEST(PressReading, NodesAreMeansOfPressure) {
  PressRun run("noise=off&lx=3");
  const Frame background = *run.source.own_background();
  const PressureNodes nodes(run.sensor, background, 1.25);
  Frame frame;
  const uint64_t at = 60;  // the last hold
  ASSERT_TRUE(run.source.seek(at));
  ASSERT_TRUE(run.source.next(frame));
  NodeSums sums = nodes.read(frame);
  EXPECT_NEAR(nodes.window_force_N(sums), run.source.truth(at)->force_N,
              0.02 * run.source.truth(at)->force_N);
  sums.add(nodes.read(frame));
  EXPECT_NEAR(nodes.window_force_N(sums), run.source.truth(at)->force_N, 0.02 * run.source.truth(at)->force_N)
      << "of two frames the mean";
  double noise_Pa = 0, limited = 1;
  const PressureMap map = nodes.map(sums, noise_Pa, limited);
  ASSERT_EQ(map.width, 23u);
  ASSERT_EQ(map.height, 17u);
  EXPECT_EQ(limited, 0);
  EXPECT_GT(noise_Pa, 0);
  double largest = 0;
  int seen = 0;
  for (uint32_t j = 1; j + 1 < map.height; ++j)
    for (uint32_t i = 1; i + 1 < map.width; ++i) {
      if (!std::isfinite(map.at(i, j))) continue;  // few pixels: not all of them see 0.9 of their square
      ++seen;
      const double truth = run.source.pressure_Pa(at, (i - 11.0) * 1.25, (j - 8.0) * 1.25);
      largest = std::max(largest, truth);
      EXPECT_NEAR(static_cast<double>(map.at(i, j)), truth, 0.04 * truth + 0.5 * nodes.Pa_per_gray())
          << i << " " << j;
    }
  EXPECT_GT(seen, 60);
  EXPECT_GT(largest, 1000);
  // At the camera's limit values are not seen, and counted.
  Sensor dim = run.sensor;
  dim.saturation_gray = 40;
  const PressureNodes limit(dim, background, 1.25);
  limit.map(limit.read(frame), noise_Pa, limited);
  EXPECT_GT(limited, 0.5);
}

TEST(PressMonitor, APressTellsWhatLiesBehindIt) {
  PressRun run;
  const std::vector<PressAnswer> answers = run.all();
  ASSERT_EQ(answers.size(), 1u);
  const PressAnswer& a = answers[0];
  EXPECT_EQ(a.press, 1u);
  EXPECT_EQ(a.trouble, "");
  EXPECT_NEAR(a.highest_N, 1.6, 1e-6);
  EXPECT_EQ(a.loads_N.size(), 4u);
  EXPECT_NEAR(a.loads_N.front(), 0.4, 0.02);
  EXPECT_GT(a.last_frame, a.first_frame + 50);
  ASSERT_TRUE(a.estimate);
  EXPECT_GE(a.estimate->detection_statistic, 1);
  EXPECT_NEAR(a.estimate->x_mm.value, 0, 1);
  EXPECT_NEAR(a.estimate->y_mm.value, 0, 1);
  EXPECT_NE(describe(a).find("press 1, frames "), std::string::npos);
  EXPECT_NE(describe(a).find("4 loads up to 1.59 N: "), std::string::npos) << describe(a);
}

// Light that is 1.5 % weaker in the corners makes a bump in a single window: which is not reported as a lump.
TEST(PressMonitor, TissueAloneIsNoLump) {
  const std::vector<PressAnswer> answers = PressRun("lump=none").all();
  ASSERT_EQ(answers.size(), 1u);
  ASSERT_TRUE(answers[0].estimate);
  EXPECT_NE(answers[0].estimate->verdict, lump::Status::Found) << describe(answers[0]);
  EXPECT_NE(answers[0].estimate->verdict, lump::Status::StiffnessOpen) << describe(answers[0]);
}

TEST(PressMonitor, EvenLightOfTissueAloneTellsSo) {
  const std::vector<PressAnswer> answers = PressRun("lump=none&falloff=0").all();
  ASSERT_EQ(answers.size(), 1u);
  ASSERT_TRUE(answers[0].estimate);
  EXPECT_EQ(answers[0].estimate->verdict, lump::Status::NoLump) << describe(answers[0]);
}

TEST(PressMonitor, StatusFollowsThePress) {
  PressRun run;
  PressMonitor watch(run.sensor, *run.source.own_background(), run.setup);
  EXPECT_EQ(watch.status().block.young_Pa, 4000);
  EXPECT_FALSE(watch.status().last);
  run.play(watch, 0, 40);
  const PressStatus status = watch.status();
  EXPECT_TRUE(status.pressing);
  EXPECT_GT(status.force_N, 0.7);
  EXPECT_GE(status.loads, 2u);
  EXPECT_EQ(status.wanted, 4u);
  EXPECT_FALSE(status.last);
  run.play(watch, 40, *run.source.frame_count());
  const std::vector<PressAnswer> answers = watch.finish();
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_FALSE(watch.status().pressing);
  EXPECT_FALSE(watch.status().estimating);
  ASSERT_TRUE(watch.status().last);
}

TEST(PressMonitor, AnotherBlockIsTakenBetweenPresses) {
  PressRun run;
  PressMonitor watch(run.sensor, *run.source.own_background(), run.setup);
  BlockSetting block = run.setup.block;
  block.young_Pa = 0;
  EXPECT_THROW(watch.set_block(block), Error);
  block.young_Pa = 5000;
  block.block_mm[2] = NAN;
  EXPECT_THROW(watch.set_block(block), Error);
  block.block_mm[2] = 18;
  run.play(watch, 0, 40);
  watch.set_block(block);
  run.play(watch, 40, 45);
  EXPECT_EQ(watch.status().block.young_Pa, 4000) << "not while it presses";
  run.play(watch, 45, *run.source.frame_count());
  run.play(watch, 0, 1);
  EXPECT_EQ(watch.status().block.young_Pa, 5000);
  EXPECT_EQ(watch.status().block.block_mm[2], 18);
  watch.finish();
  // A block that the window no longer sees all of needs a gauge.
  run.setup.force = {};
  run.setup.block.block_mm = {4, 4, 20};
  PressMonitor own(run.sensor, *run.source.own_background(), run.setup);
  EXPECT_EQ(own.status().trouble, "");
  own.set_block(block);
  run.play(own, 0, 1);
  EXPECT_NE(own.status().trouble.find("--gauge"), std::string::npos);
}

TEST(PressMonitor, WhatCannotBeToldSaysWhy) {
  const auto trouble = [](std::vector<PressAnswer> answers) {
    EXPECT_EQ(answers.size(), 1u);
    if (answers.empty()) return std::string();
    EXPECT_FALSE(answers[0].estimate);
    EXPECT_NE(describe(answers[0]).find(answers[0].trouble), std::string::npos);
    return answers[0].trouble;
  };
  const auto holds = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  PressRun run;
  holds(trouble(run.all(40)), "too few loads");
  run.gap_at = 50;
  holds(trouble(run.all()), "frames are missing");
  run.gap_at = UINT64_MAX;
  run.blind_from = 50;
  holds(trouble(run.all()), "lost contact");
  run.blind_from = UINT64_MAX;
  const auto force = run.setup.force;
  run.setup.force = [&](uint64_t sequence) { return sequence < 50 ? force(sequence) : std::nullopt; };
  holds(trouble(run.all()), "the gauge has no reading");
  run.setup.force = force;
  // A touch of less than 0.1 N, seen by a sensor that is set up for 1.6 N, and off again.
  run.setup.block.young_Pa = 2000;  // softer: it is a press from 0.03 N on
  PressMonitor light(run.sensor, *run.source.own_background(), run.setup);
  run.play(light, 0, 12);
  run.play(light, *run.source.frame_count() - 5, *run.source.frame_count());
  holds(trouble(light.finish()), "too light");
}

TEST(PressMonitor, SaturationIsToldWithItsShare) {
  PressRun run;
  run.sensor.saturation_gray = 110;
  const std::vector<PressAnswer> answers = run.all();
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_GT(answers[0].saturated_fraction, 0.01);
  EXPECT_NE(describe(answers[0]).find("% of the window saturated"), std::string::npos);
}

TEST(PressMonitor, StatesOfASensorWithWhichNothingCanBeTold) {
  PressRun run;
  const Frame background = *run.source.own_background();
  Sensor plain = run.sensor;
  plain.reading = SurfaceReading::None;
  PressMonitor uncalibrated(plain, background, run.setup);
  EXPECT_NE(uncalibrated.status().trouble.find("pascals"), std::string::npos);
  run.play(uncalibrated, 0, 100);
  EXPECT_TRUE(uncalibrated.finish().empty());
  // The window sees a part of the block: its own sum is not the force on it.
  PressSetup setup = run.setup;
  setup.force = nullptr;
  PressMonitor part(run.sensor, background, setup);
  EXPECT_NE(part.status().trouble.find("--gauge"), std::string::npos);
  EXPECT_NE(part.status().trouble.find("27.8 x 20.9 mm"), std::string::npos) << part.status().trouble;
  run.play(part, 0, 100);
  EXPECT_TRUE(part.finish().empty());
}

// A window that sees the whole block is its own gauge.
TEST(PressMonitor, AWindowOverTheWholeBlockNeedsNoGauge) {
  PressRun run;
  run.sensor.pitch_mm_per_px *= 2;  // 55 mm wide: nothing of the picture is a block's, but all of it is seen
  PressSetup setup = run.setup;
  setup.force = nullptr;
  PressMonitor watch(run.sensor, *run.source.own_background(), setup);
  EXPECT_EQ(watch.status().trouble, "");
  run.play(watch, 0, 60);
  // Twice the pitch, four times the force that the window saw.
  EXPECT_NEAR(watch.status().force_N, 4 * run.source.truth(59)->force_N, 0.02 * watch.status().force_N);
}

}  // namespace
}  // namespace palpate
