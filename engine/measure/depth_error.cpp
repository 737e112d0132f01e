#include "engine/measure/depth_error.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {
namespace {

using shared::kCellSide;

uint32_t cells_of(uint32_t size_px) {
  return (size_px + kCellSide - 1) / kCellSide;
}

// Pixels of a frame's cell along one axis.
uint32_t pixels_of(uint32_t cell, uint32_t size_px) {
  return std::min(kCellSide, size_px - cell * kCellSide);
}

}  // namespace

DepthError::DepthError(const PhotometricCalibration& calibration, const FrameFormat& format)
    : format_(format),
      presses_(calibration.presses),
      colours_(calibration.colours),
      cells_x_(cells_of(format.width)) {
  const double tall = static_cast<double>(format.height) / format.width;
  for (const PressError& p : presses_) {
    places_.push_back({p.across, p.down * tall});
    mean_square_ += p.depth_error * p.depth_error;
  }
  if (const auto n = static_cast<double>(presses_.size()); n >= kFewest) {
    mean_square_ /= n;
    few_ = (n + 1) / n * (n - 1) / (n - 3);
  }
  for (uint32_t y = 0; y < cells_of(format.height); ++y)
    for (uint32_t x = 0; x < cells_x_; ++x)
      saw_cell_.push_back(
          saw_place(x * kCellSide + 0.5 * (kCellSide - 1), y * kCellSide + 0.5 * (kCellSide - 1)));
}

bool DepthError::states_error(const Sensor& sensor) {
  return sensor.reading == SurfaceReading::Photometric && sensor.photometric.presses.size() >= kFewest;
}

bool DepthError::states_seen(const Sensor& sensor) {
  return sensor.reading == SurfaceReading::Photometric &&
         (!sensor.photometric.presses.empty() || sensor.photometric.colours);
}

DepthError::Place DepthError::place_of(double x_px, double y_px) const {
  return {(2 * x_px + 1 - format_.width) / format_.width, (2 * y_px + 1 - format_.height) / format_.width};
}

double DepthError::relative(double x_px, double y_px) const {
  if (presses_.size() < kFewest) return 0;
  const Place at = place_of(x_px, y_px);
  double weight = 1, square = mean_square_;
  for (size_t i = 0; i < presses_.size(); ++i) {
    const double apart = std::hypot(at.x - places_[i].x, at.y - places_[i].y) / kReach;
    const double near = std::exp(-apart * apart / 2);
    weight += near;
    square += near * presses_[i].depth_error * presses_[i].depth_error;
  }
  return std::sqrt(few_ * square / weight);
}

bool DepthError::saw_place(double x_px, double y_px) const {
  if (presses_.empty()) return true;
  const Place at = place_of(x_px, y_px);
  std::vector<double> directions;
  for (size_t i = 0; i < places_.size(); ++i) {
    const double dx = places_[i].x - at.x, dy = places_[i].y - at.y;
    if (std::hypot(dx, dy) <= presses_[i].radius + kSeen) return true;
    directions.push_back(std::atan2(dy, dx));
  }
  // Between presses there are some in every half of the compass.
  std::ranges::sort(directions);
  directions.push_back(directions.front() + 2 * std::numbers::pi);
  for (size_t i = 1; i < directions.size(); ++i)
    if (directions[i] - directions[i - 1] >= std::numbers::pi) return false;
  return true;
}

DepthError::SeenPart DepthError::seen_part() const {
  double seen = 0;
  uint32_t left = format_.width, top = format_.height, right = 0, bottom = 0;
  for (uint32_t i = 0; i < saw_cell_.size(); ++i) {
    if (saw_cell_[i] == 0) continue;
    const uint32_t x = i % cells_x_, y = i / cells_x_;
    const uint32_t wide = pixels_of(x, format_.width), tall = pixels_of(y, format_.height);
    seen += static_cast<double>(wide * tall);
    left = std::min(left, x * kCellSide), right = std::max(right, x * kCellSide + wide);
    top = std::min(top, y * kCellSide), bottom = std::max(bottom, y * kCellSide + tall);
  }
  if (seen <= 0) return {};
  return {seen / static_cast<double>(size_t{format_.width} * format_.height),
          {left, top, right - left, bottom - top}};
}

bool DepthError::saw_colour(const std::array<double, 3>& change) const {
  if (!colours_) return true;
  constexpr int kBins = SeenColours::kSide;
  std::array<int, 3> bin{};
  for (size_t c = 0; c < 3; ++c) {
    const double wide = (colours_->high[c] - colours_->low[c]) / kBins;
    bin[c] =
        static_cast<int>(std::floor(std::clamp((change[c] - colours_->low[c]) / wide, -2.0, kBins + 1.0)));
  }
  for (int b = std::max(bin[2] - 1, 0); b <= std::min(bin[2] + 1, kBins - 1); ++b)
    for (int g = std::max(bin[1] - 1, 0); g <= std::min(bin[1] + 1, kBins - 1); ++g)
      for (int r = std::max(bin[0] - 1, 0); r <= std::min(bin[0] + 1, kBins - 1); ++r)
        if (colours_->bins[static_cast<size_t>(b)] >> (g * kBins + r) & 1) return true;
  return false;
}

DepthError::Extrapolated DepthError::mark(std::span<const shared::CellChange> changes,
                                          std::span<const float> depth_mm, double dented_mm,
                                          std::span<uint8_t> marks) const {
  Extrapolated sum;
  for (size_t i = 0; i < depth_mm.size(); ++i) {
    marks[i] = 0;
    if (!(double{depth_mm[i]} >= dented_mm)) continue;
    const auto x = static_cast<uint32_t>(i % cells_x_), y = static_cast<uint32_t>(i / cells_x_);
    const uint64_t px = uint64_t{pixels_of(x, format_.width)} * pixels_of(y, format_.height);
    const double full = static_cast<double>(px) * format_.max_gray();
    const shared::CellChange& c = changes[i];
    marks[i] = saw_cell_[i] == 0 || !saw_colour({c.red / full, c.green / full, c.blue / full});
    sum.dented_px += px;
    sum.px += marks[i] != 0 ? px : 0;
  }
  return sum;
}

}  // namespace palpate
