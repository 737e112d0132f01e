#include "engine/measure/contact/smooth_touch.h"

#include <algorithm>
#include <cmath>

#include "engine/base/statistics.h"
#include "engine/measure/contact/gel_contacts.h"
#include "engine/measure/height_rows.h"
#include "engine/sensor/polynomial_normal.h"

namespace palpate {
namespace {

constexpr double kHighest = 0.99;  // of the heights where the image has changed
constexpr double kLeastNormal = 0.05;

}  // namespace

SmoothTouch::SmoothTouch(const Sensor& sensor, const FrameFormat& format)
    : sensor_(&sensor),
      max_gray_(format.max_gray()),
      cells_x_(cells_along(format.width)),
      cells_y_(cells_along(format.height)) {
  still_.reserve(cells_x_ * cells_y_);
  changed_.reserve(cells_x_ * cells_y_);
  slopes_.resize(cells_x_ * cells_y_);
}

// How much higher the surface lies where the image has changed than elsewhere outside of contacts.
double SmoothTouch::taken_off_mm(const Cells& cells) {
  still_.clear();
  changed_.clear();
  for (size_t i = 0; i < cells.at_rest.size(); ++i)
    if (cells.at_rest[i] != 0)
      (double{cells.raised[i]} < GelContacts::kFoot ? still_ : changed_).push_back(cells.level_mm[i]);
  if (changed_.empty()) return 0;
  return double{quantile_in_place(changed_, kHighest)} - double{median_in_place(still_)};
}

// The slope that each cell's colours show.
void SmoothTouch::find_slopes(const std::array<std::vector<float>, 3>& change_gray) {
  for (size_t y = 0; y < cells_y_; ++y)
    for (size_t x = 0; x < cells_x_; ++x) {
      const size_t cell = y * cells_x_ + x;
      std::array<double, 3> change;
      for (size_t c = 0; c < 3; ++c) change[c] = double{change_gray[c][cell]} / max_gray_;
      const auto n = polynomial_normal(sensor_->photometric, change,
                                       (2 * static_cast<double>(x) + 1) / static_cast<double>(cells_x_) - 1,
                                       (2 * static_cast<double>(y) + 1) / static_cast<double>(cells_y_) - 1);
      const double up = std::sqrt(std::max(1 - n[0] * n[0] - n[1] * n[1], kLeastNormal));
      slopes_[cell] = {n[0] / up, n[1] / up};
    }
}

SmoothTouch::TakenOff SmoothTouch::look_at(const Cells& cells) {
  const double deepest_mm = double{*std::ranges::max_element(cells.depth_mm)};
  if (taken_off_mm(cells) < std::max(kLeast_mm, kOfDepth * deepest_mm)) return TakenOff::Nothing;
  find_slopes(cells.change);
  const double apart_mm = 2.0 * shared::kCellSide * sensor_->pitch_mm_per_px;
  const auto height = [&](size_t cell) {
    return double{cells.level_mm[cell]} + double{cells.depth_mm[cell]};
  };
  double squares = 0, misfit = 0;
  size_t count = 0;
  for (size_t y = 1; y + 1 < cells_y_; ++y)
    for (size_t x = 1; x + 1 < cells_x_; ++x) {
      const size_t cell = y * cells_x_ + x;
      if (cells.at_rest[cell] == 0 || double{cells.raised[cell]} < GelContacts::kOnset) continue;
      // Between the middles of the two neighbours, as the heights' difference.
      const double across = (slopes_[cell - 1][0] + 2 * slopes_[cell][0] + slopes_[cell + 1][0]) / 4;
      const double down =
          (slopes_[cell - cells_x_][1] + 2 * slopes_[cell][1] + slopes_[cell + cells_x_][1]) / 4;
      squares += across * across + down * down;
      misfit += std::pow(across - (height(cell + 1) - height(cell - 1)) / apart_mm, 2) +
                std::pow(down - (height(cell + cells_x_) - height(cell - cells_x_)) / apart_mm, 2);
      ++count;
    }
  const bool clear = count >= kLeastCells && squares > kLeastSlope * kLeastSlope * static_cast<double>(count);
  if (!clear || misfit >= kMostMisfit * squares) return TakenOff::Nothing;
  return misfit < kSureMisfit * squares ? TakenOff::Touch : TakenOff::PerhapsTouch;
}

}  // namespace palpate
