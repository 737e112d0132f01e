// Coulomb friction of a flat plate on the tissue: it holds back what slides along it with a fraction of the
// pressure.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "engine/fem/linear/grid.h"

namespace palpate::fem {

/// Friction of a plate that is pressed on steadily, so that tissue slides one way: it points against the
/// whole slide s of a node, with mu N s / sqrt(s^2 + e^2), N the node's normal force and e a thousandth of
/// the tissue's thickness, within which the plate lets go (regularised Coulomb friction, e.g. Wriggers,
/// Computational Contact Mechanics, 2006, 5.2). Forces in N over the tissue's modulus in MPa.
class PlateFriction {
 public:
  /// Without friction (scene.plate_friction 0) or on a pad it does nothing. Keeps no argument.
  PlateFriction(const Scene& scene, const CellGrid& grid, const FixedNodes& fixed);

  explicit operator bool() const { return friction_ > 0; }

  /// Takes the normal forces from the tissue's forces on all nodes; they stay until the next call.
  void press(const std::vector<double>& force);
  /// Adds the friction of displacements to the tissue's forces.
  void add_forces(const std::vector<double>& displacement, std::vector<double>& force) const;
  /// Forms the change of friction with displacement there, the normal forces held. `gentle`: a spring to
  /// where a node was at rest, as strong as its friction now, which never overshoots but ends slowly.
  void form_tangent(const std::vector<double>& displacement, bool gentle = false);
  /// Adds that change of displacements `in` to `out`, 3 x nodes.
  void add_changes(const double* in, double* out) const;

 private:
  struct Node {
    size_t at = 0;
    double normal = 0;
    std::array<double, 3> tangent{};  ///< xx, xy, yy
    std::array<bool, 2> free{};       ///< along x and y: on no plane of symmetry
  };

  double friction_ = 0, lets_go_mm_ = 0;
  size_t nodes_ = 0;
  std::vector<Node> under_plate_;
};

}  // namespace palpate::fem
