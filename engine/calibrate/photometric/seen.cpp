#include "engine/calibrate/photometric/seen.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/base/statistics.h"
#include "engine/calibrate/photometric/press.h"

namespace palpate::photometric {
namespace {

constexpr uint32_t kSide = SeenColours::kSide;
constexpr double kOutliers = 1e-3;  // of the pixels, at each end of a colour
constexpr int kFewest_px = 3;       // of a bin, to count

// A sensor file is read by people.
double rounded(double value) {
  return std::round(value * 1e4) / 1e4;
}

}  // namespace

std::vector<PressError> press_errors(std::span<const PhotometricPress> presses,
                                     std::span<const HeldOutPress> held_out, const FrameFormat& format) {
  std::vector<PressError> errors;
  for (size_t i = 0; i < presses.size(); ++i) {
    if (!held_out[i].has_depth) continue;
    const FoundBall& contact = presses[i].truth->contact;
    for (const HeldOutPress::Place& place : held_out[i].places)
      errors.push_back({.across = rounded((2 * place.x_px + 1) / format.width - 1),
                        .down = rounded((2 * place.y_px + 1) / format.height - 1),
                        .radius = rounded(2 * contact.radius_px / format.width),
                        .depth_error = rounded(place.middle_error)});
  }
  return errors;
}

std::optional<SeenColours> seen_colours(std::span<const PhotometricPress> presses) {
  SeenColours seen;
  for (size_t c = 0; c < 3; ++c) {
    std::vector<double> changes{0};  // level pixels
    for (const PhotometricPress& p : presses)
      for (const Pixel& pixel : p.pixels) changes.push_back(pixel.change[c]);
    seen.low[c] = std::floor(quantile_in_place(changes, kOutliers) * 1e4) / 1e4;
    seen.high[c] = std::ceil(quantile_in_place(changes, 1 - kOutliers) * 1e4) / 1e4;
    if (!(seen.high[c] > seen.low[c])) return {};
  }
  std::map<std::array<uint32_t, 3>, int> counts;
  const auto bin_of = [&](const Pixel& pixel) {
    std::array<uint32_t, 3> bin{};
    for (size_t c = 0; c < 3; ++c) {
      const double share = (pixel.change[c] - seen.low[c]) / (seen.high[c] - seen.low[c]);
      bin[c] = std::min(static_cast<uint32_t>(std::clamp(share, 0.0, 1.0) * kSide), kSide - 1);
    }
    return bin;
  };
  for (const PhotometricPress& p : presses)
    for (const Pixel& pixel : p.pixels) ++counts[bin_of(pixel)];
  counts[bin_of({})] = kFewest_px;
  for (const auto& [bin, px] : counts)
    if (px >= kFewest_px) seen.bins[bin[2]] |= uint64_t{1} << (bin[1] * kSide + bin[0]);
  return seen;
}

}  // namespace palpate::photometric
