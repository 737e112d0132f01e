#include "engine/numeric/matching/curve.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kFewest = 12;
constexpr double kLeastOnPath = 0.75;
constexpr double kMostClosing = 2.5;  // of the longest of the steps at the ends

/// For each point the one before it (itself: the first), and its distance, in the shortest tree that links
/// all; `order`: each point after the one before it.
struct Tree {
  std::vector<Index> before, order;
  std::vector<double> step;

  explicit Tree(const MatrixXd& points) {
    const Index n = points.rows();
    before.assign(static_cast<size_t>(n), 0);
    step.assign(static_cast<size_t>(n), 0);
    VectorXd squares = VectorXd::Constant(n, std::numeric_limits<double>::infinity());
    std::vector<char> linked(static_cast<size_t>(n), 0);
    Index last = 0;
    for (Index k = 0; k < n; ++k) {
      linked[static_cast<size_t>(last)] = 1;
      order.push_back(last);
      Index next = -1;
      for (Index i = 0; i < n; ++i) {
        if (linked[static_cast<size_t>(i)]) continue;
        const double d = (points.row(i) - points.row(last)).squaredNorm();
        if (d < squares[i]) squares[i] = d, before[static_cast<size_t>(i)] = last;
        if (next < 0 || squares[i] < squares[next]) next = i;
      }
      if (next < 0) break;
      step[static_cast<size_t>(next)] = std::sqrt(squares[next]);
      last = next;
    }
  }
};

/// By the number of points: the longest path down from each point, and the longest through one.
std::vector<Index> longest_path(const Tree& tree) {
  const size_t n = tree.order.size();
  std::vector<size_t> deep(n, 1);
  std::vector<Index> below(n, -1), second(n, -1);
  const auto deep_of = [&](Index i) { return i < 0 ? size_t{0} : deep[static_cast<size_t>(i)]; };
  Index top = 0;
  for (size_t k = n; k-- > 0;) {
    const auto i = static_cast<size_t>(tree.order[k]);
    deep[i] = 1 + deep_of(below[i]);
    const auto top_at = static_cast<size_t>(top);
    if (deep[i] + deep_of(second[i]) > deep_of(top) + deep_of(second[top_at]) || k + 1 == n)
      top = tree.order[k];
    if (k == 0) break;
    const auto up = static_cast<size_t>(tree.before[i]);
    const auto child = static_cast<Index>(i);
    if (deep[i] > deep_of(below[up]))
      second[up] = below[up], below[up] = child;
    else if (deep[i] > deep_of(second[up]))
      second[up] = child;
  }
  std::vector<Index> path;
  for (Index i = below[static_cast<size_t>(top)]; i >= 0; i = below[static_cast<size_t>(i)])
    path.push_back(i);
  std::reverse(path.begin(), path.end());
  path.push_back(top);
  for (Index i = second[static_cast<size_t>(top)]; i >= 0; i = below[static_cast<size_t>(i)])
    path.push_back(i);
  return path;
}

}  // namespace

std::optional<Curve> curve_through(const MatrixXd& points) {
  if (points.rows() < kFewest) return std::nullopt;
  Curve curve{longest_path(Tree(points)), false};
  const std::vector<Index>& o = curve.order;
  if (static_cast<double>(o.size()) < kLeastOnPath * static_cast<double>(points.rows())) return std::nullopt;
  const auto apart = [&](Index a, Index b) { return (points.row(a) - points.row(b)).norm(); };
  const size_t last = o.size() - 1;
  curve.closed = apart(o[0], o[last]) <
                 kMostClosing * std::max({apart(o[0], o[1]), apart(o[1], o[2]), apart(o[last], o[last - 1]),
                                          apart(o[last - 1], o[last - 2])});
  return curve;
}

}  // namespace palpate
