#include "engine/pad/layer_continuation.h"

#include <algorithm>
#include <cmath>

namespace palpate {

LayerContinuation::LayerContinuation(const LayerKernel& kernel, uint32_t width, uint32_t height,
                                     uint32_t margin, bool shear)
    : layer_(kernel, width + 2 * margin, height + 2 * margin, shear) {
  for (uint32_t y = 0; y < layer_.height(); ++y)
    for (uint32_t x = 0; x < layer_.width(); ++x) {
      const uint32_t column = std::clamp(x, margin, margin + width - 1) - margin;
      const uint32_t row = std::clamp(y, margin, margin + height - 1) - margin;
      if (x == column + margin && y == row + margin) inside_.push_back(y * layer_.width() + x);
      nearest_.push_back(row * width + column);
    }
  wide_.resize(nearest_.size());
  answer_.resize(nearest_.size());
  share_.resize(nearest_.size());
  carried_.resize(inside_.size());
  set_reach(margin);
}

void LayerContinuation::set_reach(double cells) {
  if (cells == reach_) return;
  reach_ = cells;
  std::ranges::fill(carried_, CarriedLoad{.cells = 0});
  for (size_t i = 0; i < nearest_.size(); ++i) {
    const uint32_t width = layer_.width(), nearest = inside_[nearest_[i]], nearest_row = nearest / width;
    const size_t row = i / width;
    const double x = static_cast<double>(i % width) - nearest % width;
    const double y = static_cast<double>(row) - nearest_row;
    const double far = std::hypot(x, y);
    share_[i] = far > 0 ? std::clamp(cells + 0.5 - far, 0.0, 1.0) : 1;
    CarriedLoad& load = carried_[nearest_[i]];
    load.cells += share_[i];
    load.x_cells += share_[i] * x;
    load.y_cells += share_[i] * y;
  }
}

void LayerContinuation::widen(const std::vector<double>& pressure) {
  for (size_t i = 0; i < wide_.size(); ++i) wide_[i] = share_[i] * pressure[nearest_[i]];
}

uint32_t LayerContinuation::margin_cells(const LayerKernel& kernel, uint32_t width, uint32_t height) {
  const double most = std::floor(std::min(width, height) / 2.0);
  return static_cast<uint32_t>(std::clamp(std::ceil(kernel.thickness_cells()), 1.0, std::max(1.0, most)));
}

void LayerContinuation::crop(const std::vector<double>& from, std::vector<double>& to) const {
  to.resize(inside_.size());
  for (size_t i = 0; i < inside_.size(); ++i) to[i] = from[inside_[i]];
}

void LayerContinuation::depth_by_pressure(const std::vector<double>& pressure, std::vector<double>& depth) {
  widen(pressure);
  layer_.depth_by_pressure(wide_, answer_);
  crop(answer_, depth);
}

void LayerContinuation::pressure_by_depth(const std::vector<double>& depth, std::vector<double>& pressure) {
  std::fill(wide_.begin(), wide_.end(), 0);
  for (size_t i = 0; i < inside_.size(); ++i) wide_[inside_[i]] = depth[i];
  layer_.depth_by_pressure(wide_, answer_);
  std::fill(pressure.begin(), pressure.end(), 0);
  for (size_t i = 0; i < answer_.size(); ++i) pressure[nearest_[i]] += share_[i] * answer_[i];
}

void LayerContinuation::shift_by_pressure(const std::vector<double>& pressure, std::vector<double>& x,
                                          std::vector<double>& y) {
  widen(pressure);
  layer_.shift_by_pressure(wide_, answer_, other_answer_);
  crop(answer_, x);
  crop(other_answer_, y);
}

}  // namespace palpate
