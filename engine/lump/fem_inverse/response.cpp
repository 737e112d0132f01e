#include "engine/lump/fem_inverse/response.h"

#include <algorithm>
#include <cmath>

namespace palpate::lump {

Case::Lump changed(Case::Lump lump, size_t unknown, double by) {
  switch (unknown) {
    case kLnSize:
      lump.diameter_mm *= std::exp(by);
      break;
    case kLnDepth:
      lump.depth_mm *= std::exp(by);
      break;
    case kLnRatio:
      lump.stiffness_ratio *= std::exp(by);
      break;
    default:
      lump.offset_mm[unknown - kPlaceX] += by;
  }
  return lump;
}

ComparedNodes::ComparedNodes(const Observation& observation, double rim_mm) : observation_(observation) {
  const PressureMap& first = observation.pressure_Pa.front();
  for (size_t n = 0; n < first.values.size(); ++n) {
    nodes_.push_back(n);
    const size_t last = nodes_.size() - 1;
    const bool inside = std::abs(x_mm(last)) <= observation.block_mm[0] / 2 - rim_mm &&
                        std::abs(y_mm(last)) <= observation.block_mm[1] / 2 - rim_mm;
    const bool seen = std::all_of(observation.pressure_Pa.begin(), observation.pressure_Pa.end(),
                                  [n](const PressureMap& map) { return std::isfinite(map.values[n]); });
    if (!inside || !seen) nodes_.pop_back();
  }
}

double ComparedNodes::x_mm(size_t node) const {
  const PressureMap& map = observation_.pressure_Pa.front();
  return observation_.window_mm[0] +
         (static_cast<double>(nodes_[node] % map.width) - (map.width - 1) / 2.0) * map.pitch_mm[0];
}

double ComparedNodes::y_mm(size_t node) const {
  const PressureMap& map = observation_.pressure_Pa.front();
  const size_t row = nodes_[node] / map.width;
  return observation_.window_mm[1] + (static_cast<double>(row) - (map.height - 1) / 2.0) * map.pitch_mm[1];
}

Eigen::VectorXd ComparedNodes::values() const {
  Eigen::VectorXd all(static_cast<Eigen::Index>(nodes_.size() * observation_.pressure_Pa.size()));
  Eigen::Index at = 0;
  for (const PressureMap& map : observation_.pressure_Pa)
    for (const size_t n : nodes_) all(at++) = double{map.values[n]};
  return all;
}

}  // namespace palpate::lump
