// Touched tiles against a plain contact stage.
#include "engine/pipeline/contact_tiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/reference/contact.h"

namespace palpate {
namespace {

struct Scene {
  Sensor sensor;
  Frame background, frame;
};

// A random untouched image, noise on top of it, a few bright and dark blobs anywhere and single hot pixels.
Scene random_scene(const FrameFormat& format, Signal signal, double noise_gray, int blobs,
                   std::mt19937& random) {
  Scene scene;
  scene.sensor.pitch_mm_per_px = 0.05;
  scene.sensor.channels = format.channels;
  scene.sensor.bit_depth = format.bit_depth;
  scene.sensor.signal = signal;
  const double unit = (format.max_gray() + 1) / 256.0;
  scene.sensor.threshold_gray = 6 * unit;
  scene.sensor.saturation_gray = format.max_gray() - 1;
  scene.background.reshape(format);
  scene.frame.reshape(format);
  const auto any = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  struct Blob {
    double x, y, radius, gray;
  };
  std::vector<Blob> placed;
  for (int i = 0; i < blobs; ++i)
    placed.push_back({any(-5, format.width + 5), any(-5, format.height + 5), any(0.5, 20), any(-200, 200)});
  std::normal_distribution noise(0.0, noise_gray);
  for (uint32_t c = 0; c < format.channels; ++c) {
    for (uint32_t y = 0; y < format.height; ++y) {
      for (uint32_t x = 0; x < format.width; ++x) {
        const double rest = 90 + any(0, 40);
        double gray = rest + noise(random);
        for (const Blob& b : placed)
          if (std::hypot(x - b.x, y - b.y) < b.radius) gray += b.gray;
        if (blobs > 0 && any(0, 1) < 0.001) gray = 255;
        const auto level = [&](double value) {
          return static_cast<uint32_t>(std::clamp(value * unit, 0.0, double(format.max_gray())));
        };
        scene.background.set(c, x, y, level(rest));
        scene.frame.set(c, x, y, level(gray));
      }
    }
  }
  return scene;
}

const FrameFormat kFormats[] = {{64, 64, 1, 8}, {97, 70, 1, 8}, {31, 5, 1, 8},    {2, 131, 1, 8},
                                {65, 40, 3, 8}, {33, 33, 3, 8}, {130, 67, 1, 12}, {64, 97, 1, 16},
                                {1, 1, 1, 8},   {3, 2, 3, 8}};
constexpr Signal kSignals[] = {Signal::Brighter, Signal::Darker, Signal::Either};

// No contact pixel is missed, no tile without one is touched, and the count of saturated pixels is exact.
TEST(ContactTiles, FindsExactlyTheTilesWithContact) {
  std::mt19937 random(1);
  uint64_t touched = 0, untouched = 0;
  for (const FrameFormat& format : kFormats) {
    for (const Signal signal : kSignals) {
      for (int blobs = 0; blobs < 6; ++blobs) {
        const Scene scene = random_scene(format, signal, blobs % 2 ? 1 : 5, blobs, random);
        const std::string what = std::to_string(format.width) + " x " + std::to_string(format.height) +
                                 " x " + std::to_string(format.channels) + ", " +
                                 std::to_string(format.bit_depth) + " bits, " + to_string(signal) + ", " +
                                 std::to_string(blobs) + " blobs";
        ContactTiles finder(scene.sensor, format);
        finder.set_background(scene.background);
        finder.find(scene.background);  // what an earlier frame leaves does not matter
        const TouchedTiles& tiles = finder.find(scene.frame);
        const auto filtered = reference::filtered_change(scene.frame, scene.background, signal);
        const auto threshold = static_cast<uint32_t>(std::lround(scene.sensor.threshold_gray * 128)) * 2;
        std::vector<uint8_t> wanted(size_t{tiles.columns} * tiles.rows);
        uint32_t left = UINT32_MAX, top = UINT32_MAX, right = 0, bottom = 0;
        for (uint32_t y = 0; y < format.height; ++y) {
          for (uint32_t x = 0; x < format.width; ++x) {
            if (filtered[size_t{y} * format.width + x] < threshold) continue;
            bool near = false;
            for (int dy = -2; dy <= 2; ++dy) {
              for (int dx = -2; dx <= 2; ++dx) {
                const auto tx =
                    std::clamp<int64_t>(int64_t{x} + dx, 0, format.width - 1) / ContactTiles::kTile_px;
                const auto ty =
                    std::clamp<int64_t>(int64_t{y} + dy, 0, format.height - 1) / ContactTiles::kTile_px;
                const auto at = static_cast<size_t>(ty * tiles.columns + tx);
                wanted[at] = 1;
                near = near || tiles.touched[at];
              }
            }
            ASSERT_TRUE(near) << what << ": contact at " << x << ", " << y << " is missed";
          }
        }
        uint64_t count = 0;
        for (uint32_t row = 0; row < tiles.rows; ++row) {
          for (uint32_t column = 0; column < tiles.columns; ++column) {
            const size_t at = size_t{row} * tiles.columns + column;
            if (!tiles.touched[at]) {
              ++untouched;
              continue;
            }
            ASSERT_TRUE(wanted[at]) << what << ": tile " << column << ", " << row << " has no contact";
            ++count;
            left = std::min(left, column * 32);
            top = std::min(top, row * 32);
            right = std::min(std::max(right, column * 32 + 32), format.width);
            bottom = std::min(std::max(bottom, row * 32 + 32), format.height);
          }
        }
        touched += count;
        EXPECT_EQ(tiles.count, count) << what;
        EXPECT_EQ(tiles.box, count ? (PixelRect{left, top, right - left, bottom - top}) : PixelRect{})
            << what;
        EXPECT_EQ(tiles.saturated_px,
                  reference::moments(scene.frame, scene.background, scene.sensor).saturated)
            << what;
      }
    }
  }
  EXPECT_GT(touched, 200u);
  EXPECT_GT(untouched, 200u);
}

// Noise whose single pixels pass the threshold now and then, but no filtered one does.
TEST(ContactTiles, NoiseTouchesNothing) {
  std::mt19937 random(2);
  for (const FrameFormat& format : {FrameFormat{640, 480, 1, 8}, FrameFormat{200, 150, 1, 12}}) {
    const Scene scene = random_scene(format, Signal::Either, 2, 0, random);
    uint32_t loudest = 0;
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x)
        loudest =
            std::max(loudest, reference::change_at(scene.frame, scene.background, Signal::Either, x, y));
    EXPECT_GT(loudest, scene.sensor.threshold_gray);
    ContactTiles finder(scene.sensor, format);
    finder.set_background(scene.background);
    EXPECT_EQ(finder.find(scene.frame).count, 0u);
    EXPECT_EQ(finder.find(scene.frame).box, PixelRect{});
  }
}

}  // namespace
}  // namespace palpate
