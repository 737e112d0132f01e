#include "engine/fem/large_strain/plate_friction.h"

#include <algorithm>
#include <cmath>

namespace palpate::fem {
namespace {

constexpr double kLetsGo = 1e-3;  // of the tissue's thickness

}  // namespace

PlateFriction::PlateFriction(const Scene& scene, const CellGrid& grid, const FixedNodes& fixed)
    : friction_(scene.plate_friction), lets_go_mm_(kLetsGo * scene.block_mm[2]), nodes_(grid.nodes()) {
  for (size_t n = 0; friction_ > 0 && n < grid.node(0, 0, 1); ++n)
    if ((fixed[n] & kFixedZ) != 0)
      under_plate_.push_back({n, 0, {}, {(fixed[n] & kFixedX) == 0, (fixed[n] & kFixedY) == 0}});
}

void PlateFriction::press(const std::vector<double>& force) {
  for (Node& node : under_plate_) node.normal = std::max(0.0, force[2 * nodes_ + node.at]);
}

void PlateFriction::add_forces(const std::vector<double>& displacement, std::vector<double>& force) const {
  for (const Node& node : under_plate_) {
    const double x = displacement[node.at], y = displacement[nodes_ + node.at];
    const double held = friction_ * node.normal / std::hypot(x, y, lets_go_mm_);
    force[node.at] += held * x;
    force[nodes_ + node.at] += held * y;
  }
}

void PlateFriction::form_tangent(const std::vector<double>& displacement, bool gentle) {
  for (Node& node : under_plate_) {
    const double x = displacement[node.at], y = displacement[nodes_ + node.at];
    const double length = std::hypot(x, y, lets_go_mm_), held = friction_ * node.normal / length;
    const double loses = gentle ? 0 : held / (length * length);
    node.tangent = {held - loses * x * x, -loses * x * y, held - loses * y * y};
  }
}

void PlateFriction::add_changes(const double* in, double* out) const {
  for (const Node& node : under_plate_) {
    const size_t x = node.at, y = nodes_ + node.at;
    const double along_x = node.free[0] ? in[x] : 0, along_y = node.free[1] ? in[y] : 0;
    if (node.free[0]) out[x] += node.tangent[0] * along_x + node.tangent[1] * along_y;
    if (node.free[1]) out[y] += node.tangent[1] * along_x + node.tangent[2] * along_y;
  }
}

}  // namespace palpate::fem
