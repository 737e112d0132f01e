// Construction of the whole engine, its refusals, and its slots.
#include "palpate/pipeline.h"

#include <algorithm>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/pipeline/pipeline_access.h"
#include "engine/pipeline/surface_map.h"
#include "palpate/error.h"
#include "tests/pipeline/pipeline_fixture.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/pipelines.h"

namespace palpate {
namespace {

// ---- Outputs

TEST_F(PipelineTest, WhatIsNotAskedForIsNotBuilt) {
  SyntheticRun scene("press?mode=gel");
  Pipeline both = scene.pipeline(context(), {Output::Force | Output::Surface, SurfaceSolver::Live, 3});
  Pipeline force = scene.pipeline(context(), force_only(3));
  std::printf("memory with surface %.1f MiB, without %.1f MiB\n",
              static_cast<double>(both.memory_bytes()) / 1048576,
              static_cast<double>(force.memory_bytes()) / 1048576);
  // Three depth maps at the least.
  EXPECT_LT(force.memory_bytes() + 3 * 640 * 480 * sizeof(float), both.memory_bytes());
  // A card holds each image twice, once for the upload.
  EXPECT_LT((context().is_software() ? 2 : 1.5) * static_cast<double>(force.memory_bytes()),
            static_cast<double>(both.memory_bytes()));
  for (const uint64_t k : {uint64_t{0}, uint64_t{50}, uint64_t{130}}) {
    ASSERT_TRUE(both.submit(scene.frame(k)));
    ASSERT_TRUE(force.submit(scene.frame(k)));
    const Result with = *both.wait(), without = *force.wait();
    EXPECT_TRUE(with.touch.surface.has_value());
    EXPECT_NE(surface_of(with).buffer, nullptr);
    EXPECT_EQ(surface_of(with).width, 640u);
    EXPECT_FALSE(without.touch.surface.has_value());
    EXPECT_EQ(surface_of(without).buffer, nullptr);
    expect_identical(with.touch, without.touch, "frame " + std::to_string(k));
    std::vector<std::string> names;
    for (const gpu::ScopeTime& time : PipelineAccess::times(force, without)) names.push_back(time.name);
    EXPECT_EQ(std::count(names.begin(), names.end(), "surface"), 0);
    EXPECT_EQ(std::count(names.begin(), names.end(), "slope"), 0);
    EXPECT_EQ(std::count(names.begin(), names.end(), "contact"), 1);
  }
}

// ---- Slots

TEST_F(PipelineTest, FullSlotsRefuseAndResultsComeInOrder) {
  SyntheticRun scene("press?size=320x240");
  Pipeline pipeline = scene.pipeline(context(), force_only(3));
  EXPECT_FALSE(pipeline.poll());
  EXPECT_FALSE(pipeline.wait());
  for (const uint64_t k : {100u, 101u, 105u}) EXPECT_TRUE(pipeline.submit(scene.frame(k)));
  EXPECT_FALSE(pipeline.submit(scene.frame(106))) << "all in flight";
  std::vector<Result> held;
  for (const uint64_t k : {100u, 101u, 105u}) {
    held.push_back(*pipeline.wait());
    EXPECT_EQ(held.back().touch.sequence, k);
    EXPECT_EQ(held.back().touch.time_ns, scene.frame(k).time_ns);
    EXPECT_GT(held.back().turnaround_ms, 0);
  }
  EXPECT_FALSE(pipeline.wait());
  EXPECT_FALSE(pipeline.submit(scene.frame(106))) << "all held";
  held.erase(held.begin() + 1);
  EXPECT_TRUE(pipeline.submit(scene.frame(106)));
  EXPECT_FALSE(pipeline.submit(scene.frame(107)));
  const Result next = *pipeline.wait();
  EXPECT_EQ(next.touch.sequence, 106u);
}

TEST_F(PipelineTest, AResultGivesItsSlotBackWhereverItEnds) {
  SyntheticRun scene("press?size=320x240");
  std::optional<Result> last;
  {
    Pipeline pipeline = scene.pipeline(context(), force_only(1));
    ASSERT_TRUE(pipeline.submit(scene.frame(100)));
    Result result = *pipeline.wait();
    EXPECT_FALSE(pipeline.submit(scene.frame(101))) << "held";
    Result moved = std::move(result);
    result = {};
    EXPECT_FALSE(pipeline.submit(scene.frame(101))) << "held by the one that it went to";
    std::thread([ends = std::move(moved)] {}).join();
    EXPECT_TRUE(pipeline.submit(scene.frame(101)));
    last = pipeline.wait();
    last = std::nullopt;
    EXPECT_TRUE(pipeline.submit(scene.frame(102)));
    last = pipeline.wait();
  }
  EXPECT_EQ(last->touch.sequence, 102u) << "it may outlive the pipeline, with its numbers";
}

// One held result among many frames: its map must not change, its buffer must not be given to another.
TEST_F(PipelineTest, HeldMapStaysIntact) {
  for (const Solve solve : {Solve::Live, Solve::Exact}) {
    SyntheticRun scene("press?mode=gel&size=320x240&force=0.5");
    const std::vector<float> alone = [&] {
      Pipeline other = scene.pipeline(context(), solved(solve));
      return depth_map(other.process(scene.frame(130)));
    }();
    Pipeline pipeline = scene.pipeline(context(), solved(solve));
    const Result held = pipeline.process(scene.frame(130));
    uint64_t next = 30;
    for (int i = 0; i < 12; ++i) {
      while (pipeline.submit(scene.frame(next))) ++next;
      const Result passing = *pipeline.wait();
      EXPECT_NE(surface_of(passing).buffer, surface_of(held).buffer);
    }
    EXPECT_EQ(depth_map(held), alone) << "read after twelve other frames";
  }
}

TEST_F(PipelineTest, PollNeverWaits) {
  SyntheticRun scene("press?size=1392x1042");
  Pipeline pipeline = scene.pipeline(context(), force_only(3));
  std::vector<Frame> frames;
  for (uint64_t k = 0; k < 6; ++k) frames.push_back(scene.frame(100 + k));
  int empty = 0;
  // A machine that is busy elsewhere may look only when all is done; not every time.
  for (uint64_t k = 0; k < frames.size() || (empty == 0 && k < 500); ++k) {
    Frame& frame = frames[k % frames.size()];
    frame.sequence = 100 + k;
    ASSERT_TRUE(pipeline.submit(frame));
    std::optional<Result> result;
    while (!(result = pipeline.poll())) {
      ++empty;
      std::this_thread::yield();
    }
    EXPECT_EQ(result->touch.sequence, 100 + k);
  }
  EXPECT_GT(empty, 0) << "every poll found a finished frame: it waited for it";
}

TEST_F(PipelineTest, NumbersDoNotDependOnSlotsOrRuns) {
  SyntheticRun scene("slide?size=320x240");
  std::vector<Frame> frames;
  for (uint64_t k = 0; k < scene.count(); k += 4) frames.push_back(scene.frame(k));
  const auto run = [&](uint32_t slots) {
    Pipeline pipeline = scene.pipeline(context(), force_only(slots));
    std::vector<Touch> touches;
    const auto collect = [&] {
      const Result result = *pipeline.wait();
      touches.push_back(result.touch);
    };
    for (const Frame& frame : frames) {
      while (!pipeline.submit(frame)) collect();
    }
    while (touches.size() < frames.size()) collect();
    return touches;
  };
  const std::vector<Touch> first = run(1);
  for (const uint32_t slots : {1u, 3u, 5u}) {
    const std::vector<Touch> again = run(slots);
    ASSERT_EQ(again.size(), first.size());
    for (size_t i = 0; i < first.size(); ++i)
      expect_identical(again[i], first[i], std::to_string(slots) + " slots, frame " + std::to_string(i));
  }
}

TEST_F(PipelineTest, SurfaceIsTheSameInEveryRun) {
  SyntheticRun scene("press?mode=gel&size=333x251&force=0.5");
  const auto run = [&](uint32_t slots) {
    Pipeline pipeline =
        scene.pipeline(context(), {Output::Force | Output::Surface, SurfaceSolver::Live, slots});
    for (uint32_t i = 0; i < slots; ++i) EXPECT_TRUE(pipeline.submit(scene.frame(120 + 3 * (slots - 1 - i))));
    std::optional<Result> last;
    for (uint32_t i = 0; i < slots; ++i) last = pipeline.wait();
    EXPECT_EQ(last->touch.sequence, 120u);
    return depth_map(*last);
  };
  const std::vector<float> first = run(1);
  EXPECT_EQ(run(1), first);
  EXPECT_EQ(run(3), first);
}

// A new background counts from the next frame on, also while frames are under way.
TEST_F(PipelineTest, BackgroundCanBeTakenAnew) {
  SyntheticRun scene("press?size=320x240");
  Pipeline pipeline = scene.pipeline(context(), force_only(3));
  const Frame pressed = scene.frame(130);
  const double gray_sum = pipeline.process(pressed).touch.gray_sum;
  ASSERT_TRUE(pipeline.submit(pressed));
  pipeline.set_background(pressed);
  ASSERT_TRUE(pipeline.submit(pressed));
  const Result before = *pipeline.wait(), after = *pipeline.wait();
  EXPECT_EQ(before.touch.gray_sum, gray_sum);
  EXPECT_FALSE(after.touch.contact);
}

// ---- Refusals

template <typename Act>
void expect_refused(Failure failure, const std::vector<std::string>& words, const Act& act) {
  try {
    act();
    ADD_FAILURE() << "accepted, wanted words: " << (words.empty() ? "" : words[0]);
  } catch (const Error& e) {
    EXPECT_EQ(e.failure(), failure) << e.what();
    for (const std::string& word : words)
      EXPECT_NE(std::string(e.what()).find(word), std::string::npos)
          << "no '" << word << "' in: " << e.what();
  }
}

TEST_F(PipelineTest, FramesOfAnotherFormatAreRefused) {
  SyntheticRun scene("press?size=320x240");
  Pipeline pipeline(context(), scene.sensor, scene.source.format(), force_only());
  expect_refused(Failure::Input, {"background"}, [&] { pipeline.submit(scene.frame(0)); });
  Frame other;
  for (const FrameFormat& wrong :
       {FrameFormat{321, 240, 1, 8}, FrameFormat{320, 240, 3, 8}, FrameFormat{320, 240, 1, 12}}) {
    other.reshape(wrong);
    expect_refused(Failure::Input, {"background", std::to_string(wrong.width)},
                   [&] { pipeline.set_background(other); });
  }
  pipeline.set_background(scene.background);
  for (const FrameFormat& wrong :
       {FrameFormat{320, 241, 1, 8}, FrameFormat{320, 240, 3, 8}, FrameFormat{320, 240, 1, 12}}) {
    other.reshape(wrong);
    expect_refused(Failure::Input, {"320 x " + std::to_string(wrong.height)},
                   [&] { pipeline.submit(other); });
  }
  // A refused frame costs no slot.
  EXPECT_TRUE(pipeline.process(scene.frame(130)).touch.contact);
}

TEST_F(PipelineTest, SensorsThatDoNotFitAreRefused) {
  const SyntheticRun gray("press?size=320x240"), gel("press?mode=gel&size=320x240"),
      lambert("press?mode=lambert&size=320x240");
  const PipelineOptions surface;
  const auto make = [&](const Sensor& sensor, const FrameFormat& format, const PipelineOptions& options) {
    return [&context = context(), sensor, format, options] { Pipeline(context, sensor, format, options); };
  };
  const FrameFormat plain = gray.source.format(), color = gel.source.format();
  Sensor unread = gray.sensor;
  unread.reading = SurfaceReading::None;
  expect_refused(Failure::Sensor, {"surface reading"}, make(unread, plain, surface));
  expect_refused(Failure::Sensor, {"channels"}, make(gel.sensor, plain, surface));
  expect_refused(Failure::Sensor, {"channels"}, make(lambert.sensor, color, surface));
  expect_refused(Failure::Sensor, {"channels"}, make(gel.sensor, plain, force_only()));
  expect_refused(Failure::Sensor, {"bit"}, make(gray.sensor, {320, 240, 1, 12}, force_only()));
  expect_refused(Failure::Sensor, {"0 x 240"}, make(gray.sensor, {0, 240, 1, 8}, force_only()));
  expect_refused(Failure::Sensor, {"16384"}, make(gray.sensor, {16385, 1, 1, 8}, force_only()));
  expect_refused(Failure::Sensor, {"16384 x 16384"}, make(gray.sensor, {16384, 16384, 1, 8}, force_only()));
  Sensor odd = gray.sensor;
  odd.pitch_mm_per_px = 0;
  expect_refused(Failure::Sensor, {"pitch_mm_per_px"}, make(odd, plain, force_only()));
  odd = lambert.sensor;
  odd.channels = 3;
  expect_refused(Failure::Sensor, {"gray frames"}, make(odd, color, surface));
}

// A frame as the camera gives it, measured with the sensor of a rectified one, has wrong millimetres.
TEST_F(PipelineTest, ASensorThatStillRectifiesIsRefused) {
  const SyntheticRun gray("press?size=320x240");
  const FrameFormat format = gray.source.format();
  const auto make = [&](const Sensor& sensor) {
    return [&context = context(), sensor, format] { Pipeline(context, sensor, format, force_only()); };
  };
  Sensor cropped = gray.sensor, turned = gray.sensor, bent = gray.sensor, uneven = gray.sensor, all;
  cropped.crop_px = {0, 0, 320, 240};
  turned.quad_px = {{{0, 0}, {319, 0}, {319, 239}, {0, 239}}};
  bent.lens.emplace();
  bent.lens->fx_px = bent.lens->fy_px = 300;
  uneven.flat = FlatField{"flat.png", 1.0 / 32768, {}};
  expect_refused(Failure::Sensor, {"rectified", "frame.crop_px"}, make(cropped));
  expect_refused(Failure::Sensor, {"rectified", "frame.quad_px"}, make(turned));
  expect_refused(Failure::Sensor, {"rectified", "frame.lens"}, make(bent));
  expect_refused(Failure::Sensor, {"rectified", "frame.flat"}, make(uneven));
  all = cropped;
  all.camera_px = {640, 480}, all.quad_px = turned.quad_px, all.lens = bent.lens, all.flat = uneven.flat;
  expect_refused(Failure::Sensor, {"crop_px, lens, quad_px, flat", "for_rectified_frames"}, make(all));
  EXPECT_NO_THROW(make(for_rectified_frames(all))());
  Sensor larger = gray.sensor, camera = gray.sensor;
  larger.size_px = {640, 480};
  expect_refused(Failure::Sensor, {"size_px", "640 x 480", "320 x 240"}, make(larger));
  camera.camera_px = {640, 480};
  expect_refused(Failure::Sensor, {"camera_px", "640 x 480", "320 x 240"}, make(camera));
}

}  // namespace
}  // namespace palpate
