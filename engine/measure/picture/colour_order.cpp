#include "engine/measure/picture/colour_order.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// Correlation of the colours in another order, and its lead over the right order. On ten clips and a set of
// presses the lead was at most -0.25 where nothing was exchanged, and at least 1.1 where red and blue were.
constexpr double kOtherOrder = 0.6, kOtherLead = 0.5;
constexpr double kLeastColour_gray = 1;
constexpr size_t kEvery = 7;  // of the places: enough, and no divisor of a usual number in a row

std::array<double, 3> colour_at(std::span<const float> planes, size_t at) {
  const size_t plane = planes.size() / 3;
  std::array<double, 3> colour{planes[at], planes[plane + at], planes[2 * plane + at]};
  const double gray = (colour[0] + colour[1] + colour[2]) / 3;
  for (double& value : colour) value -= gray;
  return colour;
}

}  // namespace

bool follows_another_order(std::span<const float> now, std::span<const float> untouched) {
  const size_t places = untouched.size() / 3;
  std::array<std::array<double, 3>, 3> products{};
  double now_squares = 0, untouched_squares = 0, looked_at = 0;
  for (size_t at = 0; at < places; at += kEvery) {
    ++looked_at;
    const std::array<double, 3> a = colour_at(now, at), b = colour_at(untouched, at);
    for (size_t i = 0; i < 3; ++i) {
      now_squares += a[i] * a[i];
      untouched_squares += b[i] * b[i];
      for (size_t j = 0; j < 3; ++j) products[i][j] += a[i] * b[j];
    }
  }
  if (untouched_squares < kLeastColour_gray * kLeastColour_gray * looked_at) return false;
  std::array<double, kChannelOrders.size()> likeness{};
  for (size_t order = 0; order < likeness.size(); ++order)
    for (size_t c = 0; c < 3; ++c)
      likeness[order] +=
          products[kChannelOrders[order][c]][c] / (std::sqrt(now_squares * untouched_squares) + 1e-30);
  const double other = *std::max_element(likeness.begin() + 1, likeness.end());
  return other > kOtherOrder && other - likeness[0] > kOtherLead;
}

}  // namespace palpate
