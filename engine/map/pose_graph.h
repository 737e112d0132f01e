// Pose graph: places of key frames that agree best with all motions measured between them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/motion/registration.h"

namespace palpate {

/// A measured motion from one node to another.
struct GraphEdge {
  uint32_t from = 0, to = 0;
  RigidMotion motion = {};                          ///< from node `from` to node `to`, in the pad's axes
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();  ///< where its error is seen, in the pad of `to`
  /// Of the small motion that is missing, mm and radians; 0 along what is not determined.
  Matrix6d information = Matrix6d::Zero();
  bool whole = false;  ///< all six directions are determined
  bool loop = false;   ///< may be false, and loses its weight where it disagrees with the rest
  double weight = 1;   ///< 0 to 1, of the last solve
};
/// The edge that a registration is.
GraphEdge edge_of(uint32_t from, uint32_t to, const Registration& found);

/// Nodes are rigid motions from the map to the pad. Those that whole edges connect are a piece; nothing is
/// said of where two pieces lie to each other, and edges that are not whole count within a piece only.
class PoseGraph {
 public:
  struct Node {
    RigidMotion motion;         ///< from the map to the pad
    Eigen::Vector3d middle_mm;  ///< of the contact, in the pad; errors are seen there
    uint32_t piece = 0;         ///< its lowest node
  };

  uint32_t add(const RigidMotion& motion, const Eigen::Vector3d& middle_mm);
  /// Joins two pieces where it is whole and leads from one to the other: all of the later one moves.
  void connect(const GraphEdge& edge);

  /// Gauss-Newton over all pieces, each held at its lowest node, at most `steps` steps. Loops are weighed by
  /// dynamic covariance scaling (Agarwal, Tipaldi, Spinello, Stachniss and Burgard 2013). Those that keep
  /// less than a tenth of their weight go, and pieces part where only they held them together.
  void solve(int steps = 5);

  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<GraphEdge>& edges() const { return edges_; }
  size_t refused() const { return refused_; }  ///< loops that have gone
  /// Variance of the edges' misfits in units of what they state; 1 where nothing is left to compare.
  double variance_factor() const { return variance_factor_; }

  /// Covariance of each node's missing motion, seen at its middle, once its piece as a whole is aligned with
  /// the truth; times the variance factor where that is above 1.
  std::vector<Matrix6d> covariances() const;

 private:
  struct Step;
  bool counts(const GraphEdge& edge) const { return nodes_[edge.from].piece == nodes_[edge.to].piece; }
  void find_pieces();
  void weigh();
  void drop_refused();

  std::vector<Node> nodes_;
  std::vector<GraphEdge> edges_;
  size_t refused_ = 0;
  double variance_factor_ = 1;
};

}  // namespace palpate
