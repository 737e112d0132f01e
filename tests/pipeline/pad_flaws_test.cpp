// Flaws of a pad that came after its untouched image, or went: found where they are and nowhere else, no dent
// and no contact comes of them, and what is pressed later is measured through them.
#include "engine/measure/picture/pad_flaws.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "capture/synthetic/synthetic.h"
#include "engine/pipeline/pipeline_access.h"
#include "engine/pipeline/surface_map.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/pipelines.h"

namespace palpate {
namespace {

/// Share by which a bent hair changes a pixel.
double hair(double x, double y) {
  if (x < 90 || x > 210) return 0;
  const double off = y - (110 + 25 * std::sin(x / 40));
  return 0.5 * std::exp(-off * off / 2);
}
double dust(double x, double y) {
  return 0.6 * std::exp(-(std::pow(x - 60, 2) + std::pow(y - 60, 2)) / 4);
}

/// Less red and more green by the share, as a slope shows.
Frame flawed(const Frame& clean, double (*share)(double, double)) {
  Frame dirty = clean;
  for (uint32_t y = 0; y < clean.format.height; ++y)
    for (uint32_t x = 0; x < clean.format.width; ++x) {
      const double by = share(x, y);
      dirty.set(0, x, y, static_cast<uint32_t>(std::lround(clean.at(0, x, y) * (1 - by))));
      dirty.set(1, x, y, static_cast<uint32_t>(std::min(std::lround(clean.at(1, x, y) * (1 + by)), 250l)));
    }
  return dirty;
}

Frame exposed(const Frame& frame, double gain) {
  Frame other = frame;
  for (uint32_t c = 0; c < 3; ++c)
    for (uint32_t y = 0; y < frame.format.height; ++y)
      for (uint32_t x = 0; x < frame.format.width; ++x)
        other.set(c, x, y, static_cast<uint32_t>(std::min(std::lround(frame.at(c, x, y) * gain), 250l)));
  return other;
}

/// Balls pressed on a gel, one after the other, from an untouched frame on.
class PadFlawsOfAGel : public GpuTest {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    const SyntheticOptions options = parse_synthetic("synthetic:palpation?mode=gel&size=320x240&rate=4");
    sensor_ = synthetic_sensor(options);
    SyntheticSensor source(options);
    rest_ = *source.own_background();
    Frame frame;
    while (source.next(frame)) {
      const Truth truth = *source.truth(frame.sequence);
      (truth.contact ? pressed_ : untouched_).push_back(frame);
      if (truth.contact && truth.indentation_mm > deepest_mm_) deepest_mm_ = truth.indentation_mm;
    }
    ASSERT_GE(untouched_.size(), 8u);
    ASSERT_GE(pressed_.size(), 8u);
  }
  struct Found {
    size_t of_it = 0, elsewhere = 0, missed = 0;  // px
  };
  static Found compare(const std::vector<uint8_t>& flaws, double (*share)(double, double)) {
    Found found;
    for (size_t i = 0; i < 320 * 240; ++i) {
      const bool flaw = !flaws.empty() && flaws[i] != 0;
      double most = 0;  // what may be smeared
      for (int v = -4; v <= 4; ++v)
        for (int u = -4; u <= 4; ++u)
          most = std::max(most, share(static_cast<double>(i % 320) + u, static_cast<double>(i / 320) + v));
      const bool clear = share(static_cast<double>(i % 320), static_cast<double>(i / 320)) > 0.15;
      found.of_it += flaw && clear;
      found.missed += !flaw && clear;
      found.elsewhere += flaw && most < 0.1;
    }
    return found;
  }

  Sensor sensor_;
  Frame rest_;
  std::vector<Frame> untouched_, pressed_;
  double deepest_mm_ = 0;
};

TEST_F(PadFlawsOfAGel, AreFoundInUntouchedFramesWhereTheyAre) {
  for (const auto share : {hair, dust})
    for (const bool went : {false, true}) {
      PadFlaws flaws(rest_.format, false);
      flaws.set_background(went ? flawed(rest_, share) : rest_);
      for (size_t i = 0; i < 6; ++i) flaws.look_at(went ? untouched_[i] : flawed(untouched_[i], share));
      const Found found = compare(flaws.flaws(), share);
      EXPECT_EQ(found.missed, 0u);
      EXPECT_GT(found.of_it, 10u);
      EXPECT_EQ(found.elsewhere, 0u);
      EXPECT_EQ(flaws.summary().places, 1u);
      EXPECT_NE(flaws.summary().describe().find("in 1 thin place, "), std::string::npos);
    }
}

TEST_F(PadFlawsOfAGel, AreNeitherCleanPadsNorLightNorPresses) {
  for (const double gain : {0.9, 1.0, 1.1}) {
    PadFlaws flaws(rest_.format, false);
    flaws.set_background(rest_);
    for (const Frame& frame : untouched_) flaws.look_at(exposed(frame, gain));
    EXPECT_TRUE(flaws.judged());
    EXPECT_EQ(flaws.summary().px, 0u) << gain;
  }
  // What is pressed from the first frame on, and what is pressed later.
  for (const size_t before : {size_t{0}, size_t{2}}) {
    PadFlaws flaws(rest_.format, false);
    flaws.set_background(rest_);
    for (size_t i = 0; i < before; ++i) flaws.look_at(untouched_[i]);
    for (const Frame& frame : pressed_) {
      flaws.look_at(frame);
      EXPECT_EQ(flaws.summary().px, 0u);
    }
  }
}

TEST_F(PadFlawsOfAGel, OneThatWentIsNoneAnyMore) {
  PadFlaws flaws(rest_.format, false);
  flaws.set_background(rest_);
  for (size_t i = 0; i < 5; ++i) flaws.look_at(flawed(untouched_[i], hair));
  EXPECT_GT(flaws.summary().px, 100u);
  // A touch does not hide it.
  for (uint32_t i = 0; i < 2 * PadFlaws::kAgain; ++i) EXPECT_FALSE(flaws.look_at(pressed_.front()));
  bool changed = false;
  for (uint32_t i = 0; i < PadFlaws::kAgain; ++i)
    changed = flaws.look_at(untouched_[i % untouched_.size()]) || changed;
  EXPECT_TRUE(changed);
  EXPECT_EQ(flaws.summary().px, 0u);
}

TEST_F(PadFlawsOfAGel, SeparatePressesShowThemTogether) {
  PadFlaws flaws(rest_.format, true), clean(rest_.format, true);
  flaws.set_background(rest_);
  clean.set_background(rest_);
  for (const Frame& frame : pressed_) {
    flaws.look_at(flawed(frame, dust));
    clean.look_at(frame);
  }
  const Found found = compare(flaws.flaws(), dust);
  EXPECT_EQ(found.missed, 0u);
  EXPECT_EQ(found.elsewhere, 0u);
  EXPECT_TRUE(clean.judged());
  EXPECT_EQ(clean.summary().px, 0u);
}

TEST_F(PadFlawsOfAGel, LeaveNoDentAndNoContact) {
  PipelineOptions options = solved(Solve::Live);
  options.outputs = Output::Force | Output::Surface | Output::Contacts;
  Pipeline clean(context(), sensor_, rest_.format, options), dirty(context(), sensor_, rest_.format, options),
      blind(context(), sensor_, rest_.format, options);
  for (Pipeline* pipeline : {&clean, &dirty, &blind}) pipeline->set_background(rest_);
  blind.process(pressed_.front());  // a run that does not begin untouched finds none
  const auto apart = [](const std::vector<float>& a, const std::vector<float>& b) {
    double squares = 0;
    for (size_t i = 0; i < a.size(); ++i) squares += std::pow(double{a[i]} - double{b[i]}, 2);
    return std::sqrt(squares / static_cast<double>(a.size()));
  };
  double filled_mm = 0, blind_mm = 0, deepest_mm = 0;
  const auto measure = [&](const Frame& frame) {
    const std::vector<float> truth = depth_map(clean.process(frame));
    const Result result = dirty.process(flawed(frame, hair));
    EXPECT_FALSE(surface_of(result).confidence.empty());  // hatched
    filled_mm = std::max(filled_mm, apart(depth_map(result), truth));
    blind_mm = std::max(blind_mm, apart(depth_map(blind.process(flawed(frame, hair))), truth));
    deepest_mm = std::max(deepest_mm, double{*std::ranges::max_element(truth)});
    return result.touch.contact;
  };
  for (size_t i = 0; i < 3; ++i) EXPECT_FALSE(measure(untouched_[i]));
  const double filled_untouched_mm = filled_mm, blind_untouched_mm = blind_mm;
  for (const Frame& frame : pressed_) measure(frame);
  std::printf("a hair's RMS error %.5f mm untouched, %.5f pressed to %.3f; not found %.5f, %.5f\n",
              filled_untouched_mm, filled_mm, deepest_mm, blind_untouched_mm, blind_mm);
  EXPECT_EQ(PipelineAccess::flaws(clean).px, 0u);
  EXPECT_EQ(PipelineAccess::flaws(blind).px, 0u);
  EXPECT_EQ(PipelineAccess::flaws(dirty).places, 1u);
  EXPECT_LT(filled_untouched_mm, 0.2 * blind_untouched_mm);
  EXPECT_LT(filled_mm, 0.01 * deepest_mm);
}

}  // namespace
}  // namespace palpate
