// From presses of a known ball to the table of a gray gel (SurfaceReading::Lookup): filtered change to depth.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

/// The change that SurfaceReading::Lookup goes by, gray levels, height x width: by `signal`, 5 x 5 binomial
/// filter, exactly what the contact stage keeps for 8 bits. One channel.
std::vector<double> filtered_change(const Frame& frame, const Frame& background, Signal signal);

struct HeldOutLookup {
  std::string label;
  uint64_t contact_px = 0;
  double depth_rmse_mm = 0;
  double depth_error_mm = 0;  ///< mean: read less true
  double largest_depth_mm = 0;
  double cap_rms_mm = 0;  ///< root of the mean squared height of the ball's cap above the rim
};

struct LookupFitResult {
  LookupCalibration calibration;  ///< depth_sd_mm is the held-out error below
  double depth_rmse_mm = 0;       ///< held out, all pixels together
  double cap_rms_mm = 0;          ///< of the caps, all pixels together
  bool by_press = false;          ///< held out press by press; false: one press, its sectors by turns
  std::vector<HeldOutLookup> presses;
};

/// Monotone fit of depth on change. Depth 0 is the rim of the contact, where the change begins.
class LookupFit {
 public:
  explicit LookupFit(double pitch_mm_per_px);
  /// A ball pressed at (cx, cy) px. Pixels of `mask` (1: leave out; may be empty) and saturated or black ones
  /// are left out. Throws Error(Failure::Input) when the contact is larger than the ball.
  void add_ball(const Frame& frame, const Frame& background, Signal signal, double cx_px, double cy_px,
                double contact_radius_px, double ball_radius_mm, const std::string& label,
                std::span<const uint8_t> mask = {});
  /// Throws Error(Failure::Input) without presses, or where the change does not distinguish depths.
  LookupFitResult solve() const;

 private:
  struct Sample {
    double gray, depth_mm;
    uint32_t group;  ///< of those that are held out by turns
  };
  struct Press {
    std::string label;
    std::vector<Sample> samples;
  };
  std::vector<std::array<double, 2>> table(const std::vector<Sample>& samples) const;

  double pitch_mm_per_px_;
  std::vector<Press> presses_;
};

}  // namespace palpate
