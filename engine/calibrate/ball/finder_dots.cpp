// Contacts of a grid of equal balls.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/calibrate/ball/contact_fit.h"
#include "engine/calibrate/ball/finder.h"

namespace palpate {
namespace {

using ball::Change, ball::ContactFit, ball::kLeastRadius_px;
using Vector4 = Eigen::Vector4d;

constexpr double kOwn = 0.5;         // of the distance between dots: the part of the pad that is a dot's own
constexpr double kGridError = 0.15;  // of that distance, between neighbours

struct Spot {
  double x_px = 0, y_px = 0, area_px = 0;
};

// Middle and area of what changes strongly within `reach` of a place.
Spot middle_of(const Change& change, double x_px, double y_px, double reach, double level2) {
  Spot spot;
  double weight = 0;
  const auto bound = [](double v, int side) { return static_cast<int>(std::clamp(v, 0.0, side - 1.0)); };
  for (int y = bound(y_px - reach, change.height); y <= bound(y_px + reach, change.height); ++y)
    for (int x = bound(x_px - reach, change.width); x <= bound(x_px + reach, change.width); ++x) {
      const double size2 = double{
          change.size2[static_cast<size_t>(y) * static_cast<size_t>(change.width) + static_cast<size_t>(x)]};
      if (size2 < level2 || std::hypot(x - x_px, y - y_px) > reach) continue;
      spot.x_px += x, spot.y_px += y, weight += 1;
    }
  spot.area_px = weight;
  if (weight > 0) spot.x_px /= weight, spot.y_px /= weight;
  return spot;
}

// Places where the change, summed over half of the distance between dots, is larger than anywhere near.
std::vector<Spot> spots_of(const Change& change, double apart_px, double level2) {
  const int w = change.width, h = change.height, half = std::max(1, static_cast<int>(kOwn * apart_px / 2));
  std::vector<double> sums(static_cast<size_t>(w + 1) * static_cast<size_t>(h + 1));
  const auto at = [&](int x, int y) -> double& {
    return sums[static_cast<size_t>(y) * static_cast<size_t>(w + 1) + static_cast<size_t>(x)];
  };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const double size2 =
          double{change.size2[static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(x)]};
      at(x + 1, y + 1) = at(x, y + 1) + at(x + 1, y) - at(x, y) + (size2 < level2 ? 0 : size2);
    }
  struct Summed {
    double change;
    int x, y;
  };
  std::vector<Summed> places;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const int x0 = std::max(0, x - half), x1 = std::min(w, x + half + 1), y0 = std::max(0, y - half),
                y1 = std::min(h, y + half + 1);
      const double sum = at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0);
      if (sum > 0) places.push_back({sum, x, y});
    }
  std::ranges::sort(places, [](const Summed& a, const Summed& b) { return a.change > b.change; });
  std::vector<Spot> spots;
  for (const Summed& place : places) {
    const auto near = [&](const Spot& spot) {
      return std::hypot(spot.x_px - place.x, spot.y_px - place.y) < (1 - kGridError) * apart_px;
    };
    if (std::ranges::any_of(spots, near)) continue;
    Spot spot{1.0 * place.x, 1.0 * place.y};
    for (int round = 0; round < 3; ++round)
      spot = middle_of(change, spot.x_px, spot.y_px, kOwn * apart_px, level2);
    if (spot.area_px > 0 && std::ranges::none_of(spots, [&](const Spot& other) {
          return std::hypot(spot.x_px - other.x_px, spot.y_px - other.y_px) < (1 - kGridError) * apart_px;
        }))
      spots.push_back(spot);
  }
  return spots;
}

FoundBall fit_dot(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                  const BallSearch& search, const Spot& spot, double apart_px) {
  FoundBall found;
  const double radius_px = std::max(kLeastRadius_px, 1.05 * std::sqrt(spot.area_px / std::numbers::pi));
  const Vector4 start(spot.x_px, spot.y_px, std::log(std::min(radius_px, kOwn * apart_px)), std::log(0.5));
  // A little more than its own part: where the pad rises again is what shows the rim.
  const ContactFit fit = ball::fit_round(frame, background, mask, {}, start, (kOwn + 0.1) * apart_px);
  found.center_x_px = fit.at[0];
  found.center_y_px = fit.at[1];
  found.radius_px = std::exp(fit.at[2]);
  if (!fit.enough()) {
    found.refuse(BallRefusal::TooSmall, "a dot of too few pixels");
    return found;
  }
  ball::judge_fit(fit, {}, background, found);
  ball::check_coverage(found, frame, background, mask);
  if (found.good() && found.explained < ball::kLeastExplained)
    found.refuse(BallRefusal::MoreThanOne,
                 "a ball explains only " + ball::percent(found.explained) + " of a dot's change");
  if (found.good() && found.radius_px > kOwn * apart_px)
    found.refuse(BallRefusal::MoreThanOne, "dots that run into each other");
  if (found.good()) ball::check_contact(found, frame.format, search);
  return found;
}

}  // namespace

std::vector<FoundBall> find_dots(const Frame& frame, const Frame& background, std::span<const uint8_t> mask,
                                 const BallSearch& search) {
  const ball::PressedPicture picture = ball::pressed_picture(frame, background, mask, search);
  if (!picture.found.good()) return {picture.found};
  const double apart_px = search.shape.apart_mm / search.pitch_mm_per_px;
  BallSearch one = search;
  one.least_in_frame = 1;  // there are others
  const std::vector<Spot> spots = spots_of(picture.change, apart_px, picture.level2);
  std::vector<FoundBall> dots;
  dots.reserve(spots.size());
  for (const Spot& spot : spots) dots.push_back(fit_dot(frame, background, mask, one, spot, apart_px));
  std::vector<double> nearest;
  for (const FoundBall& dot : dots) {
    double least = INFINITY;
    for (const FoundBall& other : dots)
      if (&other != &dot && other.good())
        least = std::min(
            least, std::hypot(dot.center_x_px - other.center_x_px, dot.center_y_px - other.center_y_px));
    if (dot.good() && std::isfinite(least)) nearest.push_back(least);
  }
  if (nearest.empty()) return dots;
  const double usual_px = median(nearest);
  if (std::abs(usual_px / apart_px - 1) > kGridError)
    for (FoundBall& dot : dots)
      if (dot.good())
        dot.refuse(BallRefusal::MoreThanOne,
                   text("dots stand %.3g mm apart at this scale", usual_px * search.pitch_mm_per_px));
  return dots;
}

}  // namespace palpate
