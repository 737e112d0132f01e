#include "engine/calibrate/ball/shading.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "engine/numeric/dense.h"

namespace palpate {
namespace {

constexpr double kWithin = 0.85;  // contact radii: beside the rim the pad is bent otherwise
constexpr size_t kLeastPixels = 200;

bool readable(const Frame& frame, const Frame& background, uint32_t x, uint32_t y) {
  for (uint32_t c = 0; c < 3; ++c)
    for (const Frame* image : {&frame, &background})
      if (image->at(c, x, y) == 0 || image->at(c, x, y) >= frame.format.max_gray()) return false;
  return true;
}

}  // namespace

std::optional<double> shaded_curvature_per_px2(const Frame& frame, const Frame& background,
                                               std::span<const uint8_t> mask, const FoundBall& ball) {
  ball::check_pair(frame, background, 3, mask);
  const FrameFormat& f = frame.format;
  const double radius_px = ball.radius_px, reach_px = kWithin * radius_px;
  const bool round = !(ball.half_length_px > 0);
  const double ux = std::cos(ball.axis_rad), uy = std::sin(ball.axis_rad);
  Eigen::Matrix4d gram = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();  // of the channels' sum
  double light = 0;
  size_t pixels = 0;
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x) {
      const MiddleOffset offset = offset_from(ball, x, y);
      if (offset.at_end || offset.px > reach_px || (!mask.empty() && mask[size_t{y} * f.width + x]) ||
          !readable(frame, background, x, y))
        continue;
      const double u = offset.dx_px / radius_px, v = offset.dy_px / radius_px;
      // Across a cylinder u and v are one; the light changes along it.
      const double along = (x - ball.center_x_px) * ux + (y - ball.center_y_px) * uy;
      const double first = round ? u : v * ux - u * uy, second = round ? v : along / ball.half_length_px;
      const Eigen::Vector4d basis(1, first, second, -0.5 * (u * u + v * v));
      double change = 0;
      for (uint32_t c = 0; c < 3; ++c) {
        change += static_cast<double>(frame.at(c, x, y)) - static_cast<double>(background.at(c, x, y));
        light += background.at(c, x, y);
      }
      gram += basis * basis.transpose();
      right += change * basis;
      ++pixels;
    }
  if (pixels < kLeastPixels) return std::nullopt;
  const Eigen::Vector4d fitted = dense::solve_ldlt<4>(gram, right);
  return fitted[3] / (light / static_cast<double>(pixels)) / (radius_px * radius_px);
}

}  // namespace palpate
