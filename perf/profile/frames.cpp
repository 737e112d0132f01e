#include "perf/profile/frames.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "capture/synthetic/synthetic.h"

namespace palpate::perf {
namespace {

constexpr int kFrames = 2;
constexpr uint32_t kRest_gray = 60;

SyntheticMode mode_for(SurfaceReading reading) {
  if (reading == SurfaceReading::Photometric) return SyntheticMode::Gel;
  if (reading == SurfaceReading::Shading) return SyntheticMode::Lambert;
  return SyntheticMode::Waveguide;
}

/// Brighter by 40 to 140 gray levels, smoothly, so that slopes are neither flat nor clipped everywhere.
uint32_t touched_gray(double x, double y, uint32_t channel, int frame) {
  const double phase = 0.7 * frame + 2.1 * channel;
  return kRest_gray + 90 +
         static_cast<uint32_t>(std::lround(25 * std::sin(11 * x + phase) + 25 * std::cos(7 * y - phase)));
}

/// A camera's, without which a picture looks spoilt.
class Noise {
 public:
  Noise() {
    for (uint8_t& offset : offsets_)
      offset = static_cast<uint8_t>(std::lround(kNoise_gray * normal_(random_)) + kOffset);
  }

  void add(Frame& frame) {
    for (uint32_t channel = 0; channel < frame.format.channels; ++channel)
      for (uint32_t y = 0; y < frame.format.height; ++y) {
        uint8_t* row = frame.row(channel, y);
        const size_t first = random_() % offsets_.size();
        for (uint32_t x = 0; x < frame.format.width; ++x)
          row[x] = static_cast<uint8_t>(row[x] + offsets_[(first + x) % offsets_.size()] - kOffset);
      }
  }

 private:
  static constexpr double kNoise_gray = 1.2;
  static constexpr int kOffset = 16;
  std::mt19937 random_{1};
  std::normal_distribution<> normal_;
  std::array<uint8_t, 4096> offsets_{};
};

}  // namespace

Scene timing_scene(uint32_t width_px, uint32_t height_px, SurfaceReading reading, double touched_fraction) {
  // The synthetic sensor's calibration; only its pitch depends on the size.
  SyntheticOptions options;
  options.mode = mode_for(reading);
  Scene scene;
  scene.sensor = synthetic_sensor(options);
  scene.sensor.size_px = {width_px, height_px};
  scene.sensor.pitch_mm_per_px *= static_cast<double>(options.width) / width_px;

  FrameFormat format;
  format.width = width_px;
  format.height = height_px;
  format.channels = scene.sensor.channels;
  scene.background.reshape(format);
  std::fill(scene.background.bytes.begin(), scene.background.bytes.end(), uint8_t{kRest_gray});

  const double side = std::sqrt(std::clamp(touched_fraction, 0.0, 1.0)) / 2;
  const auto from = [&](uint32_t n) { return static_cast<uint32_t>(std::lround((0.5 - side) * n)); };
  const auto to = [&](uint32_t n) { return static_cast<uint32_t>(std::lround((0.5 + side) * n)); };
  Noise noise;
  for (int i = 0; i < kFrames; ++i) {
    Frame& frame = scene.frames.emplace_back(scene.background);
    frame.sequence = static_cast<uint64_t>(i);
    for (uint32_t channel = 0; channel < format.channels; ++channel) {
      std::vector<uint8_t> row(width_px);
      for (uint32_t y = from(height_px); y < to(height_px); ++y) {
        // Sixteen rows look alike: making 8192 x 8192 pixels must not take longer than measuring them.
        if (y % 16 == 0 || y == from(height_px)) {
          for (uint32_t x = 0; x < width_px; ++x)
            row[x] = static_cast<uint8_t>(touched_gray(static_cast<double>(x) / width_px,
                                                       static_cast<double>(y) / height_px, channel, i));
        }
        std::copy(row.begin() + from(width_px), row.begin() + to(width_px),
                  frame.row(channel, y) + from(width_px));
      }
    }
    noise.add(frame);
  }
  noise.add(scene.background);
  return scene;
}

}  // namespace palpate::perf
