// Pictures of separate presses: each by itself, whatever came before; and what is said where another unit's
// untouched image is subtracted.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "palpate/pipeline.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

constexpr Outputs kGelOutputs = Output::Force | Output::Contacts | Output::Surface;

class SeparatePictures : public GpuTest {
 protected:
  static constexpr const char* kScene = "drag?mode=gel&size=320x240&rate=10";

  static std::vector<Touch> measured(SyntheticRun& run, const std::vector<uint64_t>& frames, bool separate) {
    Pipeline pipeline = run.pipeline(context(), {.outputs = kGelOutputs, .slots = 2, .separate = separate});
    std::vector<Touch> touches;
    for (const uint64_t k : frames) touches.push_back(pipeline.process(run.frame(k)).touch);
    return touches;
  }
  /// A dragged object, with a force that goes with the gray sum.
  struct Dragged : SyntheticRun {
    Dragged() : SyntheticRun(kScene) {
      sensor.force = ForceCalibration{.c1_N_per_gray = 1e-5, .residual_sd_N = 0.01, .gray_max = 1e9};
    }
  };
  /// Frames in which it touches, far apart.
  static std::vector<uint64_t> touched(const SyntheticRun& run) {
    std::vector<uint64_t> frames;
    for (uint64_t k = 0; k < run.count(); ++k)
      if (run.truth(k).contact && run.truth(k).force_N > 0.2) frames.push_back(k);
    const size_t step = frames.size() / 6;
    return {frames[step], frames[2 * step], frames[3 * step], frames[4 * step], frames[5 * step]};
  }
};

TEST_F(SeparatePictures, MeasureTheSameInAnyOrder) {
  Dragged run;
  const std::vector<uint64_t> forth = touched(run);
  std::vector<uint64_t> back = forth;
  std::ranges::reverse(back);
  const std::vector<Touch> a = measured(run, forth, true);
  std::vector<Touch> b = measured(run, back, true);
  std::ranges::reverse(b);
  for (size_t i = 0; i < a.size(); ++i) {
    ASSERT_TRUE(a[i].contact);
    EXPECT_EQ(a[i].contacts.size(), b[i].contacts.size());
    EXPECT_EQ(a[i].area_px, b[i].area_px) << i;
    EXPECT_EQ(a[i].gray_sum, b[i].gray_sum) << i;
    EXPECT_EQ(a[i].centroid_x_px, b[i].centroid_x_px) << i;
    EXPECT_EQ(a[i].force_N.value, b[i].force_N.value) << i;
    EXPECT_EQ(a[i].surface->depth_max_mm, b[i].surface->depth_max_mm) << i;
    EXPECT_EQ(a[i].surface->volume_mm3, b[i].surface->volume_mm3) << i;
  }
}

TEST_F(SeparatePictures, HaveNeitherMotionNorShearNorSlip) {
  Dragged run;
  ASSERT_TRUE(run.sensor.shear.has_value());
  const std::vector<uint64_t> frames = touched(run);
  std::set<uint32_t> ids;
  for (const Touch& touch : measured(run, frames, true)) {
    ASSERT_EQ(touch.contacts.size(), 1u);
    const ContactTouch& one = touch.contacts.front();
    EXPECT_TRUE(ids.insert(one.id).second) << "an id of the picture before";
    EXPECT_EQ(one.frames, 1u);
    for (const Estimate& shear : {touch.shear_x_N, touch.shear_y_N, one.shear_x_N, one.shear_y_N})
      EXPECT_EQ(shear.validity, Validity::NotFollowed);
    EXPECT_EQ(touch.slip, Slip::NotCalibrated);
    EXPECT_EQ(one.slip, Slip::NotCalibrated);
    for (const double shift : {touch.shift_x_px, touch.shift_y_px, one.shift_x_mm, one.shift_y_mm})
      EXPECT_TRUE(std::isnan(shift)) << shift;
    EXPECT_EQ(touch.force_N.validity, Validity::Valid);
    EXPECT_GT(touch.force_N.value, 0);
  }
  // As one sequence the same frames are followed.
  const std::vector<Touch> followed = measured(run, frames, false);
  EXPECT_NE(followed.back().shear_x_N.validity, Validity::NotFollowed);
  EXPECT_GT(std::hypot(followed.back().shift_x_px, followed.back().shift_y_px), 3);
}

// Light and noise that the pictures before had are no part of a picture.
TEST_F(SeparatePictures, LearnNothingOfTheLight) {
  Dragged run;
  Frame brighter = run.frame(0);
  for (uint8_t& gray : brighter.bytes) gray = static_cast<uint8_t>(std::min(gray + 12, 250));
  const uint64_t press = touched(run)[2];
  Pipeline alone = run.pipeline(context(), {.outputs = kGelOutputs, .separate = true});
  const Touch expected = alone.process(run.frame(press)).touch;
  Pipeline after = run.pipeline(context(), {.outputs = kGelOutputs, .separate = true});
  for (int i = 0; i < 20; ++i) EXPECT_EQ(after.process(brighter).touch.light->state, LightState::Changed);
  const Touch found = after.process(run.frame(press)).touch;
  EXPECT_EQ(found.light->state, expected.light->state);
  EXPECT_EQ(found.area_px, expected.area_px);
  EXPECT_EQ(found.surface->depth_max_mm, expected.surface->depth_max_mm);
}

class AnotherUnit : public GpuTest {
 protected:
  /// The same gel, lit from elsewhere.
  static Frame background_of_another(const Frame& own) {
    Frame other = own;
    const FrameFormat& f = own.format;
    for (uint32_t c = 0; c < 3; ++c)
      for (uint32_t y = 0; y < f.height; ++y)
        for (uint32_t x = 0; x < f.width; ++x)
          other.set(c, x, y, 40 + (c == 1 ? 150 * x / f.width : 150 * (f.height - 1 - y) / f.height));
    return other;
  }
};

TEST_F(AnotherUnit, DepthAndForceSayThatTheLightIsUnknown) {
  SyntheticRun run("press?mode=gel&size=320x240&rate=10");
  run.sensor.force = ForceCalibration{.c1_N_per_gray = 1e-5, .residual_sd_N = 0.01, .gray_max = 1e9};
  const Frame other = background_of_another(run.background);
  for (const bool separate : {false, true}) {
    Pipeline pipeline(context(), run.sensor, run.background.format,
                      {.outputs = kGelOutputs, .separate = separate});
    pipeline.set_background(other);
    for (const uint64_t k : {uint64_t{0}, run.count() / 2}) {
      const Touch touch = pipeline.process(run.frame(k)).touch;
      ASSERT_TRUE(touch.light.has_value());
      EXPECT_EQ(touch.light->state, LightState::Unknown);
      EXPECT_EQ(touch.surface->validity, Validity::LightUnknown);
      if (touch.contact) {
        EXPECT_EQ(touch.force_N.validity, Validity::LightUnknown);
      }
      for (const ContactTouch& one : touch.contacts) EXPECT_EQ(one.force_N.validity, Validity::LightUnknown);
    }
    // With its own the same frames are as good as they were.
    pipeline.set_background(run.background);
    const Touch touch = pipeline.process(run.frame(run.count() / 2)).touch;
    EXPECT_NE(touch.light->state, LightState::Unknown);
    EXPECT_EQ(touch.surface->validity, Validity::Valid);
    EXPECT_EQ(touch.force_N.validity, Validity::Valid);
  }
}

}  // namespace
}  // namespace palpate
