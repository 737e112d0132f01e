// The shape of what lies hidden in a block of tissue.
#pragma once

#include <cstdint>

namespace palpate {

enum class InclusionShape : uint8_t {
  Sphere,
  Ellipsoid,      ///< axes along x, y and z
  Cylinder,       ///< upright: its round faces look up and down
  LyingCylinder,  ///< its axis is x
};
inline constexpr const char* kShapeNames[] = {"sphere", "ellipsoid", "cylinder", "lying"};
const char* to_string(InclusionShape shape);

}  // namespace palpate
