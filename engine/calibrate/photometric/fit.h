// From presses whose normals are known to the calibration of a colour gel sensor.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/calibrate/ball/press.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

/// Errors of one press by the fit to all the others.
struct HeldOutPress {
  std::string label;
  uint64_t contact_px = 0;
  double normal_rms = 0;        ///< RMS error of (n_x, n_y), both components together, per component
  double normal_angle_deg = 0;  ///< RMS angle between the normal read and the true one
  bool has_depth = false;       ///< only a press of a known shape has one
  double depth_rmse_mm = 0;     ///< over the contact, best constant removed: the rim's own depth is not known
  double cap_rms_mm = 0;        ///< root of the mean squared height of the ball's cap above the rim
  double depth_gain = 0;        ///< measured depth over true depth, by least squares; 1 is right
  /// Of the middle over the rim, measured depth over true depth, less 1: at the centre, or along a cylinder.
  struct Place {
    double x_px = 0, y_px = 0, middle_error = 0;
  };
  std::vector<Place> places{};
};

/// What the weights of a calibration are made of.
enum class NormalModel {
  Best,    ///< the simplest that does as well as any on presses, and balls, that were left out; of those that
           ///< have no more terms of place than there are places pressed
  Linear,  ///< colours by place to degree 1
  Quadratic,
  Cubic,
  LinearProducts,  ///< colours by place to degree 1, and their products
  QuadraticProducts,
  CubicProducts,
};

/// One model's polynomial.
struct NormalOrder {
  NormalModel model;
  const char* name;
  int colours;   ///< degree in place of the weights of red, green and blue
  int products;  ///< and of those of their products; -1: there are none
};
/// From simple to rich.
inline constexpr std::array kNormalOrders{
    NormalOrder{NormalModel::Linear, "linear", 1, -1},
    NormalOrder{NormalModel::Quadratic, "quadratic", 2, -1},
    NormalOrder{NormalModel::LinearProducts, "linear-products", 1, 1},
    NormalOrder{NormalModel::Cubic, "cubic", 3, -1},
    NormalOrder{NormalModel::QuadraticProducts, "quadratic-products", 2, 2},
    NormalOrder{NormalModel::CubicProducts, "cubic-products", 3, 3},
};

/// One model's errors on presses that it has not seen.
struct HeldOutErrors {
  double normal_rms = 0;
  double normal_angle_deg = 0;
  double depth_rmse_mm = 0;
  double cap_rms_mm = 0;  ///< of the caps; the error over it does not depend on the radius that is stated
  double depth_gain = 0;
};

/// A model that was judged.
struct NormalCandidate {
  NormalOrder order;
  HeldOutErrors press;                ///< each press left out in turn
  std::optional<HeldOutErrors> ball;  ///< all presses of each ball left out in turn, of two balls or more
};

struct PhotometricFitResult {
  PhotometricCalibration calibration;       ///< normal_sd is the held-out error below
  std::vector<NormalCandidate> candidates;  ///< all that were judged, from simple to rich
  size_t chosen = 0;                        ///< of them: in `calibration`, its errors stand below
  double followed_share = 1;                ///< of a ball's circle, up to which the slopes were fitted
  uint64_t contact_px = 0;                  ///< pixels of known slope in all presses together
  double condition = 0;    ///< largest over smallest singular value of the design matrix, its columns scaled
                           ///< to one length
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

  const NormalCandidate& model() const { return candidates[chosen]; }
};

struct PhotometricPress;

/// Least squares fit of PhotometricCalibration. Every press is reduced to sums from which the normal
/// equations of each model follow, so that leaving one out costs a solve of at most 90 unknowns.
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

  /// A press of a known shape whose contact was found: its slopes inside the contact; level (zero slope)
  /// beyond `kRestRing` times the half width, with at most the weight of the contact in all. What lies
  /// between is left out, for its slope is not known, and so are the ends of a cylinder. The pad leaves the
  /// shape gradually, so `solve` fits slopes up to 80, 90 or 100 % of the half width, by which presses left
  /// out are read neither too flat nor too deep; `kJudgedShare` of it is what they are judged on. Pixels of
  /// `mask` (height x width, 1: a printed marker) are left out; it may be empty. Throws Error(Failure::Input)
  /// when the contact is larger than the shape or mostly outside the frame.
  void add_press(const Frame& frame, const Frame& background, const FoundBall& contact,
                 const PressedShape& shape, const std::string& label, std::span<const uint8_t> mask = {});
  /// The same of a ball pressed at (cx, cy) px.
  void add_ball(const Frame& frame, const Frame& background, double cx_px, double cy_px,
                double contact_radius_px, double ball_radius_mm, const std::string& label,
                std::span<const uint8_t> mask = {});
  static constexpr double kJudgedShare = 0.8, kRestRing = 2;

  /// Standard deviation of one frame's red, green and blue, units of full scale: which part of the error is
  /// noise. Without it all of the error counts as the pad's.
  void set_frame_noise(const std::array<double, 3>& sd) { frame_noise_ = sd; }

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
  std::array<double, 3> frame_noise_{};
};

/// Depth whose slopes fit best in the least-squares sense (five-point Poisson, natural boundary) over the
/// pixels where `inside` is set; rows x width values, slopes d(depth)/dx and d(depth)/dy, zero mean over each
/// connected part's pixels taken together; 0 outside. Direct sparse solve in doubles: for contact patches,
/// not for frames.
std::vector<double> integrate_patch(std::span<const double> slope_x, std::span<const double> slope_y,
                                    std::span<const uint8_t> inside, uint32_t width, double pitch_mm_per_px);

}  // namespace palpate
