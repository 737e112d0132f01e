// Pattern of printed markers, measured in one untouched image, against the simulator's own.
#include "capture/calibrate/frame/markers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "tests/scenes/synthetic_run.h"

namespace palpate {
namespace {

std::optional<SkinPattern> measured(const SyntheticRun& run) {
  Sensor bare = run.sensor;
  bare.skin.reset();
  return marker_pattern(run.background, bare);
}

TEST(MarkerPattern, IsTheSimulators) {
  for (const std::string size : {"320x240", "480x360", "640x480"}) {
    const SyntheticRun run("press?mode=gel&skin=markers&size=" + size);
    const std::optional<SkinPattern> found = measured(run);
    ASSERT_TRUE(found) << size;
    std::printf("%s: %.2f px wide of %.2f, %.2f apart of %.2f\n", size.c_str(), found->size_px,
                run.sensor.skin->size_px, found->spacing_px, run.sensor.skin->spacing_px);
    EXPECT_EQ(found->kind, SkinKind::Markers);
    EXPECT_NEAR(found->spacing_px, run.sensor.skin->spacing_px, 0.06 * run.sensor.skin->spacing_px) << size;
    EXPECT_NEAR(found->size_px, run.sensor.skin->size_px, 0.25 * run.sensor.skin->size_px) << size;
  }
}

// Dots of 4 px every 11 px: with a rim of two they would hide two fifths of the frame.
TEST(FindMarkers, MasksSmallDotsThatStandClose) {
  const SyntheticRun marked("press?mode=gel&size=320x240&skin=markers"), plain("press?mode=gel&size=320x240");
  Sensor bare = marked.sensor;
  bare.skin.reset();
  const std::vector<uint8_t> mask = find_markers(marked.background, bare);
  ASSERT_EQ(mask.size(), 320u * 240);
  size_t dots = 0, missed = 0, masked = 0;
  for (uint32_t y = 0; y < 240; ++y)
    for (uint32_t x = 0; x < 320; ++x) {
      const bool dot = marked.background.at(1, x, y) < 0.8 * plain.background.at(1, x, y);
      const bool hidden = mask[size_t{y} * 320 + x] != 0;
      dots += dot, masked += hidden, missed += dot && !hidden;
    }
  EXPECT_GT(dots, 5000u);
  EXPECT_LT(missed, dots / 50);
  EXPECT_LT(masked, 3.5 * static_cast<double>(dots));
}

TEST(MarkerPattern, IsNotOfBareSkinNorOfDirt) {
  for (const char* skin : {"none", "texture"})
    EXPECT_FALSE(measured(SyntheticRun(std::string("press?mode=gel&size=320x240&skin=") + skin))) << skin;
  SyntheticRun dirty("press?mode=gel&size=320x240&skin=none");
  std::mt19937 random(7);
  for (int speck = 0; speck < 40; ++speck) {
    const auto cx = static_cast<int>(10 + random() % 300), cy = static_cast<int>(10 + random() % 220),
               radius = static_cast<int>(2 + random() % 3);
    for (int y = -radius; y <= radius; ++y)
      for (int x = -radius; x <= radius; ++x)
        if (x * x + y * y <= radius * radius)
          for (uint32_t c = 0; c < 3; ++c)
            dirty.background.set(c, static_cast<uint32_t>(cx + x), static_cast<uint32_t>(cy + y), 20);
  }
  EXPECT_FALSE(find_markers(dirty.background, dirty.sensor).empty());  // what a fit leaves out
  EXPECT_FALSE(measured(dirty));
}

}  // namespace
}  // namespace palpate
