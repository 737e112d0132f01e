// Two pads that hold one object: what both together say of it, in the gripper's frame. Plain functions on the
// processor.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "palpate/touch.h"

namespace palpate {

using Vector3 = std::array<double, 3>;
inline double scalar_product(const Vector3& a, const Vector3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// A pad in the gripper's frame. Its own axes: x to the right and y downwards in its picture, z into the pad.
struct PadPose {
  std::array<Vector3, 3> rotation{};  ///< rows; a vector of the pad's axes times it is one of the gripper's
  Vector3 translation_mm{};           ///< middle of the pad's face at rest, at opening 0
};

struct GripGeometry {
  std::array<PadPose, 2> pads;  ///< left, right
  Vector3 closing = {1, 0, 0};  ///< way of the left pad when the gripper closes; unit length
};

/// Why there is a stiffness or none.
enum class StiffnessState : uint8_t {
  Known,
  ForceInDoubt,     ///< known by forces of which their calibration says that they are not fit for use
  NotGripped,       ///< not both pads touch
  NoThickness,      ///< the opening or an indentation is not known
  NotIdentifiable,  ///< the object gave way by too little, or the frames are too few, for the errors stated
};
const char* to_string(StiffnessState state);

/// What two pads hold. Standard errors: those of the two fingers, which calibrate apart, are independent. A
/// number of which one part is not valid has the state of that part, the left finger's first.
struct Grip {
  Estimate force_N;                       ///< mean of both normal forces
  Estimate imbalance_N;                   ///< normal force of the right pad less that of the left
  Estimate load_x_N, load_y_N, load_z_N;  ///< tangential force of the object on both pads, gripper's axes
  Estimate turn_rad;  ///< of the object about the closing direction since onset, right-handed, by the skin of
                      ///< both pads or of the one that is followed
  Slip slip = Slip::NoContact;  ///< the worse of both
  Estimate thickness_mm;        ///< opening and both indentations
  Estimate stiffness_N_per_mm;  ///< force over thickness lost, since both pads touch
  StiffnessState stiffness = StiffnessState::NotGripped;
};

/// Line of force over thickness of one grip, in constant memory. Its scatter says how well the line is known;
/// the stated errors of force and thickness are taken as common to all frames, as those of a calibration are.
class StiffnessFit {
 public:
  static constexpr uint64_t kFewest = 8;           ///< frames
  static constexpr double kLargestRelative = 0.3;  ///< standard error over value that is still a stiffness

  /// A frame; a thickness that is not valid and a force without a number are left out.
  void add(const Estimate& force_N, const Estimate& thickness_mm);
  /// N/mm; valid or not calibrated: not identifiable.
  Estimate stiffness_N_per_mm() const;

 private:
  uint64_t frames_ = 0;
  // Sums about the means, so that a long grip loses no digits.
  double mean_force_ = 0, mean_thickness_ = 0, force_squares_ = 0, thickness_squares_ = 0, products_ = 0;
  double force_variances_ = 0, thickness_variances_ = 0;
  double thinnest_mm_ = 0, thickest_mm_ = 0, hardest_N_ = 0;
  double relative_force_ = 0;  ///< error of the hardest force
  double thickness_sd_mm_ = 0;
};

/// Follows one pair of pads from pair to pair.
class GripMeter {
 public:
  explicit GripMeter(const GripGeometry& geometry) : geometry_(geometry) {}
  /// `opening_mm`: way between the two faces at rest, beyond that of the poses; with its standard error; not
  /// valid: not known.
  Grip add(const Touch& left, const Touch& right, const Estimate& opening_mm);

 private:
  GripGeometry geometry_;
  StiffnessFit fit_, doubted_;        ///< of valid forces, and of all that have a number
  Validity doubt_ = Validity::Valid;  ///< why the newest of the others are not valid
};

}  // namespace palpate
