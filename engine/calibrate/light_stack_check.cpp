#include "engine/calibrate/light_stack_check.h"

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "engine/numeric/dense.h"

namespace palpate {
namespace {

constexpr uint32_t kBands = 8;

/// Root of the mean square over two parts, each judged by a fit to the rest.
double held_out(const LightImages& images, std::span<const float> truth_mm, double pitch_mm_per_px, int order,
                const std::function<bool(uint32_t)>& second) {
  double squares = 0, pixels = 0;
  for (const bool part : {false, true}) {
    std::vector<uint8_t> held, use;
    for (uint32_t y = 0; y < images.height; ++y) {
      held.insert(held.end(), images.width, second(y) == part);
      use.insert(use.end(), images.width, second(y) != part);
    }
    const LightStack stack = fit_light_stack(images, truth_mm, use, pitch_mm_per_px, order);
    const std::vector<float> height_mm =
        integrate_slopes(slopes_of(stack, images), images.width, images.height, pitch_mm_per_px);
    const LevelledError error = levelled_error(height_mm, truth_mm, held, images.width);
    if (error.pixels == 0) continue;
    squares += error.rms_mm * error.rms_mm * static_cast<double>(error.pixels);
    pixels += static_cast<double>(error.pixels);
  }
  return std::sqrt(squares / pixels);
}

}  // namespace

LevelledError levelled_error(std::span<const float> height_mm, std::span<const float> truth_mm,
                             std::span<const uint8_t> use, uint32_t width) {
  Eigen::Matrix3d gram = Eigen::Matrix3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  double squares = 0;
  LevelledError error;
  const double rows = static_cast<double>(truth_mm.size()) / width;
  for (size_t at = 0; at < truth_mm.size(); ++at) {
    const double e = static_cast<double>(height_mm[at]) - static_cast<double>(truth_mm[at]);
    if (!use[at] || !std::isfinite(e)) continue;
    const size_t x = at % width, y = at / width;
    const Eigen::Vector3d v(1, static_cast<double>(x) / width - 0.5, static_cast<double>(y) / rows - 0.5);
    gram += v * v.transpose();
    to += e * v;
    squares += e * e;
    ++error.pixels;
  }
  if (error.pixels == 0) return {std::numeric_limits<double>::quiet_NaN(), 0};
  const double left = squares - to.dot(Eigen::Vector3d(dense::shortest_solution(gram, to)));
  error.rms_mm = std::sqrt(std::max(left, 0.0) / static_cast<double>(error.pixels));
  return error;
}

HeldOutHeights judge_light_stack(const LightImages& images, std::span<const float> truth_mm,
                                 double pitch_mm_per_px, int order) {
  const uint32_t band = std::max(1u, (images.height + kBands - 1) / kBands);
  HeldOutHeights found;
  found.order = order;
  found.bands_mm =
      held_out(images, truth_mm, pitch_mm_per_px, order, [band](uint32_t y) { return y / band % 2 == 1; });
  found.halves_mm =
      held_out(images, truth_mm, pitch_mm_per_px, order, [&](uint32_t y) { return y >= images.height / 2; });
  return found;
}

}  // namespace palpate
