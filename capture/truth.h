// Ground truth of a synthetic frame.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace palpate {

/// One contact of several.
struct TrueContact {
  double force_N = 0;
  double center_x_px = 0;
  double center_y_px = 0;
  double radius_px = 0;
};

/// Rigid motion of an object since the first frame in which it touched: its point that was then at the middle
/// of the picture on the untouched surface has gone by shift_mm, and it is turned by the rotation vector
/// turn_rad (the shorter way round) about that point. x right, y down, z into the pad.
struct TrueMotion {
  std::array<double, 3> shift_mm = {}, turn_rad = {};
};

/// Truth of one synthetic frame. Pixel coordinates as in Touch; x right, y down. With several contacts forces
/// are sums, the centre and the turn weighted by force, the radius that of a circle of their area, the
/// indentation and the slip those of the worst.
struct Truth {
  uint64_t sequence = 0;
  double time_s = 0;
  bool contact = false;
  double force_N = 0;    ///< normal force on the pad
  double shear_x_N = 0;  ///< tangential force on the pad, friction limited
  double shear_y_N = 0;
  bool slipping = false;
  double center_x_px = 0;  ///< centre of the contact
  double center_y_px = 0;
  double radius_px = 0;       ///< contact radius
  double indentation_mm = 0;  ///< depth below rest level at the deepest point
  double stick_share = 1;     ///< radius of the part of the contact that sticks over the contact's; 0: slides
  double torsion_rad = 0;     ///< turn of the skin under the contact, from +x towards +y
  double volume_mm3 = 0;      ///< indented volume below rest level
  std::optional<TrueMotion> motion = {};  ///< of an object that touches, in scenes of one
  std::vector<TrueContact> contacts;      ///< each; empty without contact
  std::vector<float> depth_mm;            ///< height x width, below the rest level; < 0 where the pad bulges
};

}  // namespace palpate
