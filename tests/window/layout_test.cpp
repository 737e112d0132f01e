// Layout of the picture: panels side by side at every size.
#include <gtest/gtest.h>

#include <tuple>

#include "viz/look/measures.h"
#include "viz/render/format.h"
#include "viz/render/layout.h"

namespace palpate::viz {
namespace {

TEST(Layout, PanelsNeverOverlapFrom480x320To4k) {
  const auto right = [](const ViewRect& r) { return r.x + static_cast<int64_t>(r.width); };
  const auto foot = [](const ViewRect& r) { return r.y + static_cast<int64_t>(r.height); };
  for (const auto& [width, height, scale] : {std::tuple{480u, 320u, 1.0f},
                                             {800u, 600u, 1.0f},
                                             {1280u, 720u, 1.0f},
                                             {1920u, 1080u, 1.0f},
                                             {3840u, 2160u, 1.0f},
                                             {1280u, 800u, 1.5f},
                                             {2560u, 1440u, 2.0f},
                                             {3840u, 2160u, 2.5f}}) {
    for (const bool surface : {false, true}) {
      for (const Panels& panels :
           {Panels{true, true}, Panels{true, false}, Panels{false, true}, Panels{false, false},
            Panels{true, true, 264}, Panels{false, false, 432}, Panels{true, true, 264, true},
            Panels{false, false, 0, true}, Panels{true, true, 264, true, true}, Panels{.tools = true}}) {
        SCOPED_TRACE(text("%u x %u at %g, surface %d, charts %d, profile %d, player %d", width, height, scale,
                          surface, panels.charts, panels.profile, panels.player));
        const Layout l = make_layout({width, height}, scale, {640, 480, 1, 8}, surface, panels);
        EXPECT_LE(right(l.pictures), l.panel.x);
        EXPECT_TRUE(!l.has_dock || right(l.dock) <= l.pictures.x);
        EXPECT_TRUE(!l.has_dock || foot(l.dock) <= foot(l.pictures));
        EXPECT_TRUE(panels.dock != 264 || static_cast<float>(width) < 800 * scale || l.has_dock);
        EXPECT_LE(right(l.panel), width);
        EXPECT_LE(foot(l.panel), l.status.y);
        EXPECT_LE(foot(l.status), height);
        if (l.has_tools) {
          EXPECT_EQ(foot(l.tools), l.pictures.y);
          EXPECT_LE(right(l.tools), l.panel.x);
          EXPECT_TRUE(!l.has_dock || foot(l.tools) <= l.dock.y);
        }
        EXPECT_EQ(l.has_player, panels.player);
        if (l.has_player) {
          EXPECT_GE(l.player.y, foot(l.pictures)) << "nothing of the picture is below the bar";
          EXPECT_GE(l.player.y, foot(l.dock));
          EXPECT_LE(right(l.player), l.panel.x);
          EXPECT_LE(foot(l.player), l.has_charts ? l.charts.y : l.status.y);
          EXPECT_GE(l.player.height, 20u);
        }
        if (l.has_charts) {
          EXPECT_LE(foot(l.pictures), l.charts.y);
          EXPECT_LE(foot(l.charts), l.status.y);
          EXPECT_LE(right(l.charts), l.has_profile ? l.profile.x : l.panel.x);
        }
        if (l.has_profile) {
          EXPECT_LE(foot(l.profile), l.status.y);
          EXPECT_LE(right(l.profile), l.panel.x);
        }
        const ViewRect& holder = surface ? l.panel : l.pictures;
        EXPECT_GE(l.image.x, holder.x);
        EXPECT_LE(right(l.image), right(holder));
        EXPECT_LE(foot(l.image), foot(holder));
        EXPECT_GE(l.pictures.height, (panels.tools ? 80u : 100u) * height / 720);
      }
    }
  }
}

// A large screen has more of everything, not a larger void.
TEST(Layout, NumbersImageAndChartsGrowWithTheWindow) {
  for (const auto& [width, height] :
       {std::pair{1280u, 720u}, {1920u, 1080u}, {2560u, 1440u}, {3840u, 2160u}}) {
    const Layout l = make_layout({width, height}, 1, {640, 480, 1, 8}, true, {.tools = true});
    SCOPED_TRACE(text("%u x %u", width, height));
    EXPECT_GE(l.panel.width, 0.17 * width);
    EXPECT_GE(l.image.width, 0.15 * width);
    EXPECT_GE(l.charts.height, 0.2 * height);
    EXPECT_GE(l.surface.width, 0.65 * width);
    EXPECT_GE(static_cast<uint32_t>(l.panel.height), l.numbers_y + 400u) << "the numbers keep their room";
  }
}

/// Whether they share a pixel.
bool meet(const ViewRect& a, const ViewRect& b) {
  return a.x < b.x + static_cast<int64_t>(b.width) && b.x < a.x + static_cast<int64_t>(a.width) &&
         a.y < b.y + static_cast<int64_t>(b.height) && b.y < a.y + static_cast<int64_t>(a.height);
}
bool lies_in(const ViewRect& a, const ViewRect& b) {
  return a.x >= b.x && a.y >= b.y &&
         a.x + static_cast<int64_t>(a.width) <= b.x + static_cast<int64_t>(b.width) &&
         a.y + static_cast<int64_t>(a.height) <= b.y + static_cast<int64_t>(b.height);
}

TEST(Layout, TheMapHasRoomOfItsOwnBesideThePictures) {
  for (const auto& [width, height] : {std::pair{480u, 320u}, {800u, 600u}, {1280u, 720u}, {1920u, 1080u}})
    for (int i = 0; i < 2 * kArrangements; ++i)
      for (const bool surface : {true, false}) {
        SCOPED_TRACE(text("%u x %u, %d, surface %d", width, height, i, surface));
        const Layout l = make_layout({width, height}, 1, {640, 480, 1, 8}, surface,
                                     {.tools = true,
                                      .arrangement = static_cast<Arrangement>(i / 2),
                                      .image_large = i % 2 != 0,
                                      .map = true});
        ASSERT_TRUE(l.has_map);
        EXPECT_TRUE(lies_in(l.map, l.pictures));
        EXPECT_GE(l.map.width * l.map.height, l.pictures.width * l.pictures.height / 3);
        EXPECT_FALSE(l.has_surface && meet(l.map, l.surface));
        EXPECT_FALSE(l.has_image && meet(l.map, l.image));
      }
  EXPECT_FALSE(make_layout({800, 600}, 1, {640, 480, 1, 8}, true).has_map);
}
uint64_t area(const ViewRect& r) {
  return uint64_t{r.width} * r.height;
}

TEST(Layout, SurfaceAndImageShareThePictureInSixWays) {
  for (const auto& [width, height, scale] : {std::tuple{480u, 320u, 1.0f},
                                             {800u, 600u, 1.0f},
                                             {720u, 1280u, 1.0f},
                                             {1280u, 720u, 1.0f},
                                             {3840u, 2160u, 1.0f},
                                             {3840u, 2160u, 2.0f}})
    for (const bool image_large : {false, true}) {
      SCOPED_TRACE(
          text("%u x %u at %g, image large %d", width, height, static_cast<double>(scale), image_large));
      const auto with = [&, w = width, h = height, s = scale](Arrangement arrangement, bool surface = true) {
        return make_layout({w, h}, s, {640, 480, 1, 8}, surface,
                           {.tools = true, .arrangement = arrangement, .image_large = image_large});
      };
      const Layout large = with(Arrangement::OneLarge);
      EXPECT_TRUE(large.has_surface && large.has_image && large.has_panel);
      EXPECT_TRUE(lies_in(image_large ? large.image : large.surface, large.pictures));
      EXPECT_TRUE(lies_in(image_large ? large.surface : large.image, large.panel));
      EXPECT_GT(large.numbers_y, image_large ? large.surface.y : large.image.y);
      const Layout equal = with(Arrangement::BothEqual);
      EXPECT_TRUE(equal.has_surface && equal.has_image && equal.has_panel);
      EXPECT_TRUE(lies_in(equal.image, equal.pictures) && lies_in(equal.surface, equal.pictures));
      EXPECT_FALSE(meet(equal.image, equal.surface));
      EXPECT_EQ(equal.image.x + equal.image.y > equal.surface.x + equal.surface.y, !image_large);
      EXPECT_NEAR(static_cast<double>(area(equal.surface)), 0.5 * static_cast<double>(area(equal.pictures)),
                  0.06 * static_cast<double>(area(equal.pictures)));
      EXPECT_LT(equal.numbers_y, large.numbers_y) << "nothing small stands over the numbers";
      const Layout alone = with(Arrangement::OneAlone);
      EXPECT_TRUE(alone.has_surface != alone.has_image && alone.has_image == image_large);
      EXPECT_FALSE(alone.has_panel || alone.has_charts || alone.has_profile);
      EXPECT_EQ(alone.pictures.width, width);
      EXPECT_EQ(alone.tools.width, width) << "the mouse finds the way back";
      EXPECT_TRUE(lies_in(image_large ? alone.image : alone.surface, alone.pictures));
      for (const Arrangement any : {Arrangement::OneLarge, Arrangement::BothEqual, Arrangement::OneAlone}) {
        const Layout none = with(any, false);
        EXPECT_TRUE(none.has_image && !none.has_surface);
        EXPECT_TRUE(lies_in(none.image, none.pictures));
        EXPECT_EQ(none.has_panel, any != Arrangement::OneAlone);
      }
    }
}

TEST(Layout, EdgesOfPanelsLieOnTheGrid) {
  for (const auto& [width, height, scale] : {std::tuple{800u, 600u, 1.0f},
                                             {1280u, 720u, 1.0f},
                                             {1920u, 1080u, 1.0f},
                                             {3840u, 2160u, 1.0f},
                                             {3840u, 2160u, 2.0f}}) {
    SCOPED_TRACE(text("%u x %u at %g", width, height, static_cast<double>(scale)));
    const Layout l =
        make_layout({width, height}, scale, {640, 480, 1, 8}, true,
                    {.charts = true, .profile = true, .dock = 264, .player = true, .tools = true});
    const auto grid = static_cast<uint32_t>(kGrid_px * scale);
    for (const ViewRect& r : {l.surface, l.tools, l.dock, l.player, l.charts, l.profile, l.panel, l.status}) {
      if (r.width <= 1) continue;  // it has no room
      EXPECT_EQ(r.x % static_cast<int32_t>(grid), 0) << r.x;
      EXPECT_EQ(r.y % static_cast<int32_t>(grid), 0) << r.y;
      EXPECT_EQ(r.width % grid, 0) << r.width;
      EXPECT_EQ(r.height % grid, 0) << r.height;
    }
  }
}

}  // namespace
}  // namespace palpate::viz
