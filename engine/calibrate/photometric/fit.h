// From presses whose normals are known to the calibration of a colour gel sensor.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

/// Errors of one press by the fit to all the others.
struct HeldOutPress {
  std::string label;
  uint64_t contact_px = 0;
  double normal_rms = 0;        ///< RMS error of (n_x, n_y), both components together, per component
  double normal_angle_deg = 0;  ///< RMS angle between the normal read and the true one
  bool has_depth = false;       ///< only a ball has a known shape
  double depth_rmse_mm = 0;     ///< over the contact, best constant removed: the rim's own depth is not known
  double cap_rms_mm = 0;        ///< root of the mean squared height of the ball's cap above the rim
  double depth_gain = 0;        ///< measured depth over true depth, by least squares; 1 is right
};

/// How a normal is read: linear in the change of colour, or that corrected by a small table.
enum class NormalModel {
  Best,  ///< the table where it is clearly better on presses not used, else linear
  Linear,
  Table,
};

/// One model's errors on presses that it has not seen.
struct HeldOutErrors {
  double normal_rms = 0;
  double normal_angle_deg = 0;
  double depth_rmse_mm = 0;
  double cap_rms_mm = 0;  ///< of the caps; the error over it does not depend on the radius that is stated
  double depth_gain = 0;
};

struct PhotometricFitResult {
  PhotometricCalibration calibration;       ///< normal_sd is the held-out error below
  NormalModel model = NormalModel::Linear;  ///< the one in `calibration`, whose errors stand below
  HeldOutErrors linear, table;              ///< of either; table all 0 where it was not asked for
  uint64_t contact_px = 0;                  ///< pixels of known slope in all presses together
  double condition = 0;                     ///< largest over smallest singular value of the design matrix
  double ridge = 0;        ///< Tikhonov weight relative to the largest eigenvalue; 0: plain least squares
  double explained_x = 0;  ///< fraction of the contact normals' variance explained, held out, 0 to 1
  double explained_y = 0;
  double normal_rms_fitted = 0;    ///< RMS error on the presses that made the fit
  double normal_rms_held_out = 0;  ///< each press judged by the fit of the others
  double normal_angle_deg = 0;     ///< held out, RMS
  double depth_rmse_mm = 0;        ///< RMS over the balls; 0 without balls
  double cap_rms_mm = 0;           ///< RMS height of their caps
  double depth_gain = 0;           ///< mean over the balls
  std::vector<HeldOutPress> presses;
};

struct PhotometricPress;

/// Least squares fit of PhotometricCalibration: n = w(X, Y) dI with w linear in X and Y, nine numbers for n_x
/// and nine for n_y. Every press is reduced to its normal equations, so leaving one out costs a 9x9 solve.
///
/// Signs: image x right, y down, depth positive into the pad. A ball pressed at (cx, cy) is deepest there, so
/// d(depth)/dx is negative right of the centre: n_x = -(x - cx) pitch / R inside the contact.
class PhotometricFit {
 public:
  /// Format must have three channels. Throws Error(Failure::Input) otherwise, or when pitch is not positive.
  PhotometricFit(const FrameFormat& format, double pitch_mm_per_px);
  ~PhotometricFit();
  PhotometricFit(PhotometricFit&&) noexcept;
  PhotometricFit& operator=(PhotometricFit&&) noexcept;

  /// A press with known normals: height x width values each; NaN in either leaves the pixel out.
  /// Saturated or black pixels (any channel at 0 or full scale in either image) are left out, as they are no
  /// longer linear. Throws Error(Failure::Input) when shapes differ.
  void add_normals(const Frame& frame, const Frame& background, std::span<const double> normal_x,
                   std::span<const double> normal_y, const std::string& label);

  /// A ball of radius `ball_radius_mm` pressed at (cx, cy) px: sphere normals up to `contact_radius_px`;
  /// level (zero slope) beyond `kRestRing` times that radius, with at most the weight of the contact in all.
  /// The ring between is left out: there the pad bends down to the rim and its slope is not known. Throws
  /// Error(Failure::Input) when the contact is larger than the ball or mostly outside the frame.
  /// Pixels of `mask` (height x width, 1: a printed marker) are left out; it may be empty.
  void add_ball(const Frame& frame, const Frame& background, double cx_px, double cy_px,
                double contact_radius_px, double ball_radius_mm, const std::string& label,
                std::span<const uint8_t> mask = {});
  static constexpr double kRestRing = 2;

  /// Needs two presses or more. Throws Error(Failure::Input) when the colours do not determine both slopes
  /// (gray images, one light, wrong positions): when less than `kLeastExplained` of the normals' variance is
  /// explained on presses that the fit has not seen.
  /// The design is regularised, and the result says so, when its condition passes `kWorstCondition`.
  /// `rest_weight` multiplies the weight of the level parts, 0 to 1000. More of it keeps lamps that drift
  /// from tilting the picture; with noisy pixels it also flattens the contact, as `depth_gain` then shows.
  PhotometricFitResult solve(double rest_weight = 1, NormalModel model = NormalModel::Linear) const;
  static constexpr double kLeastExplained = 0.25;
  static constexpr double kWorstCondition = 3e3;

 private:
  FrameFormat format_;
  double pitch_mm_per_px_;
  std::vector<PhotometricPress> presses_;
};

/// Depth whose slopes fit best in the least-squares sense (five-point Poisson, natural boundary) over the
/// pixels where `inside` is set; rows x width values, slopes d(depth)/dx and d(depth)/dy, zero mean over each
/// connected part's pixels taken together; 0 outside. Direct sparse solve in doubles: for contact patches,
/// not for frames.
std::vector<double> integrate_patch(std::span<const double> slope_x, std::span<const double> slope_y,
                                    std::span<const uint8_t> inside, uint32_t width, double pitch_mm_per_px);

}  // namespace palpate
