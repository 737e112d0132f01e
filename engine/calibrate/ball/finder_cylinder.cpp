// Contact of a cylinder that lies on the pad: its axis, half width and ends.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "engine/base/statistics.h"
#include "engine/calibrate/ball/contact_fit.h"
#include "engine/calibrate/ball/finder.h"

namespace palpate {
namespace {

using ball::Change, ball::ContactFit, ball::kLeastRadius_px, ball::SlopeModel;
using Vector4 = Eigen::Vector4d;

constexpr double kLongerThanWide = 1.5;  // length over width of a contact whose axis can be told
constexpr double kBin_px = 3;            // along the axis, where the ends are looked for
constexpr size_t kLeastInBin = 6;        // pixels

// Part of the axis along which the pad is pressed, px from the pivot.
struct Extent {
  double from = 0, to = 0;
  double half() const { return (to - from) / 2; }
};

// Coarse: the principal axis of what changes by a good part of the most that changes.
struct Strip {
  SlopeModel model{.kind = PressedShape::Kind::Cylinder};
  Extent extent;
  double half_width_px = kLeastRadius_px;
};

Strip coarse_strip(const Change& change, double level2) {
  std::vector<double> xs, ys;
  for (int y = 0; y < change.height; ++y)
    for (int x = 0; x < change.width; ++x)
      if (change.size2[static_cast<size_t>(y) * static_cast<size_t>(change.width) + static_cast<size_t>(x)] >
          level2) {
        xs.push_back(x);
        ys.push_back(y);
      }
  Strip strip;
  SlopeModel& model = strip.model;
  model.pivot_x_px = median(xs);
  model.pivot_y_px = median(ys);
  double xx = 0, xy = 0, yy = 0;
  for (size_t i = 0; i < xs.size(); ++i) {
    const double dx = xs[i] - model.pivot_x_px, dy = ys[i] - model.pivot_y_px;
    xx += dx * dx, xy += dx * dy, yy += dy * dy;
  }
  model.axis_rad = 0.5 * std::atan2(2 * xy, xx - yy);
  std::vector<double> along, across;
  along.reserve(xs.size()), across.reserve(xs.size());
  for (size_t i = 0; i < xs.size(); ++i) {
    const SlopeModel::At at = model.at(Vector4::Zero(), xs[i], ys[i]);
    along.push_back(at.along);
    across.push_back(at.r);
  }
  strip.extent = {quantile_in_place(along, 0.02), quantile_in_place(along, 0.98)};
  strip.half_width_px = std::max(kLeastRadius_px, quantile_in_place(across, 0.9));
  model.reach_px = std::max(strip.extent.half(), kLeastRadius_px);
  return strip;
}

ContactFit fit_strip(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                     const Strip& strip, const Vector4& start) {
  const FrameFormat& f = frame.format;
  return ball::fit_contact(
      strip.model, start, 0.4 * std::min(f.width, f.height), [&](const Vector4& unknowns) {
        const double half_px = std::exp(unknowns[2]), reach = ball::kWindow * half_px;
        const auto wanted = [&](double x, double y) {
          const SlopeModel::At at = strip.model.at(unknowns, x, y);
          return at.r <= reach && at.along >= strip.extent.from + half_px &&
                 at.along <= strip.extent.to - half_px;
        };
        const double middle = (strip.extent.from + strip.extent.to) / 2, ux = std::cos(strip.model.axis_rad),
                     uy = std::sin(strip.model.axis_rad), half = strip.extent.half();
        const ball::SampleBox box{strip.model.pivot_x_px + middle * ux, strip.model.pivot_y_px + middle * uy,
                                  std::abs(half * ux) + 2 * reach, std::abs(half * uy) + 2 * reach};
        return ball::samples_in(frame, background, mask, box, wanted);
      });
}

// How much of the fitted change each part of the axis shows, 1: as much as all of it; none where too little
// is seen.
std::vector<std::optional<double>> shown_along(const Change& change, std::span<const uint8_t> mask,
                                               const SlopeModel& model, const ContactFit& fit,
                                               double reach_px) {
  const double half_px = std::exp(fit.at[2]), decay = std::exp(fit.at[3]);
  const auto bins = static_cast<size_t>(2 * reach_px / kBin_px) + 1;
  std::vector<double> shown(bins), full(bins);
  std::vector<size_t> count(bins);
  for (int y = 0; y < change.height; ++y)
    for (int x = 0; x < change.width; ++x) {
      const size_t i = static_cast<size_t>(y) * static_cast<size_t>(change.width) + static_cast<size_t>(x);
      if (!mask.empty() && mask[i] != 0) continue;
      const SlopeModel::At at = model.at(fit.at, x, y);
      const double bin = (at.along + reach_px) / kBin_px;
      if (at.r > half_px || !(bin >= 0 && bin < static_cast<double>(bins))) continue;
      Vector4 basis = model.basis(at, half_px, decay);
      basis[0] = basis[3] = 0;  // the slopes alone
      const Eigen::Vector3d wanted = fit.linear.transpose() * basis;
      const auto b = static_cast<size_t>(bin);
      for (size_t c = 0; c < 3; ++c)
        shown[b] += wanted[static_cast<Eigen::Index>(c)] * double{change.smooth[c][i]};
      full[b] += wanted.squaredNorm();
      ++count[b];
    }
  std::vector<std::optional<double>> shares(bins);
  for (size_t b = 0; b < bins; ++b)
    if (count[b] >= kLeastInBin && full[b] > 0) shares[b] = shown[b] / full[b];
  return shares;
}

// From the middle of `extent` both ways to where the change falls to half of what it is; where the frame ends
// first, the cylinder goes on beyond it.
Extent find_ends(const std::vector<std::optional<double>>& shown, double reach_px, const Extent& extent,
                 double half_px) {
  const auto place = [&](double bin) { return bin * kBin_px - reach_px; };
  const auto count = static_cast<std::ptrdiff_t>(shown.size());
  const auto middle = static_cast<std::ptrdiff_t>(((extent.from + extent.to) / 2 + reach_px) / kBin_px);
  const auto end = [&](std::ptrdiff_t step) {
    std::ptrdiff_t last = middle;  // where something is seen
    for (std::ptrdiff_t b = middle; b >= 0 && b < count; b += step) {
      if (!shown[static_cast<size_t>(b)]) continue;
      if (*shown[static_cast<size_t>(b)] < 0.5) return place(static_cast<double>(step > 0 ? b : b + 1));
      last = b;
    }
    return place(static_cast<double>(step > 0 ? last + 1 : last)) + static_cast<double>(step) * half_px;
  };
  return {end(-1), end(1)};
}

void take(const Strip& strip, const ContactFit& fit, FoundBall& found) {
  const SlopeModel& model = strip.model;
  found.axis_rad = model.axis_rad + fit.at[1] / model.reach_px;
  const double ux = std::cos(found.axis_rad), uy = std::sin(found.axis_rad),
               middle = (strip.extent.from + strip.extent.to) / 2;
  found.center_x_px = model.pivot_x_px + middle * ux - fit.at[0] * uy;
  found.center_y_px = model.pivot_y_px + middle * uy + fit.at[0] * ux;
  found.radius_px = std::exp(fit.at[2]);
  found.half_length_px = strip.extent.half();
}

}  // namespace

FoundBall find_cylinder(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                        const BallSearch& search) {
  auto [change, level2, found] = ball::pressed_picture(frame, background, mask, search);
  if (!found.good()) return found;
  const double reach_px = std::hypot(frame.format.width, frame.format.height);
  Strip strip = coarse_strip(change, level2);
  Vector4 start(0, 0, std::log(strip.half_width_px), std::log(0.5));
  ContactFit fit;
  constexpr int kRounds = 2;  // the second one between the ends of the first
  for (int round = 0; round < kRounds; ++round) {
    fit = fit_strip(frame, background, mask, strip, start);
    if (!fit.enough()) break;
    start = fit.at;
    strip.extent = find_ends(shown_along(change, mask, strip.model, fit, reach_px), reach_px, strip.extent,
                             std::exp(fit.at[2]));
  }
  take(strip, fit, found);
  if (!fit.enough() || found.half_length_px < kLongerThanWide * found.radius_px) {
    found.refuse(BallRefusal::MoreThanOne, "the contact is about as long as wide: no cylinder's");
    return found;
  }
  ball::judge_fit(fit, strip.model, background, found);
  ball::check_fit(found, change, level2, frame, background, mask, search);
  return found;
}

FoundBall find_contact(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                       const BallSearch& search) {
  if (search.shape.kind == PressedShape::Kind::Ball) return find_ball(frame, background, mask, search);
  FoundBall found = search.shape.round() ? find_ball(frame, background, mask, search)
                                         : find_cylinder(frame, background, mask, search);
  if (!found.good()) return found;
  BallSearch any_ball = search;
  any_ball.shape = PressedShape::ball(1e9);
  const double by_ball = find_ball(frame, background, mask, any_ball).explained;
  if (1 - by_ball < ball::kClearlyBetter * (1 - found.explained))
    found.refuse(BallRefusal::MoreThanOne, "a ball explains " + ball::percent(by_ball) +
                                               " of the change, a " + name_of(search.shape.kind) + " only " +
                                               ball::percent(found.explained));
  return found;
}

}  // namespace palpate
