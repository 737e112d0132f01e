// The growing map in the window: its place, its colours and its words.
#include "viz/render/image/map_view.h"

#include <gtest/gtest.h>
#include <imgui.h>

#include <cmath>
#include <limits>

#include "tests/support/gpu_fixture.h"
#include "tests/window/letters.h"
#include "viz/look/theme.h"
#include "viz/render/drawing.h"
#include "viz/render/hud_frame.h"
#include "viz/render/layout.h"

namespace palpate::viz {
namespace {

/// A slope from 0 to 1 mm along x, of which the left fifth was not seen.
std::shared_ptr<const SeenMap> slope(uint32_t width, uint32_t height) {
  auto map = std::make_shared<SeenMap>();
  map->width = width;
  map->height = height;
  map->pitch_mm = 0.1;
  map->left_mm = -3;
  map->top_mm = 2;
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x)
      map->height_mm.push_back(5 * x < width ? std::numeric_limits<float>::quiet_NaN()
                                             : static_cast<float>(x) / static_cast<float>(width - 1));
  map->high_mm = 1;
  map->covered_mm2 = 0.8 * 0.01 * width * height;
  map->error_mm = 0.0012;
  map->pieces = map->keys = 1;
  map->way_mm = {{0, 3}, {2, 3}};
  return map;
}

TEST(MapView, ShowsAllOfAMapOfAnyShapeInOneScale) {
  for (const auto& [width, height] : {std::pair{600u, 200u}, {200u, 600u}, {3000u, 40u}, {1u, 1u}})
    for (const ViewRect& room : {ViewRect{40, 60, 467, 420}, ViewRect{0, 0, 264, 150}}) {
      const auto map = slope(width, height);
      const MapFit fit = fit_map(map.get(), room, {}, 1);
      const auto [left, top] = fit.at(map->left_mm, map->top_mm);
      const auto [right, foot] =
          fit.at(map->left_mm + (width - 1) * map->pitch_mm, map->top_mm + (height - 1) * map->pitch_mm);
      EXPECT_GE(left, corner(fit.picture).x);
      EXPECT_GE(top, corner(fit.picture).y);
      EXPECT_LE(right, far_corner(fit.picture).x);
      EXPECT_LE(foot, far_corner(fit.picture).y);
      // It is as large as it can be.
      const float across = (right - left) / size_of(fit.picture).x,
                  down = (foot - top) / size_of(fit.picture).y;
      EXPECT_GT(std::max(across, down), width > 1 ? 0.95f : -1.0f) << width << " x " << height;
      EXPECT_TRUE(inside(room, corner(fit.picture)));
    }
}

TEST(MapView, ColoursHeightsAndLeavesTheUnknownEmpty) {
  use_theme(false);
  const auto map = slope(100, 50);
  const MapFit fit = fit_map(map.get(), {0, 0, 400, 300}, {}, 1);
  Frame picture;
  paint_map(picture, map.get(), fit, ColourMap::Viridis);
  const auto colour_at = [&](double x_mm, double y_mm) {
    const auto [x, y] = fit.at(x_mm, y_mm);
    const auto u = static_cast<uint32_t>(x - corner(fit.picture).x),
               v = static_cast<uint32_t>(y - corner(fit.picture).y);
    return Rgb{static_cast<uint8_t>(picture.at(0, u, v)), static_cast<uint8_t>(picture.at(1, u, v)),
               static_cast<uint8_t>(picture.at(2, u, v))};
  };
  EXPECT_EQ(colour_at(-2.5, 4), theme().chart) << "not seen";
  for (const double share : {0.3, 0.6, 0.9}) {
    const auto wanted = colour_of(ColourMap::Viridis, share);
    const Rgb found = colour_at(map->left_mm + share * 99 * map->pitch_mm, 4);
    EXPECT_NEAR(found.red, 255 * double{wanted[0]}, 4) << share;
    EXPECT_NEAR(found.green, 255 * double{wanted[1]}, 4) << share;
    EXPECT_NEAR(found.blue, 255 * double{wanted[2]}, 4) << share;
  }
  paint_map(picture, nullptr, fit, ColourMap::Viridis);
  EXPECT_EQ(colour_at(2, 4), theme().chart) << "no map";
}

TEST(MapView, StaysWhereAPersonLooksWhileItGrows) {
  const ViewRect room{0, 0, 400, 300};
  const MapEye eye{.all = false, .x_mm = 1, .y_mm = 3, .px_per_mm = 40};
  EXPECT_EQ(fit_map(slope(100, 50).get(), room, eye, 1), fit_map(slope(900, 50).get(), room, eye, 1));
}

class MapMarks : public GpuTest {};

TEST_F(MapMarks, WordsHaveRoomFrom800x600On) {
  const RenderPass pass(context(), OffscreenTarget::kFormat, VK_SAMPLE_COUNT_1_BIT,
                        VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
  HudFrame frame(context(), pass, 1, nullptr, 1);
  auto many = std::make_shared<SeenMap>(*slope(600, 200));
  many->covered_mm2 = 12345;
  many->keys = 400;
  many->closed = 2200;
  many->pieces = 12;
  many->missed = 3;
  auto unknown = std::make_shared<SeenMap>(*slope(90, 90));
  unknown->error_mm = std::numeric_limits<double>::quiet_NaN();
  for (const std::shared_ptr<const SeenMap>& map :
       {std::shared_ptr<const SeenMap>(), slope(300, 100), std::shared_ptr<const SeenMap>(many),
        std::shared_ptr<const SeenMap>(unknown)})
    for (const auto& [width, height] : {std::pair{800u, 600u}, {1280u, 720u}, {1920u, 1080u}}) {
      SCOPED_TRACE(text("%u x %u, %s", width, height, map ? "a map" : "none"));
      const Layout layout =
          make_layout({width, height}, 1, {640, 480, 3, 8}, true, {.tools = true, .map = true});
      ASSERT_TRUE(layout.has_map);
      frame.begin({width, height});
      ImDrawList* list = ImGui::GetBackgroundDrawList();
      list->PushClipRect(corner(layout.map), far_corner(layout.map));
      MapLook look;
      look.map = map;
      look.pad_mm = {{0, 0}, {3, 0}, {3, 2}, {0, 2}};
      draw_map_marks(list, layout.map, look, {}, ColourMap::Viridis, 1);
      list->PopClipRect();
      ImGui::Render();
      const std::vector<Letter> letters = letters_of(*ImGui::GetDrawData());
      EXPECT_GT(letters.size(), 20u);
      EXPECT_EQ(fault_of(letters, 1), "");
    }
}

}  // namespace
}  // namespace palpate::viz
