#include "engine/measure/rest_correction.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr uint32_t kSmoothing_cells = 2;

}  // namespace

RestCorrection::RestCorrection(uint32_t width, uint32_t height)
    : cells_x_(cells_along(width)), cells_y_(cells_along(height)), membrane_(cells_x_, cells_y_) {
  for (std::vector<float>* map : {&means_, &levels_, &scratch_, &depth_mm_})
    map->resize(size_t{cells_x_} * cells_y_);
}

bool RestCorrection::find(std::span<const uint8_t> at_rest) {
  const auto count = std::ranges::count_if(at_rest, [](uint8_t rest) { return rest != 0; });
  if (static_cast<double>(count) < kLeastAtRest * static_cast<double>(at_rest.size())) return false;
  levels_ = means_;
  membrane_.fill(levels_, at_rest);
  // A narrow bump is not the surface's error, but perhaps a touch that was not noticed.
  for (int pass = 0; pass < 2; ++pass) smooth();
  double sum = 0, squares = 0;
  for (size_t i = 0; i < levels_.size(); ++i) {
    depth_mm_[i] = means_[i] - levels_[i];
    if (at_rest[i] == 0) continue;
    sum += double{means_[i]};
    squares += std::pow(double{means_[i]}, 2);
  }
  const auto n = static_cast<double>(count);
  rest_level_mm_ = sum / n;
  error_mm_ = std::sqrt(std::max(squares / n - std::pow(rest_level_mm_, 2), 0.0));
  return true;
}

void RestCorrection::smooth() {
  const uint32_t width = cells_x_, height = cells_y_;
  // As far to both sides: a tilt stays one up to the border.
  const auto reach = [](uint32_t i, uint32_t length) {
    return std::min({kSmoothing_cells, i, length - 1 - i});
  };
  for (uint32_t y = 0; y < height; ++y) {
    const float* from = levels_.data() + size_t{y} * width;
    for (uint32_t x = 0; x < width; ++x) {
      const uint32_t r = reach(x, width);
      float sum = 0;
      for (uint32_t k = x - r; k <= x + r; ++k) sum += from[k];
      scratch_[size_t{y} * width + x] = sum / static_cast<float>(2 * r + 1);
    }
  }
  for (uint32_t y = 0; y < height; ++y) {
    const uint32_t r = reach(y, height);
    float* to = levels_.data() + size_t{y} * width;
    std::fill_n(to, width, 0.0f);
    for (uint32_t k = y - r; k <= y + r; ++k)
      for (uint32_t x = 0; x < width; ++x) to[x] += scratch_[size_t{k} * width + x];
    for (uint32_t x = 0; x < width; ++x) to[x] /= static_cast<float>(2 * r + 1);
  }
}

}  // namespace palpate
