#include "engine/numeric/thin_plate/points.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/base/statistics.h"
#include "engine/numeric/dense.h"

namespace palpate {
namespace {

template <size_t D>
double squared_distance(const std::array<double, D>& a, const std::array<double, D>& b) {
  double sum = 0;
  for (size_t d = 0; d < D; ++d) sum += (a[d] - b[d]) * (a[d] - b[d]);
  return sum;
}

/// By medians, so that neither a far point nor many coincident ones decide it.
template <size_t D>
double usual_spacing(std::span<const std::array<double, D>> points) {
  std::array<double, D> centre{};
  std::vector<double> of(points.size());
  for (size_t d = 0; d < D; ++d) {
    for (size_t i = 0; i < points.size(); ++i) of[i] = points[i][d];
    centre[d] = median(of);
  }
  for (size_t i = 0; i < points.size(); ++i) of[i] = std::sqrt(squared_distance(points[i], centre));
  const double ball = D == 2 ? M_PI : 4 * M_PI / 3;
  return median(of) * std::pow(ball * 2 / static_cast<double>(points.size()), 1.0 / D);
}

}  // namespace

template <size_t D>
std::vector<size_t> merge_points(std::span<const std::array<double, D>> points,
                                 std::span<const double> weights, double fraction) {
  std::vector<size_t> order;
  for (size_t i = 0; i < points.size(); ++i)
    if (weights.empty() || weights[i] > 0) order.push_back(i);
  std::vector<size_t> group(points.size(), kNoGroup);
  if (order.empty()) return group;
  std::vector<std::array<double, D>> used;
  used.reserve(order.size());
  for (const size_t i : order) used.push_back(points[i]);
  const double reach = fraction * usual_spacing<D>(used);
  std::sort(order.begin(), order.end(),
            [&](size_t a, size_t b) { return points[a] < points[b] || (points[a] == points[b] && a < b); });
  // Along the first axis: a point joins the first leader within reach, or leads itself.
  std::vector<size_t> leaders, leader(points.size(), kNoGroup);
  size_t near = 0;
  for (const size_t i : order) {
    while (near < leaders.size() && points[leaders[near]][0] < points[i][0] - reach) ++near;
    const auto found =
        std::find_if(leaders.begin() + static_cast<ptrdiff_t>(near), leaders.end(),
                     [&](size_t l) { return squared_distance(points[l], points[i]) <= reach * reach; });
    leader[i] = found == leaders.end() ? i : *found;
    if (found == leaders.end()) leaders.push_back(i);
  }
  std::vector<size_t> number(points.size(), kNoGroup);
  size_t groups = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    if (leader[i] == kNoGroup) continue;
    if (number[leader[i]] == kNoGroup) number[leader[i]] = groups++;
    group[i] = number[leader[i]];
  }
  return group;
}

template <size_t D>
std::vector<std::array<double, D>> group_means(std::span<const std::array<double, D>> points,
                                               std::span<const size_t> group, std::span<const double> weights,
                                               size_t groups) {
  // About each group's first point: the mean of equal points is that point to the last digit.
  std::vector<std::array<double, D>> first(groups), mean(groups);
  std::vector<double> total(groups, 0);
  for (size_t i = 0; i < points.size(); ++i) {
    if (group[i] == kNoGroup) continue;
    if (total[group[i]] == 0) first[group[i]] = points[i];
    total[group[i]] += weights[i];
    for (size_t d = 0; d < D; ++d) mean[group[i]][d] += weights[i] * (points[i][d] - first[group[i]][d]);
  }
  for (size_t g = 0; g < groups; ++g)
    for (size_t d = 0; d < D; ++d) mean[g][d] = first[g][d] + mean[g][d] / total[g];
  return mean;
}

template <size_t D>
PlateFrame<D> plate_frame(std::span<const std::array<double, D>> points, double flat_fraction,
                          double& flatness) {
  using Vector = Eigen::Matrix<double, D, 1>;
  PlateFrame<D> frame;
  const double count = static_cast<double>(points.size());
  for (size_t d = 0; d < D; ++d) {
    double sum = 0;  // about the first point: no digits are lost far from the origin
    for (const auto& p : points) sum += p[d] - points[0][d];
    frame.centre[d] = points[0][d] + sum / count;
  }
  double largest = 0;
  for (const auto& p : points)
    for (size_t d = 0; d < D; ++d) largest = std::max(largest, std::abs(p[d] - frame.centre[d]));
  flatness = 0;
  if (largest == 0) return frame;
  // Divided by the largest first, lest squares leave the range of numbers. The singular values of the points
  // themselves keep the digits that those of their squares would lose.
  Eigen::MatrixXd about(points.size(), D);
  for (size_t i = 0; i < points.size(); ++i)
    for (size_t d = 0; d < D; ++d)
      about(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(d)) =
          (points[i][d] - frame.centre[d]) / largest;
  const dense::Svd svd = dense::svd(about, Eigen::ComputeThinU | Eigen::ComputeFullV);
  Vector spread = Vector::Zero();  // fewer points than axes leave the rest 0
  spread.head(svd.values.size()) = svd.values;
  flatness = spread[D - 1] / spread[0];
  frame.rank = static_cast<uint32_t>((spread.array() > flat_fraction * spread[0]).count());
  const double scale = 1 / (largest * std::sqrt(about.squaredNorm() / count));
  for (uint32_t a = 0; a < frame.rank; ++a)
    for (size_t d = 0; d < D; ++d)
      frame.axes[a][d] =
          scale * (frame.rank == D ? (a == d ? 1.0 : 0.0) : svd.v(static_cast<Eigen::Index>(d), a));
  return frame;
}

template <size_t D>
std::vector<double> to_own(const PlateFrame<D>& frame, std::span<const std::array<double, D>> points) {
  std::vector<double> own(frame.rank * points.size());
  for (uint32_t a = 0; a < frame.rank; ++a)
    for (size_t i = 0; i < points.size(); ++i) {
      double sum = 0;
      for (size_t d = 0; d < D; ++d) sum += frame.axes[a][d] * (points[i][d] - frame.centre[d]);
      own[a * points.size() + i] = sum;
    }
  return own;
}

template std::vector<size_t> merge_points<2>(std::span<const std::array<double, 2>>, std::span<const double>,
                                             double);
template std::vector<std::array<double, 2>> group_means<2>(std::span<const std::array<double, 2>>,
                                                           std::span<const size_t>, std::span<const double>,
                                                           size_t);
template PlateFrame<2> plate_frame<2>(std::span<const std::array<double, 2>>, double, double&);
template std::vector<double> to_own<2>(const PlateFrame<2>&, std::span<const std::array<double, 2>>);
template std::vector<size_t> merge_points<3>(std::span<const std::array<double, 3>>, std::span<const double>,
                                             double);
template std::vector<std::array<double, 3>> group_means<3>(std::span<const std::array<double, 3>>,
                                                           std::span<const size_t>, std::span<const double>,
                                                           size_t);
template PlateFrame<3> plate_frame<3>(std::span<const std::array<double, 3>>, double, double&);
template std::vector<double> to_own<3>(const PlateFrame<3>&, std::span<const std::array<double, 3>>);

}  // namespace palpate
