#include "engine/calibrate/ball/finder.h"

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/base/statistics.h"
#include "engine/calibrate/ball/contact_fit.h"

namespace palpate {
namespace {

using ball::Change, ball::ContactFit, ball::kLeastRadius_px, ball::SlopeModel;
using Vector4 = Eigen::Vector4d;

// Coarse: the middle of what changes by a good part of the most that changes.
Vector4 coarse_start(const Change& change, uint32_t width, double level2) {
  std::vector<double> xs, ys;
  for (int y = 0; y < change.height; ++y)
    for (int x = 0; x < change.width; ++x)
      if (change.size2[static_cast<size_t>(y) * width + static_cast<size_t>(x)] > level2) {
        xs.push_back(x);
        ys.push_back(y);
      }
  const double area = static_cast<double>(xs.size());
  return {median(xs), median(ys),
          std::log(std::max(kLeastRadius_px, 1.05 * std::sqrt(area / std::numbers::pi))), std::log(0.5)};
}

}  // namespace

FoundBall find_ball(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                    const BallSearch& search) {
  auto [change, level2, found] = ball::pressed_picture(frame, background, mask, search);
  if (!found.good()) return found;
  const SlopeModel model{.kind = search.shape.kind,
                         .tip_px = search.shape.rounded_mm() / search.pitch_mm_per_px};
  const ContactFit fit =
      ball::fit_round(frame, background, mask, model, coarse_start(change, frame.format.width, level2), 1e9);
  found.center_x_px = fit.at[0];
  found.center_y_px = fit.at[1];
  found.radius_px = std::exp(fit.at[2]);
  if (!fit.enough()) {
    ball::check_coverage(found, frame, background, mask);
    if (found.good()) found.refuse(BallRefusal::TooSmall, "too few pixels change around it");
    return found;
  }
  ball::judge_fit(fit, model, background, found);
  ball::check_fit(found, change, level2, frame, background, mask, search);
  return found;
}

}  // namespace palpate
