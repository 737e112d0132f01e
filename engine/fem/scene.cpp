#include "engine/fem/scene.h"

#include <cmath>
#include <sstream>

#include "palpate/error.h"

namespace palpate::fem {
namespace {

std::string value_text(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

void range(const char* what, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw Error(Failure::Usage, std::string(what) + " from " + value_text(low) + " to " + value_text(high),
              value_text(value), "a value in that range");
}

void check(const Scene& s, const Inclusion& lump) {
  const std::array<double, 3> size = lump.size();
  for (size_t c = 0; c < 3; ++c)
    range("the inclusion's size, mm,", size[c], 1e-3 * s.block_mm[c], s.block_mm[c]);
  range("the inclusion's depth, mm,", lump.depth_mm, 0, s.block_mm[2]);
  range("the stiffness ratio", lump.stiffness_ratio, 0.01, 1e5);
  if (lump.depth_mm + size[2] > s.block_mm[2] * (1 + 1e-9))
    throw Error(Failure::Usage, "an inclusion above the block's base at " + value_text(s.block_mm[2]) + " mm",
                "one that reaches down to " + value_text(lump.depth_mm + size[2]) + " mm",
                "less depth or size, or a thicker block");
  if (s.skin && lump.depth_mm < s.skin->thickness_mm * (1 - 1e-9))
    throw Error(Failure::Usage,
                "an inclusion below the skin, " + value_text(s.skin->thickness_mm) + " mm deep or deeper",
                "one " + value_text(lump.depth_mm) + " mm deep", "a deeper inclusion or a thinner skin");
  for (size_t c = 0; c < 2; ++c)
    if (!(std::abs(lump.offset_mm[c]) + size[c] / 2 <= s.block_mm[c] / 2 * (1 + 1e-9)))
      throw Error(Failure::Usage, "an inclusion inside the block's sides",
                  "one that reaches " + value_text(std::abs(lump.offset_mm[c]) + size[c] / 2) +
                      " mm from the middle of " + value_text(s.block_mm[c]) + " mm",
                  "a smaller offset or size, or a wider block");
}

void check_plate(const Scene& s) {
  range("the plate's coefficient of friction", s.plate_friction, 0, 2);
  if (!s.plate_half_mm && !s.plate_sticks && s.plate_friction == 0) return;
  if (s.plate_sticks && s.plate_friction > 0)
    throw Error(Failure::Usage, "either a plate that sticks or one that slides with friction", "both",
                "one of the two");
  if (s.presser != Presser::Flat || !s.pad.empty())
    throw Error(Failure::Usage,
                "the flat presser straight on the tissue for a plate that is smaller, sticks or has friction",
                s.pad.empty() ? "another presser" : "a pad", "--presser flat without --pad");
  if (!s.plate_half_mm) return;
  for (size_t c = 0; c < 2; ++c)
    range("half of the plate, mm,", (*s.plate_half_mm)[c], s.block_mm[c] / s.cells[c], s.block_mm[c] / 2);
  if (!plate_on_nodes(s))
    throw Error(Failure::Usage, "a plate that ends on planes of nodes",
                "cells of " + value_text(s.block_mm[0] / s.cells[0]) + " by " +
                    value_text(s.block_mm[1] / s.cells[1]) + " mm",
                "another number of cells, or a plate of whole cells");
}

}  // namespace

std::array<double, 3> Inclusion::size() const {
  switch (shape) {
    case InclusionShape::Sphere:
      return {size_mm[0], size_mm[0], size_mm[0]};
    case InclusionShape::Ellipsoid:
      return size_mm;
    case InclusionShape::Cylinder:
      return {size_mm[0], size_mm[0], size_mm[2]};
    case InclusionShape::LyingCylinder:
      return {size_mm[0], size_mm[2], size_mm[2]};
  }
  return size_mm;
}

bool plate_on_nodes(const Scene& s) {
  for (size_t c = 0; s.plate_half_mm && c < 2; ++c) {
    const double cells = (s.block_mm[c] / 2 - (*s.plate_half_mm)[c]) / (s.block_mm[c] / s.cells[c]);
    if (std::abs(cells - std::round(cells)) > 1e-6) return false;
  }
  return true;
}

void check(const Scene& s) {
  const char* sides[] = {"the block's length, mm,", "the block's width, mm,", "the block's thickness, mm,"};
  for (size_t c = 0; c < 3; ++c) range(sides[c], s.block_mm[c], 0.01, 1e4);
  range("the tissue's Young's modulus, Pa,", s.young_Pa, 1, 1e12);
  range("Poisson's ratio", s.poisson, 0, 0.4999);
  for (size_t c = 0; c < 3; ++c) range("cells along a side", s.cells[c], 4, 512);
  if (s.skin) {
    range("the skin's thickness, mm,", s.skin->thickness_mm, 1e-3 * s.block_mm[2], s.block_mm[2] / 2);
    range("the skin's stiffness ratio", s.skin->stiffness_ratio, 0.01, 1e5);
  }
  if (s.inclusion) check(s, *s.inclusion);
  for (const Inclusion& lump : s.others) check(s, lump);
  for (const PadSheet& sheet : s.pad) {
    range("a pad sheet's thickness, mm,", sheet.thickness_mm, 0.01, 1e3);
    range("a pad sheet's Young's modulus, Pa,", sheet.young_Pa, s.young_Pa * 1e-5, s.young_Pa * 1e5);
  }
  if (s.pad_slides && (s.pad.empty() || s.presser != Presser::Flat))
    throw Error(Failure::Usage, "a sliding pad that is bonded to the flat plate that presses it",
                s.pad.empty() ? "no pad" : "a pad that nothing holds sideways",
                "the flat presser and a pad, or a bonded pad");
  check_plate(s);
  if (s.presser == Presser::Sphere) range("the ball's radius, mm,", s.ball_radius_mm, 0.01, 1e5);
  if (s.press_mm.has_value() == s.force_N.has_value())
    throw Error(Failure::Usage, "either a travel or a force of the presser", s.press_mm ? "both" : "neither",
                "one of the two");
  if (s.press_mm) range("the way to press, mm,", *s.press_mm, 1e-9, s.block_mm[2]);
  if (s.presser == Presser::Sphere && s.press_mm)
    range("a ball's way, mm, within its radius,", *s.press_mm, 1e-9, s.ball_radius_mm);
  if (s.force_N) range("the force, N,", *s.force_N, 1e-9, 1e9);
}

}  // namespace palpate::fem
