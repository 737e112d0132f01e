#include "engine/measure/bending.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/base/divide_up.h"

namespace palpate {
namespace {

constexpr double kOfThickness = 0.25;
constexpr double kReach = 3;  // standard deviations of the bell
constexpr uint32_t kSide = shared::kCellSide;

}  // namespace

Bending::Bending(const FrameFormat& format, double pitch_mm_per_px, double thickness_mm)
    : format_(format),
      cells_x_(divide_up(format.width, kSide)),
      cells_y_(divide_up(format.height, kSide)),
      cell_mm_(kSide * pitch_mm_per_px) {
  const double sd = std::max(kOfThickness * thickness_mm / cell_mm_, 1e-3);
  const auto most = static_cast<double>(std::max(cells_x_, cells_y_));
  const auto reach = static_cast<size_t>(std::ceil(std::min(kReach * sd, most)));
  double sum = 0;
  for (size_t i = 0; i <= reach; ++i) {
    const double far = static_cast<double>(i) / sd;
    bell_.push_back(static_cast<float>(std::exp(-0.5 * far * far)));
    sum += (i == 0 ? 1 : 2) * double{bell_.back()};
  }
  for (float& one : bell_) one /= static_cast<float>(sum);
  change_.resize(size_t{cells_x_} * cells_y_);
  squares_.resize(change_.size());
  row_.resize(std::max(cells_x_, cells_y_) + 2 * reach);
}

void Bending::set_background(const Frame& background) {
  for (uint32_t colour = 0; colour < 3; ++colour) {
    double sum = 0;
    for (uint32_t y = 0; y < format_.height; ++y)
      for (uint32_t x = 0; x < format_.width; ++x) sum += background.at(colour, x, y);
    mean_gray_[colour] =
        std::max(static_cast<float>(sum / (double{1} * format_.width * format_.height)), 1.0f);
  }
}

// Along rows, then along columns; the picture goes on as it ends.
void Bending::smooth() {
  const size_t reach = bell_.size() - 1;
  const auto along = [&](size_t first, size_t step, size_t count) {
    for (size_t i = 0; i < row_.size() && i < count + 2 * reach; ++i)
      row_[i] = change_[first + step * (std::clamp(i, reach, reach + count - 1) - reach)];
    for (size_t i = 0; i < count; ++i) {
      float sum = bell_[0] * row_[i + reach];
      for (size_t far = 1; far <= reach; ++far)
        sum += bell_[far] * (row_[i + reach - far] + row_[i + reach + far]);
      change_[first + step * i] = sum;
    }
  };
  for (size_t y = 0; y < cells_y_; ++y) along(y * cells_x_, 1, cells_x_);
  for (size_t x = 0; x < cells_x_; ++x) along(x, cells_x_, cells_y_);
}

double Bending::measure(std::span<const shared::CellChange> cells) {
  std::ranges::fill(squares_, 0.0f);
  for (uint32_t colour = 0; colour < 3; ++colour) {
    for (uint32_t y = 0; y < cells_y_; ++y)
      for (uint32_t x = 0; x < cells_x_; ++x) {
        const size_t cell = size_t{y} * cells_x_ + x;
        const shared::CellChange& c = cells[cell];
        const int sum = colour == 0 ? c.red : colour == 1 ? c.green : c.blue;
        const uint32_t pixels =
            std::min(kSide, format_.width - x * kSide) * std::min(kSide, format_.height - y * kSide);
        change_[cell] = static_cast<float>(sum) / (static_cast<float>(pixels) * mean_gray_[colour]);
      }
    smooth();
    for (uint32_t y = 0; y < cells_y_; ++y)
      for (uint32_t x = 0; x < cells_x_; ++x) {
        const auto slope = [&](uint32_t at, uint32_t count, size_t first, size_t step) {
          const uint32_t before = at - std::min(at, 1u), after = std::min(at + 1, count - 1);
          return after == before ? 0
                                 : (change_[first + after * step] - change_[first + before * step]) /
                                       static_cast<float>(after - before);
        };
        const float across = slope(x, cells_x_, size_t{y} * cells_x_, 1),
                    down = slope(y, cells_y_, x, cells_x_);
        squares_[size_t{y} * cells_x_ + x] += across * across + down * down;
      }
  }
  const double steepness = std::accumulate(squares_.begin(), squares_.end(), 0.0, [](double sum, float one) {
    return sum + std::sqrt(double{one});
  });
  return steepness * cell_mm_;
}

}  // namespace palpate
