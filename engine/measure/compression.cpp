#include "engine/measure/compression.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace palpate {
namespace {

/// With fewer pairs a strain depends on single points more than on the shape.
constexpr size_t kLeastPairs = 12;
/// Points of the spline that maps the strain.
constexpr size_t kMostInField = 800;
/// An object does not turn further on the pad from one compression to the next.
constexpr double kMostTurn_deg = 45;

PointSet in_space(std::span<const ShapePoint> points) {
  PointSet set;
  set.axes = 3;
  for (const ShapePoint& p : points)
    set.coordinates.insert(set.coordinates.end(), {p.x_mm, p.y_mm, p.depth_mm});
  return set;
}

/// Turns the second places back about their middle so that, on the whole, nothing has turned. By how much,
/// rad.
double turn_back(std::vector<MatchedPoint>& pairs) {
  const auto count = static_cast<double>(pairs.size());
  ShapePoint a, b;
  for (const MatchedPoint& p : pairs) {
    a.x_mm += p.before.x_mm / count, a.y_mm += p.before.y_mm / count;
    b.x_mm += p.after.x_mm / count, b.y_mm += p.after.y_mm / count;
  }
  double along = 0, across = 0;
  for (const MatchedPoint& p : pairs) {
    const double ax = p.before.x_mm - a.x_mm, ay = p.before.y_mm - a.y_mm;
    const double bx = p.after.x_mm - b.x_mm, by = p.after.y_mm - b.y_mm;
    along += ax * bx + ay * by;
    across += ax * by - ay * bx;
  }
  const double turn = std::atan2(across, along), c = std::cos(turn), s = std::sin(turn);
  for (MatchedPoint& p : pairs) {
    const double x = p.after.x_mm - b.x_mm, y = p.after.y_mm - b.y_mm;
    p.after.x_mm = b.x_mm + c * x + s * y;
    p.after.y_mm = b.y_mm - s * x + c * y;
  }
  return turn;
}

/// 97.5 % quantile of Student's t over that of the normal distribution.
double student_factor(size_t draws) {
  constexpr double z = 1.959964;
  const auto dof = static_cast<double>(draws - 1);
  if (dof < 1.5) return 12.706 / z;
  if (dof < 2.5) return 4.303 / z;
  return 1 + ((z * z + 1) / 4 + (5 * std::pow(z, 4) + 16 * z * z + 3) / (96 * dof)) / dof;
}

/// Two readings of one number, `apart` from each other: half of that is expected of either, as a variance.
void widen(PlaneStrain& sd, double apart) {
  const double area = apart / std::numbers::sqrt2;
  sd.area = std::hypot(sd.area, area);
  for (double* along : {&sd.xx, &sd.yy, &sd.first, &sd.second}) *along = std::hypot(*along, area / 2);
}

void axial_of(Compression& found, double poisson) {
  found.axial = axial_strain_by_area(found.plane.mean.area, poisson);
  // The law's slope at the mean carries the error over.
  constexpr double kStep = 1e-6;
  const double slope = (axial_strain_by_area(found.plane.mean.area + kStep, poisson) - found.axial) / kStep;
  found.axial_sd = std::abs(slope) * found.plane.sd.area;
}

}  // namespace

std::vector<ShapePoint> shape_points(const ControlPoints& points, double pitch_mm_per_px) {
  std::vector<ShapePoint> shape;
  for (const ControlPoint& p : points.points)
    shape.push_back({p.x_px * pitch_mm_per_px, p.y_px * pitch_mm_per_px, p.depth_mm});
  return shape;
}

Compression strain_of_pairs(std::vector<MatchedPoint> pairs, const CompressionOptions& options) {
  Compression found;
  found.pairs = std::move(pairs);
  if (found.pairs.size() < kLeastPairs) {
    found.reason = std::to_string(found.pairs.size()) + " points with a partner, fewer than " +
                   std::to_string(kLeastPairs);
    return found;
  }
  std::vector<std::array<double, 2>> places, shifts;
  std::vector<double> weights;
  for (const MatchedPoint& p : found.pairs) {
    places.push_back({p.before.x_mm, p.before.y_mm});
    shifts.push_back({p.after.x_mm - p.before.x_mm, p.after.y_mm - p.before.y_mm});
    weights.push_back(p.probability);
    found.deepening_mm += (p.after.depth_mm - p.before.depth_mm) / static_cast<double>(found.pairs.size());
  }
  found.field.emplace(places, shifts, options.lambda, weights);
  if (found.field->statistics().rank < 2) {
    found.reason = "the points lie on a line: they do not determine the strain across it";
    return found;
  }
  found.plane = found.field->mean(places);
  axial_of(found, options.poisson);
  return found;
}

Compression compare_compressions(std::span<const ShapePoint> before, std::span<const ShapePoint> after,
                                 const CompressionOptions& options) {
  Compression found;
  for (const auto& [points, which] : {std::pair{before, "first"}, std::pair{after, "second"}})
    if (points.size() < kLeastPairs) {
      found.reason = "the " + std::string(which) + " compression has " + std::to_string(points.size()) +
                     " control points, fewer than " + std::to_string(kLeastPairs);
      return found;
    }
  MatchResult match = match_points(in_space(before), in_space(after), {.most_turn_deg = kMostTurn_deg});
  if (!match.reliable()) {
    found.reason = to_string(match.verdict);
    found.match = std::move(match);
    return found;
  }
  // The partners themselves, not where the smooth warp brings a point: the errors follow from their scatter.
  std::vector<MatchedPoint> pairs;
  for (size_t i = 0; i < before.size(); ++i)
    if (const Partner& partner = match.partners[i]; partner.target)
      pairs.push_back({before[i], after[*partner.target], partner.probability});
  found = strain_of_pairs(std::move(pairs), options);
  found.match = std::move(match);
  return found;
}

Compression compare_draws(std::span<const std::vector<ShapePoint>> before,
                          std::span<const std::vector<ShapePoint>> after, const CompressionOptions& options) {
  Compression found;
  std::vector<PlaneStrain> strains;
  std::vector<double> turns;
  std::vector<MatchedPoint> pairs;
  double deepening = 0;
  for (size_t d = 0; d < std::min(before.size(), after.size()); ++d) {
    Compression one = compare_compressions(before[d], after[d], options);
    if (d == 0 || found.match == std::nullopt) found.match = std::move(one.match);
    if (!one.reason.empty()) {
      found.reason = one.reason;
      continue;
    }
    strains.push_back(one.plane.mean);
    deepening += one.deepening_mm;
    turns.push_back(turn_back(one.pairs));
    pairs.insert(pairs.end(), one.pairs.begin(), one.pairs.end());
  }
  const size_t draws = strains.size();
  if (2 * draws <= before.size() || draws < 2) {
    if (found.reason.empty()) found.reason = "fewer than two draws of control points";
    return found;
  }
  // The field through some of all draws' pairs: more would cost time and say the same.
  std::vector<MatchedPoint> some;
  const size_t step = (pairs.size() + kMostInField - 1) / kMostInField;
  for (size_t i = 0; i < pairs.size(); i += step) some.push_back(pairs[i]);
  std::optional<MatchResult> match = std::move(found.match);
  found = strain_of_pairs(std::move(some), options);
  found.match = std::move(match);
  found.pairs = std::move(pairs);
  found.deepening_mm = deepening / static_cast<double>(draws);
  if (!found.reason.empty()) return found;
  found.plane = mean_of(strains);
  const double factor = student_factor(draws);
  PlaneStrain& sd = found.plane.sd;
  for (double* one : {&sd.xx, &sd.yy, &sd.xy, &sd.first, &sd.second, &sd.direction_rad, &sd.shear, &sd.area})
    *one *= factor;
  if (options.counted_growth) widen(sd, found.plane.mean.area - *options.counted_growth);
  for (const double turn : turns) found.turn_rad += turn / static_cast<double>(draws);
  for (const double turn : turns)
    found.turn_sd_rad +=
        (turn - found.turn_rad) * (turn - found.turn_rad) / static_cast<double>(draws * (draws - 1));
  found.turn_sd_rad = factor * std::sqrt(found.turn_sd_rad);
  axial_of(found, options.poisson);
  return found;
}

}  // namespace palpate
