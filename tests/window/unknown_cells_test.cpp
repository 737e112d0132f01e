// Places whose depth is not known: cells with their reasons, and the words for them.
#include <gtest/gtest.h>

#include <algorithm>

#include "capture/synthetic/synthetic.h"
#include "engine/sensor/outline.h"
#include "shaders/shared/confidence.h"
#include "tests/support/gpu_fixture.h"
#include "viz/render/image/unknown_cells.h"

namespace palpate::viz {
namespace {

class UnknownCellsTest : public GpuTest, public ::testing::WithParamInterface<const char*> {};

constexpr uint32_t kSide = 4;

// A round pad with markers or without, of which a part is too dark: each cell against its pixels, one by one.
TEST_P(UnknownCellsTest, AreThoseOfWhichHalfThePixelsAreNotKnown) {
  const SyntheticOptions options =
      parse_synthetic(std::string("synthetic:press?mode=gel&size=322x237&noise=off&skin=") + GetParam());
  SyntheticSensor source(options);
  Sensor sensor = synthetic_sensor(options);
  sensor.pad = PadEllipse{160, 120, 150, 100, 0.2};
  sensor.shadow_gray = 40;
  Pipeline pipeline(context(), sensor, source.format(), {.outputs = Output::Surface | Output::Confidence});
  const Frame background = *source.own_background();
  pipeline.set_background(background);
  Frame frame;
  ASSERT_TRUE(source.next(frame));
  for (uint32_t y = 60; y < 90; ++y)
    for (uint32_t x = 100; x < 131; ++x)
      for (uint32_t c = 0; c < 3; ++c) frame.set(c, x, y, x < 120 ? 3 : 255);
  ASSERT_TRUE(pipeline.submit(frame));
  const Result result = *pipeline.wait();
  const UnknownCells cells = unknown_cells(frame, background, result.touch, result, sensor);
  ASSERT_EQ(cells.width, 81u);
  ASSERT_EQ(cells.height, 60u);
  ASSERT_EQ(cells.cell_px, kSide);
  const std::span<const uint16_t> map = result.confidence();
  const auto share = [&](uint32_t x, uint32_t y, const auto& is_so) {
    uint32_t count = 0, of = 0;
    for (uint32_t row = y * kSide; row < std::min((y + 1) * kSide, 237u); ++row)
      for (uint32_t column = x * kSide; column < std::min((x + 1) * kSide, 322u); ++column, ++of)
        count += is_so(column, row);
    return static_cast<double>(count) / of;
  };
  const auto says = [&](uint32_t bit) {
    return [&map, bit](uint32_t x, uint32_t y) {
      const uint32_t one = map[size_t{y} * 322 + x];
      return (one >> shared::kReasonShift & bit) && (one & shared::kFullConfidence) == 0;
    };
  };
  const bool markers = std::string(GetParam()) == "markers";  // what is dark may be one of them
  size_t outside = 0, dark = 0, bright = 0;
  for (uint32_t y = 0; y < cells.height; ++y)
    for (uint32_t x = 0; x < cells.width; ++x) {
      const uint8_t reasons = cells.reasons[size_t{y} * cells.width + x];
      SCOPED_TRACE(testing::Message() << x << ", " << y);
      const bool is_outside =
          share(x, y, [&](uint32_t px, uint32_t py) { return !contains(*sensor.pad, px, py); }) >= 0.5;
      ASSERT_EQ((reasons & UnknownCells::Outside) != 0, is_outside);
      ASSERT_EQ((reasons & UnknownCells::Shadowed) != 0, share(x, y, says(shared::kShadowed)) >= 0.5);
      ASSERT_EQ((reasons & UnknownCells::Saturated) != 0, share(x, y, says(shared::kSaturated)) >= 0.5);
      ASSERT_EQ((reasons & UnknownCells::Covered) != 0, share(x, y, says(shared::kCovered)) >= 0.5);
      outside += is_outside;
      dark += (reasons & UnknownCells::Shadowed) != 0;
      bright += (reasons & UnknownCells::Saturated) != 0;
    }
  EXPECT_GT(outside, 500u);
  EXPECT_TRUE(markers || dark > 20) << dark;
  EXPECT_GT(bright, 10u);
  EXPECT_EQ(words_of(cells).substr(0, 11), "not known: ");
  for (const char* word : {"beyond the pad", "saturated", markers ? "covered by markers" : "too dark"})
    EXPECT_NE(words_of(cells).find(word), std::string::npos) << words_of(cells);
}

INSTANTIATE_TEST_SUITE_P(Skins, UnknownCellsTest, ::testing::Values("none", "markers"));

TEST(UnknownCells, WithoutConfidenceSaturationIsReadFromTheFrame) {
  Frame frame, background;
  frame.reshape({64, 48, 1, 8});
  background.reshape(frame.format);
  Touch touch;
  const auto found = [&] {
    const UnknownCells cells = unknown_cells(frame, background, touch, {}, {});
    return std::ranges::count_if(cells.reasons, [](uint8_t one) { return one == UnknownCells::Saturated; });
  };
  EXPECT_EQ(found(), 0);
  EXPECT_EQ(words_of(unknown_cells(frame, background, touch, {}, {})), "");
  for (uint32_t y = 8; y < 16; ++y)
    for (uint32_t x = 8; x < 30; ++x) frame.set(0, x, y, 255);
  EXPECT_EQ(found(), 0) << "none of it counts";
  touch.saturated_px = 8 * 22;
  EXPECT_EQ(found(), 2 * 6) << "a cell counts by half";
  for (uint32_t y = 8; y < 12; ++y)
    for (uint32_t x = 8; x < 30; ++x) background.set(0, x, y, 255);
  EXPECT_EQ(found(), 6) << "what is so untouched means nothing";
  touch.contact = true;
  touch.centroid_x_px = 26;
  touch.centroid_y_px = 14;
  touch.ellipse.major_px = 4;
  EXPECT_LT(found(), 4) << "only where something touches";
}

}  // namespace
}  // namespace palpate::viz
