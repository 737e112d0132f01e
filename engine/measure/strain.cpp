#include "engine/measure/strain.h"

#include <cmath>
#include <limits>
#include <string>

#include "palpate/error.h"

namespace palpate {
namespace {

void fill_principal(PlaneStrain& e) {
  const double half = 0.5 * (e.xx - e.yy), middle = 0.5 * (e.xx + e.yy);
  e.shear = std::hypot(half, e.xy);
  e.first = middle + e.shear;
  e.second = middle - e.shear;
  e.direction_rad = e.shear > 0 ? 0.5 * std::atan2(e.xy, half) : 0;
}

/// Covariances of the mean's components.
struct Covariances {
  double xx, yy, xy, xx_yy, xx_xy, yy_xy, area;
};

void fill_errors(MeanStrain& result, const Covariances& v) {
  result.sd.xx = std::sqrt(v.xx);
  result.sd.yy = std::sqrt(v.yy);
  result.sd.xy = std::sqrt(v.xy);
  result.sd.area = std::sqrt(v.area);
  // In the principal axes: first = n E n, second = m E m, and the turn is n E m over first - second.
  const double c = std::cos(result.mean.direction_rad), s = std::sin(result.mean.direction_rad);
  const auto sd_of = [&](double a, double b, double d) {  // a xx + b yy + d xy
    return std::sqrt(std::max(0.0, a * a * v.xx + b * b * v.yy + d * d * v.xy +
                                       2 * (a * b * v.xx_yy + a * d * v.xx_xy + b * d * v.yy_xy)));
  };
  result.sd.first = sd_of(c * c, s * s, 2 * s * c);
  result.sd.second = sd_of(s * s, c * c, -2 * s * c);
  result.sd.shear = sd_of(0.5 * (c * c - s * s), 0.5 * (s * s - c * c), 2 * s * c);
  const double turn = sd_of(-s * c, s * c, c * c - s * s);
  const double apart = result.mean.first - result.mean.second;
  result.sd.direction_rad = turn < 0.5 * apart ? turn / apart : std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(v.xx + v.yy))  // std::max above would read an unknown as 0
    result.sd.first = result.sd.second = result.sd.shear = std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

PlaneStrain plane_strain(const std::array<double, 4>& gradient) {
  const auto [ux, uy, vx, vy] = gradient;
  PlaneStrain e;
  // Written out in the gradient: F^T F - I would leave nothing of strains of 1e-16.
  e.xx = ux + 0.5 * (ux * ux + vx * vx);
  e.yy = vy + 0.5 * (uy * uy + vy * vy);
  e.xy = 0.5 * (uy + vx + ux * uy + vx * vy);
  e.area = ux + vy + ux * vy - uy * vx;
  fill_principal(e);
  return e;
}

std::array<double, 6> green_lagrange(const std::array<double, 9>& gradient) {
  const auto g = [&](size_t row, size_t column) { return gradient[3 * row + column]; };
  std::array<double, 6> e{};
  for (size_t i = 0, k = 0; i < 3; ++i)
    for (size_t j = i; j < 3; ++j, ++k) {
      double product = 0;
      for (size_t m = 0; m < 3; ++m) product += g(m, i) * g(m, j);
      e[k] = 0.5 * (g(i, j) + g(j, i) + product);
    }
  return e;
}

double axial_strain_by_thickness(double depth, double thickness) {
  if (!(thickness > 0) || !(depth < thickness) || !std::isfinite(depth))
    throw Error(Failure::Input, "a depth below the layer's thickness",
                "depth " + std::to_string(depth) + " of " + std::to_string(thickness),
                "the thickness of pad and sample together, in the depth's unit");
  const double engineering = -depth / thickness;
  return engineering + 0.5 * engineering * engineering;
}

double axial_strain_by_area(double area, double poisson) {
  if (!(area > -1) || !std::isfinite(area) || !(poisson >= 0 && poisson <= 0.5))
    throw Error(Failure::Input, "a change of area above -1 and Poisson's ratio from 0 to 0.5",
                std::to_string(area) + " and " + std::to_string(poisson),
                "a spline fitted to fewer outliers");
  return 0.5 * std::expm1(-2 * poisson / (1 - poisson) * std::log1p(area));
}

StrainField::StrainField(std::span<const std::array<double, 2>> points,
                         std::span<const std::array<double, 2>> shifts, std::optional<double> lambda,
                         std::span<const double> weights)
    : plate_(points, {}, weights), spline_(plate_.fit<2>(shifts, lambda)), weights_(points.size(), 1.0) {
  double sum = 0;
  for (const double w : weights) sum += w;
  for (size_t i = 0; i < weights.size(); ++i)
    weights_[i] = weights[i] * static_cast<double>(statistics().points) / sum;
}

std::vector<double> StrainField::gradients(std::span<const std::array<double, 2>> places) const {
  std::vector<double> first(places.size() * 4);
  if (!places.empty()) spline_.evaluate(places, {}, first);
  return first;
}

std::vector<PlaneStrain> StrainField::at(std::span<const std::array<double, 2>> places) const {
  const std::vector<double> g = gradients(places);
  std::vector<PlaneStrain> strains;
  strains.reserve(places.size());
  for (size_t i = 0; i < places.size(); ++i)
    strains.push_back(plane_strain({g[4 * i], g[4 * i + 1], g[4 * i + 2], g[4 * i + 3]}));
  return strains;
}

MeanStrain mean_of(std::span<const PlaneStrain> draws) {
  if (draws.size() < 2)
    throw Error(Failure::Input, "two strains or more to average", std::to_string(draws.size()), "more draws");
  const auto count = static_cast<double>(draws.size());
  MeanStrain result;
  PlaneStrain& m = result.mean;
  for (const PlaneStrain& e : draws) {
    m.xx += e.xx / count;
    m.yy += e.yy / count;
    m.xy += e.xy / count;
    m.area += e.area / count;
  }
  fill_principal(m);
  Covariances v{};
  for (const PlaneStrain& e : draws) {
    const double fraction = 1 / (count * (count - 1)), xx = e.xx - m.xx, yy = e.yy - m.yy, xy = e.xy - m.xy;
    v.xx += fraction * xx * xx;
    v.yy += fraction * yy * yy;
    v.xy += fraction * xy * xy;
    v.xx_yy += fraction * xx * yy;
    v.xx_xy += fraction * xx * xy;
    v.yy_xy += fraction * yy * xy;
    v.area += fraction * (e.area - m.area) * (e.area - m.area);
  }
  fill_errors(result, v);
  return result;
}

MeanStrain StrainField::mean(std::span<const std::array<double, 2>> places) {
  if (places.empty())
    throw Error(Failure::Input, "places to average strain over", "none", "a contact that covers some points");
  const double fraction = 1 / static_cast<double>(places.size());
  const std::vector<double> g = gradients(places);
  MeanStrain result;
  // How each of xx, yy, xy, area and, of the mean tensor, nothing else, answers to the gradients of u and of
  // v.
  enum : size_t { kXx, kYy, kXy, kArea, kAll };
  std::array<std::array<std::vector<std::array<double, 2>>, 2>, kAll> answers;
  for (auto& of : answers)
    for (auto& field : of) field.reserve(places.size());
  for (size_t i = 0; i < places.size(); ++i) {
    const double ux = g[4 * i], uy = g[4 * i + 1], vx = g[4 * i + 2], vy = g[4 * i + 3];
    const PlaneStrain e = plane_strain({ux, uy, vx, vy});
    result.mean.xx += fraction * e.xx;
    result.mean.yy += fraction * e.yy;
    result.mean.xy += fraction * e.xy;
    result.mean.area += fraction * e.area;
    const auto add = [&](size_t which, double to_ux, double to_uy, double to_vx, double to_vy) {
      answers[which][0].push_back({fraction * to_ux, fraction * to_uy});
      answers[which][1].push_back({fraction * to_vx, fraction * to_vy});
    };
    add(kXx, 1 + ux, 0, vx, 0);
    add(kYy, 0, uy, 0, 1 + vy);
    add(kXy, 0.5 * uy, 0.5 * (1 + ux), 0.5 * (1 + vy), 0.5 * vx);
    add(kArea, 1 + vy, -vx, -uy, 1 + ux);
  }
  fill_principal(result.mean);

  std::array<std::array<std::vector<double>, 2>, kAll> rows;
  // At one place all rows are made of those of its two slopes.
  std::array<std::vector<double>, 2> slope;
  for (size_t axis = 0; axis < 2 && places.size() == 1; ++axis) {
    const std::array<double, 2> along = {axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0};
    slope[axis] = plate_.row(places, {}, std::span(&along, 1), statistics().lambda);
  }
  for (size_t which = 0; which < kAll; ++which)
    for (size_t field = 0; field < 2; ++field) {
      const auto& answer = answers[which][field];
      if (places.size() > 1) {
        rows[which][field] = plate_.row(places, {}, answer, statistics().lambda);
        continue;
      }
      rows[which][field].resize(weights_.size());
      for (size_t i = 0; i < weights_.size(); ++i)
        rows[which][field][i] = answer[0][0] * slope[0][i] + answer[0][1] * slope[1][i];
    }
  const auto covariance = [&](size_t a, size_t b) {
    double sum = 0;
    for (size_t field = 0; field < 2; ++field) {
      const double sd = statistics().residual_sd[field];
      for (size_t i = 0; i < weights_.size(); ++i)
        if (weights_[i] > 0) sum += sd * sd * rows[a][field][i] * rows[b][field][i] / weights_[i];
    }
    return sum;
  };
  fill_errors(result, {covariance(kXx, kXx), covariance(kYy, kYy), covariance(kXy, kXy), covariance(kXx, kYy),
                       covariance(kXx, kXy), covariance(kYy, kXy), covariance(kArea, kArea)});
  return result;
}

}  // namespace palpate
