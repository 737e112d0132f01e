// Pixels of a gel that are saturated untouched: no pits in its surface, no saturation reported, and said to
// be unknown.
#include "engine/pipeline/specks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "capture/synthetic/synthetic.h"
#include "engine/pipeline/surface_map.h"
#include "palpate/pipeline.h"
#include "shaders/shared/confidence.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/pipelines.h"

namespace palpate {
namespace {

// Linear between the nearest pixels of a row and a column; wide patches keep their middle.
TEST(Specks, AreFilledFromAround) {
  const FrameFormat format{64, 48, 3, 8};
  Frame untouched, frame;
  for (Frame* image : {&untouched, &frame}) {
    image->reshape(format);
    for (uint32_t c = 0; c < 3; ++c)
      for (uint32_t y = 0; y < 48; ++y)
        for (uint32_t x = 0; x < 64; ++x) image->set(c, x, y, 40 + x + 2 * y);
  }
  Specks none(format, 251);
  EXPECT_EQ(&none.set_background(untouched), &untouched);
  EXPECT_EQ(&none.fill(frame), &frame);
  EXPECT_EQ(none.confidence(), nullptr);

  for (Frame* image : {&untouched, &frame})
    for (uint32_t y = 10; y < 13; ++y)
      for (uint32_t x = 20; x < 24; ++x) image->set(1, x, y, 255);
  for (uint32_t y = 0; y < 40; ++y)
    for (uint32_t x = 40; x < 64; ++x) untouched.set(0, x, y, 252);
  Specks specks(format, 251);
  specks.set_background(untouched);
  const Frame& filled = specks.fill(frame);
  for (uint32_t y = 8; y < 16; ++y)
    for (uint32_t x = 16; x < 28; ++x)
      ASSERT_NEAR(filled.at(1, x, y), 40 + x + 2 * y, 1.01) << x << ", " << y;
  EXPECT_EQ(filled.at(1, 55, 10), 40u + 55 + 20);  // too far in: as it was
  const auto& confidence = *specks.confidence();
  EXPECT_EQ(confidence[11 * 64 + 22] & shared::kFullConfidence, 0);
  EXPECT_EQ(confidence[9 * 64 + 19] & shared::kFullConfidence, 0);  // beside one
  EXPECT_EQ(confidence[8 * 64 + 22] & shared::kFullConfidence, 255);
  EXPECT_EQ(confidence[10 * 64 + 55] & shared::kFullConfidence, 0);
}

using SpecksInAGel = GpuTest;

TEST_F(SpecksInAGel, LeaveNoPits) {
  const SyntheticOptions options = parse_synthetic("synthetic:press?mode=gel&size=320x240");
  const SyntheticSensor source(options);
  const Sensor sensor = synthetic_sensor(options);
  Frame clean_rest = *source.own_background(), clean;
  const uint64_t at = *source.frame_count() / 2;
  source.render(at, clean);
  const Truth truth = *source.truth(at);
  Frame rest = clean_rest, frame = clean;
  const auto in_speck = [&](uint32_t x, uint32_t y) {
    const double u = x - truth.center_x_px, v = y - truth.center_y_px;
    return std::hypot(u - 0.7 * truth.radius_px, v) < 2.5 || std::hypot(u, v + 0.5 * truth.radius_px) < 2.5;
  };
  uint64_t specks = 0;
  for (uint32_t y = 0; y < 240; ++y)
    for (uint32_t x = 0; x < 320; ++x) {
      if (!in_speck(x, y)) continue;
      ++specks;
      for (uint32_t c = 0; c < 3; ++c) rest.set(c, x, y, 255), frame.set(c, x, y, 255);
    }
  ASSERT_GT(specks, 20u);
  for (const Solve solve : {Solve::Live, Solve::Converged}) {
    const auto depth = [&](const Frame& background, const Frame& image, bool unknown) {
      Pipeline pipeline(context(), sensor, image.format, solved(solve));
      pipeline.set_background(background);
      EXPECT_TRUE(pipeline.submit(image));
      const Result result = *pipeline.wait();
      EXPECT_EQ(result.touch.saturated_px, 0u);
      EXPECT_EQ(!surface_of(result).confidence.empty(), unknown);
      return depth_map(result);
    };
    const std::vector<float> with = depth(rest, frame, true), without = depth(clean_rest, clean, false);
    double worst = 0;
    for (size_t i = 0; i < with.size(); ++i)
      worst = std::max(worst, std::abs(double{with[i]} - double{without[i]}));
    std::printf("specks change the depth by %.4f of %.3f mm\n", worst, truth.indentation_mm);
    EXPECT_LT(worst, 0.01 * truth.indentation_mm);
  }
}

}  // namespace
}  // namespace palpate
