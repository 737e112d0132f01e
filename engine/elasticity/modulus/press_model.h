// A sample between the sensor's pad and a rigid table: what a camera and a stage see at a given force and
// modulus. This is what a modulus is fitted with. Small strains, frictionless on the pad. Lengths in mm,
// forces in N, moduli in MPa.
//
// Sphere: the bonded layer's exact contact equation with the ball's own profile, the ball yielding as a half
// space does (engine/elasticity/modulus/indentation.h); the approach also has the table's side and what a
// ball is short of two half spaces. Cylinder and cube (taken as the cylinder of the same face): pressure by
// rings, the layer's answer by its Green's function, the sample's by finite elements of unit modulus. How far
// its face's mean comes down is F h / (E A) on a smooth table whatever the distribution of pressure
// (reciprocity with even pressure). The pad carries the face as wide as it has become.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/elasticity/modulus/axisymmetric.h"
#include "engine/elasticity/modulus/indentation.h"

namespace palpate {

/// Largest Poisson's ratio that finite elements stand for.
inline constexpr double kMostPoisson = 0.4999;

enum class SampleShape : uint8_t {
  Sphere,
  Cylinder,  ///< upright
  Cube,      ///< a block with a square face
  Dome,      ///< a paraboloid with a sphere's curvature at its tip, as the built-in sensor's scenes press
};
const char* to_string(SampleShape shape);

struct Sample {
  SampleShape shape = SampleShape::Cube;
  double size_mm = 10;          ///< a cube's face, side to side; diameter of cylinder, sphere or dome
  double height_mm = 10;        ///< of cylinder or block; a sphere's is its diameter
  double poisson = 0.5;         ///< 0 to 0.5; the elements take 0.4999 for 0.5
  double relative_size_sd = 0;  ///< standard error of size_mm as a share
  Support table = Support::Sliding;

  bool flat() const { return shape == SampleShape::Cylinder || shape == SampleShape::Cube; }
  /// Radius of the circle of the face's area; a sphere's own.
  double radius_mm() const;
  double face_mm2() const;
};
/// "cube,10mm", "block,10x8mm" (width x height), "cylinder,12x10mm" (diameter x height), "sphere,16mm" (its
/// diameter). Throws Error(Failure::Usage).
Sample parse_sample(const std::string& text);
/// Throws Error(Failure::Input) on sizes or ratios out of range.
void check(const Sample& sample, const Pad& pad);

/// Observed quantities of one press. NaN: not determined.
struct PressSight {
  double radius_mm = 0;      ///< of the contact, of the circle of the same area
  double depth_mm = 0;       ///< of the pad's deepest point
  double mean_depth_mm = 0;  ///< of the pad, over the contact; NaN of a sphere
  double approach_mm = 0;    ///< of pad's base and table, from first touch
  double strain = 0;         ///< axial, of the sample, compression > 0: mean of a flat one, 0.2 a/R of a ball
};

class PressModel {
 public:
  /// The pad's modulus is only the unit of what follows. Takes some 0.1 s. Throws as check does.
  PressModel(const Pad& pad, const Sample& sample);

  const Sample& sample() const { return sample_; }
  const Pad& pad() const { return pad_; }

  /// Range of sample over pad modulus that is tabulated.
  static constexpr double kLeastRatio = 1e-5, kMostRatio = 1e6;
  /// Widest contact of a ball that the model stands for, as a fraction of its radius.
  static constexpr double kWidest = 0.5;

  /// `pad_MPa`: the pad's modulus; `size`: the sample's size over its nominal one (near 1: a pad's thickness
  /// is not scaled with it). Numbers are NaN where a ball's contact is wider than kWidest, a contact wider
  /// than 6 pad thicknesses or the ratio of moduli beyond the table.
  PressSight at_force(double force_N, double young_MPa, double pad_MPa, double size = 1) const;
  /// A ball's depth at a contact radius, without knowing the force; NaN as above.
  double depth_at_radius_mm(double radius_mm, double young_MPa, double pad_MPa, double size = 1) const;
  /// For a flat sample: force over face, height and mean strain that the modulus would have at even strain,
  /// over the modulus: 1 on a smooth table, more where the base is held.
  double stiffening(double ratio) const;
  /// For a flat sample: the edge's displacement over that at even strain, poisson * strain * radius.
  double bulging(double ratio) const;
  /// For a flat sample: mean depth of the pad times its modulus over the force, 1/mm, where the contact has
  /// widened to `spread` times the face at rest; and over the deepest.
  double mean_depth_per_force(double ratio, double spread = 1) const;
  double mean_over_deepest(double ratio) const;

 private:
  enum Column : uint8_t { kForce, kDepth, kBall };  // of a ball, logarithms, at each radius
  enum Flat : uint8_t { kDeepest, kMean, kShort, kEdge, kDeepestPower, kMeanPower };  // per force
  void tabulate_ball();
  void tabulate_flat();
  double flat(Flat what, double ratio) const;
  static constexpr size_t kRadii = 16;  // of a ball's contact in the table, even in their logarithm
  std::array<double, kRadii> ball(Column what, double log_ratio) const;
  double at(const std::array<double, kRadii>& column, double log_radius) const;

  Pad pad_;
  Sample sample_;
  std::array<std::vector<double>, 6> table_;
  double log_radius_from_ = 0, log_radius_step_ = 1;
  double ball_lack_ = 0;  // what half a ball is short of a half space, times E R / F
};

}  // namespace palpate
