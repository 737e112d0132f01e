// Control points: a few hundred places of the tactile shape, spread evenly over it, that are followed from
// one compression to the next (Eq. 64 of the source paper).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "palpate/frame.h"

namespace palpate {

enum class ControlKind : uint8_t {
  Contact,  ///< under the object
  Rim,      ///< where the depth passes ControlOptions::contact_mm
  Feature,  ///< given by the caller: markers, corners
};

struct ControlPoint {
  double x_px = 0, y_px = 0;
  double depth_mm = 0;
  ControlKind kind = ControlKind::Contact;
};

struct ControlOptions {
  uint32_t count = 200;        ///< 50 to 2000, features included
  uint64_t seed = 1;           ///< the same seed and shape: the same points
  double pitch_mm_per_px = 1;  ///< > 0; distances are along the pad and in depth
  double contact_mm = 0.02;    ///< what is deeper counts as touched, > 0
  uint32_t neighbours = 6;     ///< of each point at least, 3 to 20
};

struct ControlPoints {
  std::vector<ControlPoint> points;  ///< features, then rim, then contact; fewer than asked for where the
                                     ///< contact is too small, none without contact
  double contact_mm2 = 0;            ///< touched area along the pad
  double rim_mm = 0;                 ///< its outline's length, noise's own wiggles included
  double spacing_mm = 0;             ///< mean distance of a point to its nearest; 0 for fewer than two
  double least_spacing_mm = 0;
  /// Nearest points of each, by rising distance, and those of which it is one of the nearest: i is a
  /// neighbour of j where j is one of i.
  std::vector<std::vector<uint32_t>> neighbours;
};

/// Places to look at, one in each cell of a grid over `box` (what may be touched), drawn within it.
struct CandidateGrid {
  uint32_t columns = 0, rows = 0;
  double step_x_px = 0, step_y_px = 0;  ///< of the cells
  std::vector<std::array<double, 2>> places;
};

/// Enough of them for options.count points should the whole box be touched or a twentieth of it, no finer
/// than a pixel. Throws Error(Failure::Usage) naming the option that is out of range.
CandidateGrid control_candidates(const PixelRect& box, const ControlOptions& options);

/// Chooses among them by their depths, mm: points of the outline first, then those of the contact, each as
/// far as possible from the others (weighted sample elimination; Yuksel 2015), so that distances in the shape
/// are nearly alike and no two points are close. `features` (x, y, depth as a point has them) are kept where
/// they are touched. A depth that is not finite is not touched.
ControlPoints choose_control_points(const CandidateGrid& candidates, std::span<const float> depths_mm,
                                    std::span<const ControlPoint> features, const ControlOptions& options);

}  // namespace palpate
