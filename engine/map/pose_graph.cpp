#include "engine/map/pose_graph.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "engine/numeric/dense.h"
#include "engine/numeric/sparse.h"

namespace palpate {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kUnknown_mm = 1e3;      // standard error of what is not determined
constexpr double kLeastError_mm = 2e-4;  // of any motion: what sampling leaves
constexpr double kHeld = 1e8;            // information that holds a piece's lowest node
constexpr double kSureChi2 = 22.5;       // of six degrees of freedom, one in a thousand

/// What is left of an edge, and its derivatives by both nodes' small motions.
struct Misfit {
  Vector6d left;
  Matrix6d by_from, by_to;
};
Misfit misfit_of(const GraphEdge& edge, const PoseGraph::Node& from, const PoseGraph::Node& to) {
  const RigidMotion now = to.motion * from.motion.inverse();
  return {twist_between(edge.motion, now, edge.at_mm),
          -(seen_at(now * from.middle_mm, edge.at_mm) * carried_by(now)), seen_at(to.middle_mm, edge.at_mm)};
}

double chi2_of(const GraphEdge& edge, const Vector6d& left) {
  return left.dot(edge.information * left);
}

void add_block(std::vector<sparse::Entry>& entries, uint32_t row, uint32_t column, const Matrix6d& block) {
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) {
      const int r = static_cast<int>(6 * row) + a, c = static_cast<int>(6 * column) + b;
      if (r >= c) entries.emplace_back(r, c, block(a, b));
    }
}

/// The same without what rounding makes of a rotation: inverses are transposes, and chains of them would let
/// it grow.
RigidMotion rigid(const RigidMotion& motion) {
  return {turn_of(turn_vector(motion.turn)), motion.shift_mm};
}

/// Small motions of the map, seen at its origin, as each node's.
Matrix6d of_map(const PoseGraph::Node& node) {
  return seen_at(node.motion.shift_mm, node.middle_mm) * carried_by(node.motion);
}

}  // namespace

GraphEdge edge_of(uint32_t from, uint32_t to, const Registration& found) {
  GraphEdge edge{.from = from, .to = to, .motion = found.motion, .at_mm = found.at_mm};
  const double radius = std::max(found.freedom.radius_mm, 1e-3);
  Vector6d turns;
  turns << 1, 1, 1, radius, radius, radius;
  const Freedom freedom = found.freedom.at(found.at_mm);
  Matrix6d spread = turns.asDiagonal() * found.covariance * turns.asDiagonal();
  spread.diagonal().array() += kLeastError_mm * kLeastError_mm;
  spread += kUnknown_mm * kUnknown_mm * freedom.unknown * freedom.unknown.transpose();
  edge.information = turns.asDiagonal() * dense::inverse(spread) * turns.asDiagonal();
  edge.whole = freedom.unknown.cols() == 0;
  return edge;
}

uint32_t PoseGraph::add(const RigidMotion& motion, const Vector3d& middle_mm) {
  const auto at = static_cast<uint32_t>(nodes_.size());
  nodes_.push_back({rigid(motion), middle_mm, at});
  return at;
}

void PoseGraph::connect(const GraphEdge& edge) {
  edges_.push_back(edge);
  const uint32_t first = nodes_[edge.from].piece, second = nodes_[edge.to].piece;
  if (!edge.whole || first == second) return;
  const RigidMotion& from = nodes_[edge.from].motion;
  const RigidMotion& to = nodes_[edge.to].motion;
  // The later piece's map becomes the earlier one's.
  const bool forward = first < second;
  const RigidMotion moved =
      forward ? to.inverse() * (edge.motion * from) : from.inverse() * (edge.motion.inverse() * to);
  const uint32_t old = std::max(first, second), kept = std::min(first, second);
  for (Node& node : nodes_) {
    if (node.piece != old) continue;
    node.motion = rigid(node.motion * moved);
    node.piece = kept;
  }
}

void PoseGraph::find_pieces() {
  for (uint32_t k = 0; k < nodes_.size(); ++k) nodes_[k].piece = k;
  const auto root = [&](uint32_t node) {
    while (nodes_[node].piece != node) node = nodes_[node].piece = nodes_[nodes_[node].piece].piece;
    return node;
  };
  for (const GraphEdge& edge : edges_) {
    if (!edge.whole) continue;
    const uint32_t a = root(edge.from), b = root(edge.to);
    nodes_[std::max(a, b)].piece = std::min(a, b);
  }
  for (uint32_t k = 0; k < nodes_.size(); ++k) nodes_[k].piece = root(k);
}

struct PoseGraph::Step {
  sparse::Factor factor;
  VectorXd right;

  explicit Step(const PoseGraph& graph) : Step(graph, equations(graph)) {}

 private:
  struct Equations {
    std::vector<sparse::Entry> entries;
    VectorXd right;
  };
  Step(const PoseGraph& graph, Equations e)
      : factor(sparse::Factor::Kind::Ldlt, static_cast<int>(6 * graph.nodes_.size()), e.entries),
        right(std::move(e.right)) {}
  static Equations equations(const PoseGraph& graph) {
    Equations e;
    e.right = VectorXd::Zero(static_cast<Eigen::Index>(6 * graph.nodes_.size()));
    for (uint32_t k = 0; k < graph.nodes_.size(); ++k)
      add_block(e.entries, k, k, Matrix6d::Identity() * (graph.nodes_[k].piece == k ? kHeld : 1e-9));
    for (const GraphEdge& edge : graph.edges_) {
      if (!graph.counts(edge) || edge.from == edge.to) continue;
      const Misfit m = misfit_of(edge, graph.nodes_[edge.from], graph.nodes_[edge.to]);
      const Matrix6d w = edge.weight * edge.information;
      add_block(e.entries, edge.from, edge.from, m.by_from.transpose() * w * m.by_from);
      add_block(e.entries, edge.to, edge.to, m.by_to.transpose() * w * m.by_to);
      const Matrix6d between = m.by_to.transpose() * w * m.by_from;
      if (edge.to > edge.from)
        add_block(e.entries, edge.to, edge.from, between);
      else
        add_block(e.entries, edge.from, edge.to, between.transpose());
      e.right.segment<6>(6 * edge.from) -= m.by_from.transpose() * w * m.left;
      e.right.segment<6>(6 * edge.to) -= m.by_to.transpose() * w * m.left;
    }
    return e;
  }
};

/// By the median misfit, which a few false loops do not raise.
void PoseGraph::weigh() {
  std::vector<double> sizes;
  std::vector<double> chi2(edges_.size(), 0);
  for (size_t k = 0; k < edges_.size(); ++k) {
    if (!counts(edges_[k])) continue;
    chi2[k] = chi2_of(edges_[k], misfit_of(edges_[k], nodes_[edges_[k].from], nodes_[edges_[k].to]).left);
    if (edges_[k].loop) sizes.push_back(chi2[k]);
  }
  constexpr double kMedianChi2 = 5.35;  // of six degrees of freedom
  variance_factor_ = 1;
  if (sizes.size() >= 5) {
    std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2),
                     sizes.end());
    variance_factor_ = std::max(sizes[sizes.size() / 2] / kMedianChi2, 1.0);
  }
  const double sure = kSureChi2 * variance_factor_;
  for (size_t k = 0; k < edges_.size(); ++k) {
    const double scale = edges_[k].loop ? std::min(2 * sure / (sure + chi2[k]), 1.0) : 1;
    edges_[k].weight = scale * scale;
  }
}

void PoseGraph::drop_refused() {
  const size_t before = edges_.size();
  std::erase_if(edges_, [](const GraphEdge& edge) { return edge.loop && edge.weight < 0.1; });
  refused_ += before - edges_.size();
  if (edges_.size() != before) find_pieces();
}

void PoseGraph::solve(int steps) {
  if (nodes_.empty()) return;
  for (int step = 0; step < steps; ++step) {
    weigh();
    const Step equations(*this);
    if (!equations.factor.ok()) return;
    const VectorXd moves = equations.factor.solve(equations.right);
    double largest = 0;
    for (uint32_t k = 0; k < nodes_.size(); ++k) {
      const Vector6d move = moves.segment<6>(6 * k);
      nodes_[k].motion = rigid(motion_about(nodes_[k].middle_mm, move) * nodes_[k].motion);
      largest = std::max(largest, move.lpNorm<Eigen::Infinity>());
    }
    if (largest < 1e-7) break;
  }
  weigh();
  drop_refused();
}

std::vector<Matrix6d> PoseGraph::covariances() const {
  std::vector<Matrix6d> out(nodes_.size(), Matrix6d::Zero());
  const Step equations(*this);
  if (!equations.factor.ok()) return out;
  const auto unknowns = static_cast<Eigen::Index>(6 * nodes_.size());
  for (uint32_t piece = 0; piece < nodes_.size(); ++piece) {
    if (nodes_[piece].piece != piece) continue;
    // Aligning the piece takes the map's mean motion K away: (I - G K) B^-1 (I - G K)^T.
    Vector6d turns;
    turns << 1, 1, 1, 25, 25, 25;  // a turn counts as what it moves at 5 mm
    Matrix6d square = Matrix6d::Zero();
    for (const Node& node : nodes_)
      if (node.piece == piece) square += of_map(node).transpose() * turns.asDiagonal() * of_map(node);
    const Matrix6d inverse = dense::inverse(square);
    MatrixXd means = MatrixXd::Zero(unknowns, 6);  // K^T
    for (uint32_t k = 0; k < nodes_.size(); ++k)
      if (nodes_[k].piece == piece)
        means.middleRows<6>(6 * k) = turns.asDiagonal() * of_map(nodes_[k]) * inverse;
    MatrixXd spread(unknowns, 6);  // B^-1 K^T
    for (int c = 0; c < 6; ++c) spread.col(c) = equations.factor.solve(means.col(c));
    const Matrix6d inner = means.transpose() * spread;
    for (uint32_t k = 0; k < nodes_.size(); ++k) {
      if (nodes_[k].piece != piece) continue;
      Matrix6d own;
      for (int c = 0; c < 6; ++c)
        own.col(c) = equations.factor.solve(VectorXd(VectorXd::Unit(unknowns, 6 * k + c))).segment<6>(6 * k);
      const Matrix6d g = of_map(nodes_[k]), cross_term = spread.middleRows<6>(6 * k) * g.transpose();
      const Matrix6d sum = own - cross_term - cross_term.transpose() + g * inner * g.transpose();
      out[k] = variance_factor_ * (sum + sum.transpose()) / 2;
    }
  }
  return out;
}

}  // namespace palpate
