#include "engine/map/pose_graph.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

namespace palpate {
namespace {

using Eigen::Vector3d;

constexpr double kShift_mm = 0.01, kTurn_rad = 0.002;

/// Places on a ring, each known to the last one with those errors.
struct Ring {
  std::vector<RigidMotion> truth;
  PoseGraph graph;
  std::mt19937 random;

  explicit Ring(uint32_t seed, int count = 24) : random(seed) {
    for (int k = 0; k < count; ++k) {
      const double a = 2 * M_PI * k / count;
      Vector6d twist;
      twist << 20 * std::cos(a) - 20, 10 * std::sin(a), 0.1 * std::sin(a), 0.02, 0.01 * std::sin(a),
          0.3 * std::sin(a);
      truth.push_back(k == 0 ? RigidMotion{} : motion_about(Vector3d::Zero(), twist));
    }
    graph.add({}, Vector3d(0, 0, 0.5));
    for (uint32_t k = 1; k < truth.size(); ++k) {
      const GraphEdge edge = measured(k - 1, k);
      graph.add(edge.motion * graph.nodes()[k - 1].motion, Vector3d(0, 0, 0.5));
      graph.connect(edge);
    }
  }
  GraphEdge measured(uint32_t from, uint32_t to, bool loop = false) {
    std::normal_distribution<double> normal;
    Vector6d off;
    for (int c = 0; c < 6; ++c) off[c] = normal(random) * (c < 3 ? kShift_mm : kTurn_rad);
    GraphEdge edge{.from = from, .to = to, .at_mm = Vector3d(0, 0, 0.5), .whole = true, .loop = loop};
    edge.motion = motion_about(edge.at_mm, off) * truth[to] * truth[from].inverse();
    for (int c = 0; c < 6; ++c) edge.information(c, c) = 1 / std::pow(c < 3 ? kShift_mm : kTurn_rad, 2);
    return edge;
  }
  double last_error_mm() const {
    return twist_between(graph.nodes().back().motion, truth.back(), Vector3d(0, 0, 0.5)).head<3>().norm();
  }
};

// A closed ring is nearer to the truth than an open one, and a false loop changes nothing and is told.
TEST(PoseGraph, ClosesARingAndRefusesAFalseLoop) {
  double open = 0, closed = 0;
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    Ring ring(seed);
    open += std::pow(ring.last_error_mm(), 2);
    for (uint32_t k = 0; k < 4; ++k) ring.graph.connect(ring.measured(k, 20 + k, true));
    ring.graph.solve(20);
    EXPECT_EQ(ring.graph.refused(), 0u) << seed;
    closed += std::pow(ring.last_error_mm(), 2);
    const double before = ring.last_error_mm();
    GraphEdge wrong = ring.measured(3, 15, true);
    wrong.motion.shift_mm += Vector3d(1.5, -0.7, 0);
    ring.graph.connect(wrong);
    ring.graph.solve(20);
    EXPECT_EQ(ring.graph.refused(), 1u) << seed;
    EXPECT_NEAR(ring.last_error_mm(), before, 0.005) << seed;
  }
  std::printf("ring of 24: open %.4f mm, closed %.4f mm RMS\n", std::sqrt(open / 20), std::sqrt(closed / 20));
  EXPECT_LT(closed, 0.1 * open);
}

// Errors of aligned rings are as their covariance says: 95 % of all components within 1.96.
TEST(PoseGraph, CovariancesHoldTheTruth) {
  int held = 0, asked = 0;
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    Ring ring(seed);
    for (uint32_t k = 0; k < 4; ++k) ring.graph.connect(ring.measured(k, 20 + k, true));
    ring.graph.solve(20);
    const std::vector<Matrix6d> spread = ring.graph.covariances();
    // Aligned by least squares over all nodes, turns counting as at 5 mm.
    Vector6d turns;
    turns << 1, 1, 1, 25, 25, 25;
    Matrix6d square = Matrix6d::Zero();
    Vector6d right = Vector6d::Zero();
    std::vector<Matrix6d> by;
    std::vector<Vector6d> error;
    for (size_t k = 0; k < ring.truth.size(); ++k) {
      const PoseGraph::Node& node = ring.graph.nodes()[k];
      by.push_back(seen_at(node.motion.shift_mm, node.middle_mm) * carried_by(node.motion));
      error.push_back(twist_between(node.motion, ring.truth[k], node.middle_mm));
      square += by[k].transpose() * turns.asDiagonal() * by[k];
      right += by[k].transpose() * turns.asDiagonal() * error[k];
    }
    const Vector6d whole = square.partialPivLu().solve(right);
    for (size_t k = 0; k < ring.truth.size(); ++k) {
      const Vector6d left = error[k] - by[k] * whole;
      for (int c = 0; c < 6; ++c, ++asked)
        held += std::abs(left[c]) < 1.96 * std::sqrt(spread[k](c, c)) ? 1 : 0;
    }
  }
  std::printf("held %.3f\n", double(held) / asked);
  EXPECT_GT(held, 0.92 * asked);
  EXPECT_LT(held, 0.99 * asked);
}

// What no whole motion joins is a piece of its own; one that does moves all of the later piece.
TEST(PoseGraph, JoinsPieces) {
  Ring ring(1, 8);
  PoseGraph graph;
  for (uint32_t k = 0; k < 8; ++k) graph.add(k < 4 ? ring.truth[k] : RigidMotion{}, Vector3d::Zero());
  for (const uint32_t k : {0u, 1u, 2u, 4u, 5u, 6u}) graph.connect(ring.measured(k, k + 1));
  GraphEdge sliding = ring.measured(3, 4);
  sliding.whole = false;
  graph.connect(sliding);
  graph.solve();
  EXPECT_EQ(graph.nodes()[7].piece, 4u);
  graph.connect(ring.measured(2, 5, true));
  EXPECT_EQ(graph.nodes()[7].piece, 0u);
  graph.solve(20);
  EXPECT_LT(twist_between(graph.nodes()[7].motion, ring.truth[7], Vector3d::Zero()).head<3>().norm(), 0.3);
}

}  // namespace
}  // namespace palpate
