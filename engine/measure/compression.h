// Two compressions of one object, compared by control points of their tactile shapes: the matching of
// points, and the strain between (Figs. 14 and 15 of the source paper).
//
// Points of a bare gel's shape are matched by that shape, not by material: what moves between two
// compressions is where the contact is, so the strain in the plane is the growth of the contact, which is
// that of the object's face where the face is flat and slides on the pad. Where the pad shows a pattern, its
// followed points (Touch::skin_points) are material points of the pad's skin and need no matching.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/measure/strain.h"
#include "engine/numeric/control_points.h"
#include "engine/numeric/matching/matching.h"

namespace palpate {

/// Along the pad, mm, and depth into it.
struct ShapePoint {
  double x_mm = 0, y_mm = 0, depth_mm = 0;
};
std::vector<ShapePoint> shape_points(const ControlPoints& points, double pitch_mm_per_px);

struct CompressionOptions {
  std::optional<double> lambda;  ///< of the spline; none: chosen by the data
  double poisson = 0.5;          ///< for the axial strain by area, 0 to 0.5
  /// Mean over the draws of the change of the contact's counted area, over that before. A second measure of
  /// the same number: where the draws' mean lies apart from it, the standard errors are widened by that.
  std::optional<double> counted_growth;
};

/// One point and where it went.
struct MatchedPoint {
  ShapePoint before, after;
  double probability = 1;
};

struct Compression {
  std::string reason;                ///< why there is no strain, one line; empty: there is
  std::optional<MatchResult> match;  ///< none of followed points
  std::vector<MatchedPoint> pairs;
  std::optional<StrainField> field;  ///< over the plane, mm
  MeanStrain plane;                  ///< mean over the points before, standard errors
  double axial = 0, axial_sd = 0;    ///< Green-Lagrange's E_zz by the change of area (strain.h, b), negative
                                     ///< where compressed
  double turn_rad = 0,
         turn_sd_rad = 0;   ///< of the shape about the pad's normal, from +x to +y; of draws only
  double deepening_mm = 0;  ///< mean change of depth over the pairs
};

/// Matches the shapes' points in space and strains the plane with what found a partner. Never throws for what
/// the points are like: `reason` says what is missing (too few points, no reliable match, points on a line).
Compression compare_compressions(std::span<const ShapePoint> before, std::span<const ShapePoint> after,
                                 const CompressionOptions& options = {});

/// The same of several draws of control points of each shape, as many of one as of the other. A spline
/// through one draw's partners follows where its points happen to lie; the mean over draws does not, and
/// their scatter gives its error: 1.96 standard errors hold 95 % (Student's factor for the few draws is in
/// them). What all draws share, an error of the surface, they do not show: see counted_growth. `match` is the
/// first draw's, `pairs` are of all draws, each turned back by its own turn: a round shape fits itself after
/// any, and strain does not depend on it.
Compression compare_draws(std::span<const std::vector<ShapePoint>> before,
                          std::span<const std::vector<ShapePoint>> after,
                          const CompressionOptions& options = {});

/// The same for points whose partners are known.
Compression strain_of_pairs(std::vector<MatchedPoint> pairs, const CompressionOptions& options = {});

}  // namespace palpate
