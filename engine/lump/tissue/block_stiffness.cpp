#include "engine/lump/tissue/block_stiffness.h"

#include <cmath>

#include "engine/base/numbers.h"

namespace palpate::lump {
namespace {

constexpr BlockStiffness kBuiltIn{
#include "engine/lump/tissue/block_stiffness.inc"
};

/// Volume over that of the box around it.
double filling(InclusionShape shape) {
  switch (shape) {
    case InclusionShape::Sphere:
    case InclusionShape::Ellipsoid:
      return kPi / 6;
    case InclusionShape::Cylinder:
    case InclusionShape::LyingCylinder:
      break;
  }
  return kPi / 4;
}

}  // namespace

double column_load(double compression) {
  const double height = 1 - compression;
  return (1 / (height * height) - height) / 3;
}

const BlockStiffness& BlockStiffness::built_in() {
  return kBuiltIn;
}

std::array<double, BlockStiffness::kPlainTerms> BlockStiffness::plain_terms(double thickness_mm,
                                                                            double compression) {
  const double t = (thickness_mm - 20) / 4, c = compression / 0.2;
  return {1, t, t * t, c, c * c, t * c, t * t * c, t * c * c, c * c * c};
}

std::array<double, BlockStiffness::kLumpTerms> BlockStiffness::lump_terms(const Case::Lump& lump,
                                                                          double thickness_mm,
                                                                          double compression) {
  const double size = lump.diameter_mm / thickness_mm;
  const double middle =
      2 * (lump.depth_mm + lump.diameter_mm / 2) / thickness_mm - 1;  // -1: surface, 1: floor
  const double yields = 1 / lump.stiffness_ratio;
  const double away = (std::pow(lump.offset_mm[0], 2) + std::pow(lump.offset_mm[1], 2)) / 36;
  const auto is = [&](InclusionShape shape) { return lump.shape == shape ? 1.0 : 0.0; };
  return {1,
          middle,
          middle * middle,
          size,
          yields,
          compression / 0.2,
          away,
          is(InclusionShape::Ellipsoid),
          is(InclusionShape::Cylinder),
          is(InclusionShape::LyingCylinder)};
}

double BlockStiffness::dilute(const Case::Lump& lump, const std::array<double, 3>& block_mm) {
  const auto [x, y, z] = lump.size_mm();
  const double share = filling(lump.shape) * x * y * z / (block_mm[0] * block_mm[1] * block_mm[2]);
  return share * 5 * (lump.stiffness_ratio - 1) / (2 * lump.stiffness_ratio + 3);
}

double BlockStiffness::by_lump(const Case::Lump& what, const std::array<double, 3>& block_mm,
                               double compression) const {
  const auto terms = lump_terms(what, block_mm[2], compression);
  double log_factor = 0;
  for (size_t i = 0; i < lump.size(); ++i) log_factor += lump[i] * terms[i];
  return dilute(what, block_mm) * std::exp(log_factor);
}

double BlockStiffness::load(const std::array<double, 3>& block_mm, const std::optional<Case::Lump>& what,
                            double compression) const {
  const auto terms = plain_terms(block_mm[2], compression);
  double stiffer = what ? by_lump(*what, block_mm, compression) : 0;
  for (size_t i = 0; i < plain.size(); ++i) stiffer += plain[i] * terms[i];
  return column_load(compression) * std::exp(stiffer);
}

}  // namespace palpate::lump
