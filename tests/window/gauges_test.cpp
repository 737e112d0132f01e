// Figures of the cards against the numbers that they show, and rows that a sensor can never fill.
#include "viz/panels/numbers/gauges.h"

#include <gtest/gtest.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "capture/synthetic/synthetic.h"
#include "engine/measure/measured_columns.h"
#include "tests/support/gpu_fixture.h"
#include "viz/panels/numbers/quantity_rows.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

class GaugeTest : public GpuTest {
 protected:
  /// Corners of what is drawn in a colour.
  std::vector<ImVec2> drawn(ImU32 colour, const std::function<void(ImDrawList*)>& content) {
    frame_->begin({400, 300});
    ImDrawList* list = ImGui::GetBackgroundDrawList();
    const int from = list->VtxBuffer.Size;
    content(list);
    std::vector<ImVec2> corners;
    for (int i = from; i < list->VtxBuffer.Size; ++i)
      if (list->VtxBuffer[i].col == colour) corners.push_back(list->VtxBuffer[i].pos);
    frame_->abandon();
    return corners;
  }
  static float right_of(const std::vector<ImVec2>& corners) {
    return std::ranges::max(corners, {}, &ImVec2::x).x;
  }

  RenderPass pass_{context(), OffscreenTarget::kFormat, VK_SAMPLE_COUNT_1_BIT,
                   VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL};
  std::unique_ptr<HudFrame> frame_ = std::make_unique<HudFrame>(context(), pass_, 1, nullptr, 1.0f);
};

TEST_F(GaugeTest, ABarIsAsLongAsItsForceAndMarksTheRange) {
  const auto bar = [&](ImU32 colour, double force_N) {
    return drawn(colour, [&](ImDrawList* list) {
      draw_force_bar(list, {50, 100}, {350, 108}, {0.2, 2.0}, Estimate{force_N, 0.1, Validity::Valid}, 1);
    });
  };
  for (const double force_N : {0.3, 1.1, 2.2})  // the bar ends at 2.2 N
    EXPECT_NEAR(right_of(bar(ink(theme().chosen), force_N)), 50 + 300 * force_N / 2.2, 1.01) << force_N;
  EXPECT_NEAR(right_of(bar(ink(theme().text), 1.1)), 50 + 300 * 1.3 / 2.2, 3) << "two standard errors";
  EXPECT_NEAR(right_of(bar(ink(theme().chosen), 9)), 350, 1.01) << "never longer than there is room";
  EXPECT_NEAR(right_of(bar(ink(theme().limit), 1.1)), 50 + 300 * 2.0 / 2.2, 3);
  const auto none = drawn(ink(theme().chosen), [](ImDrawList* list) {
    draw_force_bar(list, {50, 100}, {350, 108}, {0.2, 2.0}, std::nullopt, 1);
  });
  EXPECT_TRUE(none.empty()) << "nothing touches";
}

TEST_F(GaugeTest, ADialShowsShearWithinItsLimit) {
  constexpr float kRadius = 84;  // of the limit, in a dial of 200 px
  const auto tip = [&](double x_N, double y_N, double limit_N) {
    const auto corners = drawn(ink(theme().of(slip_verdict(Slip::Stick).meaning)), [&](ImDrawList* list) {
      draw_shear_dial(list, {100, 50}, {300, 250}, {x_N, 0.001, Validity::Valid},
                      {y_N, 0.001, Validity::Valid}, limit_N, Slip::Stick, 1);
    });
    // The disc at the tip is drawn last, around it.
    float left = 1e9f, right = 0, top = 1e9f, foot = 0;
    for (size_t i = corners.size() / 2; i < corners.size(); ++i) {
      left = std::min(left, corners[i].x), right = std::max(right, corners[i].x);
      top = std::min(top, corners[i].y), foot = std::max(foot, corners[i].y);
    }
    return ImVec2{(left + right) / 2 - 200, (top + foot) / 2 - 150};
  };
  EXPECT_NEAR(tip(0.3, 0, 0.6).x, kRadius / 2, 1) << "half of the limit, to the right";
  EXPECT_NEAR(tip(0, 0.6, 0.6).y, kRadius, 1) << "at the limit, downwards";
  EXPECT_NEAR(tip(-0.3, 0, 0).x, -kRadius, 1) << "without a limit only the direction is known";
  EXPECT_NEAR(tip(0, -6, 0.6).y, -100, 1) << "beyond the dial it stays at its edge";
  const auto unknown = drawn(ink(theme().of(slip_verdict(Slip::NoContact).meaning)), [](ImDrawList* list) {
    draw_shear_dial(list, {100, 50}, {300, 250}, {}, {}, 0, Slip::NoContact, 1);
  });
  EXPECT_TRUE(unknown.empty());
}

TEST(QuantityRows, ShearWithoutAForceThatLimitsItTakesNoRoom) {
  Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  Frame image;
  image.reshape({320, 240, 1, 8});
  Touch touch;
  touch.shear_x_N.validity = touch.shear_y_N.validity = Validity::NoContact;
  touch.slip = Slip::NoContact;
  const auto rows = [&] {
    const HudContent content{sensor, image, touch, true, nullptr, "device"};
    return quantity_rows(touch, content, {}, MeasuredColumns::Shear | MeasuredColumns::Slipping).size();
  };
  EXPECT_EQ(rows(), 3u) << "x, y and stick or slip keep their place at rest";
  sensor.force.reset();
  EXPECT_EQ(rows(), 0u);
  touch.skin.emplace();
  EXPECT_EQ(rows(), 1u) << "the skin shows slip without a force";
}

TEST_F(GaugeTest, ALevelsBubbleLiesWhereThePadStandsHighest) {
  const auto level = [&](const std::optional<lump::PadTilt>& tilt) {
    return drawn(ink(theme().valid), [&](ImDrawList* list) {
      draw_level(list, {100, 100}, {170, 170}, tilt, 1);
    });
  };
  EXPECT_TRUE(level(std::nullopt).empty()) << "no bubble where the tilt cannot be told";
  const auto tilted = level(lump::PadTilt{-3, 1, 0.4, 0.4});  // five pixels a degree
  ASSERT_FALSE(tilted.empty());
  EXPECT_NEAR(right_of(tilted), 135 + 3 * 5 + 3.5, 1.5);
  EXPECT_NEAR(std::ranges::max(tilted, {}, &ImVec2::y).y, 135 - 5 + 3.5, 1.5);
  const auto steep = drawn(ink(theme().doubtful), [](ImDrawList* list) {
    draw_level(list, {100, 100}, {170, 170}, lump::PadTilt{-40, 0, 0.4, 0.4}, 1);
  });
  ASSERT_FALSE(steep.empty());
  EXPECT_NEAR(right_of(steep), 170 + 3.5, 1.5) << "at the edge of the dial";
}

}  // namespace
}  // namespace palpate::viz
