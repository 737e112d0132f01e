#include "engine/numeric/thin_plate/thin_plate.h"

#include <cmath>
#include <string>

#include "engine/numeric/thin_plate/system.h"
#include "palpate/error.h"

namespace palpate {
namespace {

[[noreturn]] void refuse(const std::string& wanted, const std::string& found) {
  throw Error(Failure::Input, wanted + " for a spline", found, "as many values as points, all finite");
}

void expect_finite(std::span<const double> numbers, const char* what) {
  for (const double x : numbers)
    if (!std::isfinite(x)) refuse(std::string("finite ") + what, std::to_string(x));
}

template <size_t D>
std::span<const double> flat(std::span<const std::array<double, D>> of) {
  return {of.empty() ? nullptr : of.front().data(), of.size() * D};
}

}  // namespace

template <size_t D>
void ThinPlateSpline<D>::evaluate(std::span<const Place> at, std::span<double> values,
                                  std::span<double> first, std::span<double> second) const {
  const size_t n = at.size(), fields = terms_.fields, rank = frame_.rank;
  const int order = !second.empty() ? 2 : !first.empty() ? 1 : 0;
  const size_t outputs = plate_outputs(frame_.rank, order);
  const std::vector<double> own = to_own<D>(frame_, at);
  std::vector<double> sums(fields * outputs * n, 0.0);
  plate_sums(terms_, own, order, sums);
  for (size_t field = 0; field < fields; ++field) {
    const double* sum = sums.data() + field * outputs * n;
    const double* polynomial = polynomial_.data() + field * (1 + rank);
    for (size_t i = 0; i < n && !values.empty(); ++i) {
      double value = sum[i] + polynomial[0];
      for (size_t a = 0; a < rank; ++a) value += polynomial[1 + a] * own[a * n + i];
      values[i * fields + field] = value;
    }
    for (size_t i = 0; i < n && !first.empty(); ++i)
      for (size_t d = 0; d < D; ++d) {
        double slope = 0;
        for (size_t a = 0; a < rank; ++a)
          slope += (sum[(1 + a) * n + i] + polynomial[1 + a]) * frame_.axes[a][d];
        first[(i * fields + field) * D + d] = slope;
      }
    for (size_t i = 0; i < n && !second.empty(); ++i)
      for (size_t d = 0; d < D; ++d)
        for (size_t e = 0; e < D; ++e) {
          double bend = 0;
          size_t output = 1 + rank;
          for (size_t a = 0; a < rank; ++a)
            for (size_t b = a; b < rank; ++b, ++output) {
              const double fraction = frame_.axes[a][d] * frame_.axes[b][e] +
                                      (a == b ? 0 : frame_.axes[b][d] * frame_.axes[a][e]);
              if (fraction != 0)
                bend += fraction * sum[output * n + i];  // what has no bound stays on its own axis
            }
          second[((i * fields + field) * D + d) * D + e] = bend;
        }
  }
}

template <size_t D>
std::vector<double> ThinPlateSpline<D>::values(std::span<const Place> at) const {
  std::vector<double> values(at.size() * fields());
  evaluate(at, values);
  return values;
}

template <size_t D>
ThinPlate<D>::ThinPlate(std::span<const Place> points, const PlateOptions& options,
                        std::span<const double> weights)
    : options_(options), kernel_(options.kernel.value_or(plate_kernel<D>())) {
  if (!weights.empty() && weights.size() != points.size())
    refuse("a weight for each of " + std::to_string(points.size()) + " points",
           std::to_string(weights.size()));
  if (!(options.merge_fraction >= 0 && options.merge_fraction < 1) || !(options.flat_fraction >= 0))
    refuse("shares from 0 up, that of merging below 1",
           std::to_string(options.merge_fraction) + " and " + std::to_string(options.flat_fraction));
  expect_finite(flat<D>(points), "points");
  expect_finite(weights, "weights");
  double sum = 0;
  for (const double w : weights) {
    if (w < 0) refuse("weights from 0 up", std::to_string(w));
    sum += w;
    statistics_.points += w > 0;
  }
  if (weights.empty()) statistics_.points = points.size();
  if (statistics_.points == 0) refuse("at least one point", "none");
  weight_.assign(points.size(), 1.0);
  for (size_t i = 0; i < weights.size(); ++i)
    weight_[i] = weights[i] * static_cast<double>(statistics_.points) / sum;

  group_ = merge_points<D>(points, weights, options.merge_fraction);
  size_t groups = 0;
  for (const size_t g : group_)
    if (g != kNoGroup) groups = std::max(groups, g + 1);
  statistics_.merged = statistics_.points - groups;
  const std::vector<Place> places = group_means<D>(points, group_, weight_, groups);
  together_.assign(groups, 0.0);
  for (size_t i = 0; i < points.size(); ++i)
    if (group_[i] != kNoGroup) together_[group_[i]] += weight_[i];
  frame_ = plate_frame<D>(places, options.flat_fraction, statistics_.flatness);
  statistics_.rank = frame_.rank;
  own_ = to_own<D>(frame_, places);
  system_ = std::make_unique<PlateSystem>(kernel_, frame_.rank, own_, together_);
}

template <size_t D>
ThinPlate<D>::~ThinPlate() = default;
template <size_t D>
ThinPlate<D>::ThinPlate(ThinPlate&&) noexcept = default;
template <size_t D>
ThinPlate<D>& ThinPlate<D>::operator=(ThinPlate&&) noexcept = default;

/// Weighted means of the merged points' values (field after field), and per field what they leave.
template <size_t D>
void ThinPlate<D>::gather(std::span<const double> values, size_t fields, std::vector<double>& mean,
                          std::vector<double>& within) const {
  const size_t groups = together_.size();
  mean.assign(groups * fields, 0.0);
  within.assign(fields, 0.0);
  for (size_t i = 0; i < group_.size(); ++i)
    for (size_t f = 0; f < fields && group_[i] != kNoGroup; ++f)
      mean[f * groups + group_[i]] += weight_[i] / together_[group_[i]] * values[i * fields + f];
  for (size_t i = 0; i < group_.size() && statistics_.merged > 0; ++i)
    for (size_t f = 0; f < fields && group_[i] != kNoGroup; ++f)
      within[f] += weight_[i] * std::pow(values[i * fields + f] - mean[f * groups + group_[i]], 2);
}

template <size_t D>
ThinPlateSpline<D> ThinPlate<D>::fit(std::span<const double> values, size_t fields,
                                     std::optional<double> lambda) {
  if (fields == 0 || values.size() != group_.size() * fields)
    refuse(std::to_string(group_.size()) + " values per field",
           std::to_string(values.size()) + " for " + std::to_string(fields) + " fields");
  expect_finite(values, "values");
  if (lambda && !(*lambda >= 0 && std::isfinite(*lambda)))
    refuse("lambda from 0 up", std::to_string(*lambda));
  std::vector<double> mean, within;
  gather(values, fields, mean, within);
  const Eigen::Map<const Eigen::MatrixXd> z(mean.data(), static_cast<Eigen::Index>(together_.size()),
                                            static_cast<Eigen::Index>(fields));
  PlateStatistics statistics = statistics_;
  double all_within = 0;
  for (const double w : within) all_within += w;
  if (!lambda) {
    const PlateSystem::Choice choice = system_->choose(z, all_within, statistics.merged);
    lambda = choice.lambda;
    statistics.gcv = choice.gcv;
    statistics.lambda_by_data = true;
  }
  const PlateSystem::Solution s = system_->solve(z, *lambda, options_.spread);
  statistics.lambda = s.lambda;
  statistics.lambda_raised = s.raised;
  statistics.freedom = s.freedom;
  statistics.condition = s.condition;
  const double left = static_cast<double>(statistics.points) - s.freedom;
  for (size_t f = 0; f < fields; ++f)
    statistics.residual_sd.push_back(
        left > 1e-9 * s.freedom ? std::sqrt((s.chi_square[static_cast<Eigen::Index>(f)] + within[f]) / left)
                                : std::numeric_limits<double>::quiet_NaN());
  PlateTerms terms{kernel_, frame_.rank, together_.size(), fields, own_, {}};
  terms.weight.assign(s.weight.data(), s.weight.data() + s.weight.size());
  return {frame_, std::move(terms),
          std::vector<double>(s.polynomial.data(), s.polynomial.data() + s.polynomial.size()),
          std::move(statistics)};
}

template <size_t D>
std::vector<double> ThinPlate<D>::row(std::span<const Place> at, std::span<const double> value,
                                      std::span<const Place> gradient, double lambda) {
  const size_t n = at.size(), rank = frame_.rank, groups = together_.size();
  if ((!value.empty() && value.size() != n) || (!gradient.empty() && gradient.size() != n))
    refuse("a coefficient for each of " + std::to_string(n) + " places", "another number");
  if (!(lambda >= 0 && std::isfinite(lambda))) refuse("lambda from 0 up", std::to_string(lambda));
  // The places reach the points as the points reach the places, with gradients turned round.
  PlateTerms terms{kernel_, frame_.rank, n, 1 + rank, to_own<D>(frame_, at), {}};
  terms.weight.assign((1 + rank) * n, 0.0);
  Eigen::VectorXd polynomial = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(1 + rank));
  for (size_t i = 0; i < n; ++i) {
    const double c = value.empty() ? 0 : value[i];
    terms.weight[i] = c;
    polynomial[0] += c;
    for (size_t a = 0; a < rank; ++a) {
      double along = 0;
      for (size_t d = 0; d < D && !gradient.empty(); ++d) along += gradient[i][d] * frame_.axes[a][d];
      terms.weight[(1 + a) * n + i] = along;
      polynomial[static_cast<Eigen::Index>(1 + a)] += along + c * terms.at[a * n + i];
    }
  }
  const size_t outputs = plate_outputs(frame_.rank, 1);
  std::vector<double> sums((1 + rank) * outputs * groups, 0.0);
  plate_sums(terms, own_, 1, sums);
  Eigen::VectorXd kernel(static_cast<Eigen::Index>(groups));
  for (size_t j = 0; j < groups; ++j) {
    double k = sums[j];
    for (size_t a = 0; a < rank; ++a) k -= sums[((1 + a) * outputs + 1 + a) * groups + j];
    kernel[static_cast<Eigen::Index>(j)] = k;
  }
  const Eigen::VectorXd merged = system_->row(kernel, polynomial, lambda);
  std::vector<double> row(group_.size(), 0.0);
  for (size_t i = 0; i < group_.size(); ++i)
    if (group_[i] != kNoGroup)
      row[i] = merged[static_cast<Eigen::Index>(group_[i])] * weight_[i] / together_[group_[i]];
  return row;
}

template class ThinPlateSpline<2>;
template class ThinPlateSpline<3>;
template class ThinPlate<2>;
template class ThinPlate<3>;

}  // namespace palpate
