// Pad and sample between two rigid plates by finite elements on both sides: what a press really does, to
// judge estimates of a modulus by. Finer grids than engine/elasticity/modulus/press_model.h has, a pad of
// finite elements and finite width, a ball of finite elements; small strains, frictionless. A flat face
// presses the pad where it has come to: the pad's elements are laid out anew for the widened face. Lengths in
// mm, forces in N, moduli in MPa.
#pragma once

#include <vector>

#include "engine/elasticity/modulus/press_model.h"

namespace palpate {

/// One press, as the pad's skin has it.
struct TruePress {
  double force_N = 0;
  double approach_mm = 0;            ///< of pad's base and table
  double mean_depth_mm = 0;          ///< of the pad, over the contact
  double depth_mm = 0;               ///< at its deepest
  double strain = 0;                 ///< of a flat sample: mean shortening over height
  std::vector<double> r_mm;          ///< where the sample's face has come to, from the axis out
  std::vector<double> pressure_MPa;  ///< there; 0 beyond the last
  bool converged = false;

  double pressure_at_MPa(double r) const;
};

class PressTruth {
 public:
  /// `nodes`: on the face, 20 to 300; the answer changes with it by less than 0.2 % from 60 on. A cube is the
  /// cylinder of the same face. The elements take a Poisson's ratio of 0.4999 for 0.5. Throws as check().
  PressTruth(const Pad& pad, const Sample& sample, int nodes = 80);

  TruePress press(double force_N, double young_MPa, double pad_MPa) const;

 private:
  Pad body_;
  Sample sample_;
  int nodes_;
  FaceCompliance own_, pad_;
  std::vector<double> gap_mm_;
};

}  // namespace palpate
