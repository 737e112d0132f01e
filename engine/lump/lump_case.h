// One block of tissue with the lump in it, and the scene that the solver presses for it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "engine/fem/scene.h"

namespace palpate::lump {

struct Range {
  double low = 0, high = 0;
};

/// One block.
struct Case {
  struct Lump {
    InclusionShape shape = InclusionShape::Sphere;
    bool along_y = false;  ///< long shapes: their long axis is y
    double diameter_mm = 0, depth_mm = 0, stiffness_ratio = 1;
    std::array<double, 2> offset_mm = {0, 0};
    /// Outer sizes along the block's x, y, z.
    std::array<double, 3> size_mm() const;
  };
  uint32_t number = 0;
  std::optional<Lump> lump;
  /// Another one beside it. Long shapes lie along the same axis in both.
  std::optional<Lump> second;
  std::optional<fem::Skin> skin;  ///< over the tissue and the lumps
  bool plate_sticks = false;      ///< the plate holds the tissue sideways
  double plate_friction = 0;      ///< with which it slides on the tissue
  double thickness_mm = 0, young_Pa = 0;
  std::vector<double> press_mm;  ///< one per load, rising
};

struct Estimate;
/// The lump that an estimate's values describe; the long axis of a long shape is x.
Case::Lump lump_of(const Estimate& estimate);

/// Length of a shape over its diameter: 1 but for the ellipsoid and the lying cylinder.
double length_over_diameter(InclusionShape shape);

/// The case as the solver has it, with long shapes along x: where the case's lies along y, x and y of the
/// scene are y and x of the case. `block_mm`: length and width; `cells`: along x, y, z of the case.
fem::Scene scene_of(const Case& what, const std::array<double, 2>& block_mm, double poisson,
                    const std::array<uint32_t, 3>& cells);
/// Numbers along x, y (and z) of the block as that scene has them.
template <typename Numbers>
Numbers in_scene_axes(const Case& what, Numbers numbers) {
  if (what.lump && what.lump->along_y) std::swap(numbers[0], numbers[1]);
  return numbers;
}
/// A map of that scene with the axes of the case.
PressureMap in_case_axes(const Case& what, PressureMap map);

}  // namespace palpate::lump
