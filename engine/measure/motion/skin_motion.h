// Motion of the skin under a contact, from its points: shift, rotation about the normal, and the fraction of
// the contact that still sticks.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "palpate/sensor.h"
#include "palpate/touch.h"

namespace palpate {

/// Tangential displacement at r of a circular contact of radius 1 that sticks within c, as a fraction of the
/// core's: what the tractions sqrt(1 - r^2) less sqrt(c^2 - r^2) do through the kernel 1/r (Cattaneo 1938,
/// Mindlin 1949; Johnson, Contact Mechanics, Eq. 3.42 and 7.27). It leaves out that u_x differs between
/// directions where Poisson's ratio is not 0. Within c it is 1; c = 0 slides, c = 1 sticks everywhere.
double cattaneo_fraction(double r, double c);

/// Where a contact is: the ellipse of its area, px.
struct ContactOutline {
  double x_px = 0, y_px = 0;
  double major_px = 0, minor_px = 0;  ///< full axes
  double angle_rad = 0;               ///< of the major axis, from +x towards +y
};

/// A point under a contact.
struct SkinSample {
  double dx, dy;  ///< from the contact's centre, px
  double mx, my;  ///< motion, px
  double rho;     ///< of the outline's radius
  double weight;
};

/// Follows the skin under one contact. While nothing touches, it learns where the points rest. Under a
/// contact the points' motions since then are fitted by shift * cattaneo_fraction + turn x place, for stick
/// shares from 0 to 1; what is returned are means and standard errors over all of them, each weighted by how
/// well it explains the points. Points that disagree with the others are left out.
///
/// A gel's outline holds the slopes around the contact too. How much of it is the contact is then learned
/// from the skin's motion, once for each contact; beyond the contact the skin's motion is tapered by exp(-pi
/// (r - a) / (2 H)), the slowest decay of shear in a layer of thickness H that is bonded at its base.
class SkinTracker {
  struct Fit;

 public:
  explicit SkinTracker(const Sensor& sensor)
      : SkinTracker(sensor.pitch_mm_per_px, sensor.signal == Signal::Either,
                    sensor.layer ? sensor.layer->thickness_mm : 0) {}
  /// `slopes_shown`: the outline is a gel's. `thickness_mm`: of the pad; 0: not known, no taper.
  explicit SkinTracker(double pitch_mm_per_px, bool slopes_shown = false, double thickness_mm = 0)
      : pitch_mm_per_px_(pitch_mm_per_px), thickness_mm_(thickness_mm), slopes_shown_(slopes_shown) {
    forget_extents();
  }

  /// The next frame does not continue the last one: motion counts from there on.
  void interrupt() { interrupted_ = true; }
  /// As new, for another contact.
  void restart();
  /// `outline` is null without contact. `sd_px`: standard error of each point. With fewer than three points
  /// under the contact only the counts are filled (Validity::NoContact); a stick share that the motion is too
  /// small to measure is BelowRange.
  SkinMotion update(const ContactOutline* outline, std::span<const SkinPoint> points,
                    std::span<const float> sd_px);

 private:
  void start_over(const ContactOutline* outline, std::span<const SkinPoint> points);
  void follow_points(const ContactOutline* outline, std::span<const SkinPoint> points,
                     std::span<const float> sd_px, SkinMotion& motion);
  void forget_extents();
  void doubt_extents();
  bool has_moved() const;
  size_t likeliest_extent() const;
  double fraction(const SkinSample& sample, double extent, double stick_share) const;
  Fit fit(double extent, double stick_share) const;
  double residual_px(const SkinSample& sample, const Fit& fit, double extent, double stick_share) const;
  void leave_out_strangers();
  void fit_motion(SkinMotion& motion);

  struct Rest {
    double x_px = 0, y_px = 0;
  };
  static constexpr size_t kExtents = 10;
  static double extent(size_t i) { return 1 - 0.05 * static_cast<double>(i); }

  double pitch_mm_per_px_;
  double thickness_mm_;
  bool slopes_shown_;
  std::array<double, kExtents> misfit_{};  // of each extent of the contact in its outline, over its frames
  double outline_radius_mm_ = 0;
  bool interrupted_ = false;
  bool onset_unseen_ = false;
  bool touching_ = false;
  std::vector<Rest> rest_;
  // Samples of the present frame; kept so that frames allocate nothing.
  std::vector<SkinSample> samples_;
  std::vector<double> residuals_, sorted_;
};

}  // namespace palpate
