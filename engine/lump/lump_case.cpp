#include "engine/lump/lump_case.h"

#include "engine/lump/observation/observation.h"

namespace palpate::lump {
namespace {

constexpr double kEllipsoidLength = 1.5, kLyingLength = 2.5;  // over the diameter

}  // namespace

double length_over_diameter(InclusionShape shape) {
  return shape == InclusionShape::Ellipsoid       ? kEllipsoidLength
         : shape == InclusionShape::LyingCylinder ? kLyingLength
                                                  : 1;
}

std::array<double, 3> Case::Lump::size_mm() const {
  const double length = length_over_diameter(shape) * diameter_mm;
  return along_y ? std::array{diameter_mm, length, diameter_mm}
                 : std::array{length, diameter_mm, diameter_mm};
}

Case::Lump lump_of(const Estimate& estimate) {
  Case::Lump lump;
  lump.shape = estimate.shape;
  lump.diameter_mm = estimate.size_mm.value;
  lump.depth_mm = estimate.depth_mm.value;
  lump.stiffness_ratio = estimate.stiffness_ratio.value;
  lump.offset_mm = {estimate.x_mm.value, estimate.y_mm.value};
  return lump;
}

fem::Scene scene_of(const Case& what, const std::array<double, 2>& block_mm, double poisson,
                    const std::array<uint32_t, 3>& cells) {
  fem::Scene scene;
  scene.block_mm = in_scene_axes(what, std::array{block_mm[0], block_mm[1], what.thickness_mm});
  scene.young_Pa = what.young_Pa;
  scene.poisson = poisson;
  scene.presser = fem::Presser::Flat;
  scene.press_mm = what.press_mm.back();
  scene.cells = in_scene_axes(what, cells);
  scene.skin = what.skin;
  scene.plate_sticks = what.plate_sticks;
  scene.plate_friction = what.plate_friction;
  scene.inclusion.reset();
  const auto inclusion_of = [&what](const Case::Lump& lump) {
    fem::Inclusion inclusion;
    inclusion.shape = lump.shape;
    inclusion.size_mm = in_scene_axes(what, lump.size_mm());
    inclusion.depth_mm = lump.depth_mm;
    inclusion.stiffness_ratio = lump.stiffness_ratio;
    inclusion.offset_mm = in_scene_axes(what, lump.offset_mm);
    return inclusion;
  };
  if (what.lump) scene.inclusion = inclusion_of(*what.lump);
  if (what.lump && what.second) scene.others = {inclusion_of(*what.second)};
  return scene;
}

PressureMap in_case_axes(const Case& what, PressureMap map) {
  if (!what.lump || !what.lump->along_y) return map;
  PressureMap turned;
  turned.width = map.height;
  turned.height = map.width;
  turned.pitch_mm = {map.pitch_mm[1], map.pitch_mm[0]};
  turned.values.resize(map.values.size());
  for (uint32_t y = 0; y < turned.height; ++y)
    for (uint32_t x = 0; x < turned.width; ++x) turned.values[size_t{y} * turned.width + x] = map.at(y, x);
  return turned;
}

}  // namespace palpate::lump
