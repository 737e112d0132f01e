#include "engine/measure/motion/skin_motion.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace palpate {
namespace {

constexpr int kFractions = 21;           // stick shares that are tried, 0 to 1
constexpr double kPointFloor_px = 0.03;  // no point is better than this: pattern and light differ a little
constexpr double kFitFloor_px = 0.02;
constexpr double kModelError = 0.02;  // of a turn: a window's mean stands for its middle
constexpr double kShareTold = 0.2;    // standard error of a stick share that says anything (of 0.29 at most)

// Displacement under the traction sqrt(a^2 - r^2), up to a factor.
double hertzian(double r, double a) {
  if (r <= a) return std::numbers::pi / 2 * (2 * a * a - r * r);
  return (2 * a * a - r * r) * std::asin(a / r) + a * std::sqrt(r * r - a * a);
}

}  // namespace

double cattaneo_fraction(double r, double c) {
  if (c > 0.9999) return r <= 1 ? 1 : 2 / std::numbers::pi * std::asin(1 / r);
  if (r <= c) return 1;
  return (hertzian(r, 1) - (c > 0 ? hertzian(r, c) : 0)) / (std::numbers::pi * (1 - c * c));
}

struct SkinTracker::Fit {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();  // shift x, y in px, turn in rad
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
  double chi2 = 0;
};

void SkinTracker::restart() {
  interrupted_ = onset_unseen_ = touching_ = false;
  rest_.clear();
  forget_extents();
}

// Before anything has moved a gel's contact is taken for about three quarters of its outline.
void SkinTracker::forget_extents() {
  constexpr double kMean = 0.75, kSpread = 0.1;
  for (size_t i = 0; i < kExtents; ++i) misfit_[i] = std::pow((extent(i) - kMean) / kSpread, 2);
}

// The next contact may be another object's: what the last one showed counts as little more than a guess.
void SkinTracker::doubt_extents() {
  constexpr double kGuess = 4;
  const double least = misfit_[likeliest_extent()];
  for (double& misfit : misfit_) misfit = std::min(misfit - least, kGuess);
}

// By twice the error of the points: what rests says nothing of the contact's extent.
bool SkinTracker::has_moved() const {
  double squares = 0;
  for (const SkinSample& s : samples_) squares += s.weight * (s.mx * s.mx + s.my * s.my);
  return squares > 8 * static_cast<double>(samples_.size());
}

size_t SkinTracker::likeliest_extent() const {
  return slopes_shown_ ? std::ranges::min_element(misfit_) - misfit_.begin() : 0;
}

double SkinTracker::fraction(const SkinSample& s, double extent, double stick_share) const {
  const double r = s.rho / extent, still = cattaneo_fraction(r, stick_share);
  if (r <= 1 || thickness_mm_ <= 0) return still;
  return still * std::exp(-std::numbers::pi * (s.rho - extent) * outline_radius_mm_ / (2 * thickness_mm_));
}

SkinTracker::Fit SkinTracker::fit(double extent, double stick_share) const {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double squares = 0;
  for (const SkinSample& s : samples_) {
    const double f = fraction(s, extent, stick_share);
    const Eigen::Vector3d x(f, 0, -s.dy), y(0, f, s.dx);
    normal += s.weight * (x * x.transpose() + y * y.transpose());
    right += s.weight * (x * s.mx + y * s.my);
    squares += s.weight * (s.mx * s.mx + s.my * s.my);
  }
  Fit result;
  // A turn has no meaning where all points lie at the centre.
  normal += 1e-9 * normal.trace() * Eigen::Matrix3d::Identity();
  result.inverse = normal.inverse();
  result.value = result.inverse * right;
  result.chi2 = std::max(0.0, squares - result.value.dot(right));
  return result;
}

double SkinTracker::residual_px(const SkinSample& s, const Fit& f, double extent, double stick_share) const {
  const double share = fraction(s, extent, stick_share);
  return std::hypot(s.mx - share * f.value[0] + s.dy * f.value[2],
                    s.my - share * f.value[1] - s.dx * f.value[2]);
}

void SkinTracker::leave_out_strangers() {
  const double likeliest = extent(likeliest_extent());
  Fit best;
  double fraction = 0;
  for (int k = 0; k < kFractions; k += 4) {
    const double c = static_cast<double>(k) / (kFractions - 1);
    const Fit f = fit(likeliest, c);
    if (k == 0 || f.chi2 < best.chi2) best = f, fraction = c;
  }
  residuals_.clear();
  for (const SkinSample& s : samples_) residuals_.push_back(residual_px(s, best, likeliest, fraction));
  sorted_ = residuals_;
  std::nth_element(sorted_.begin(), sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2),
                   sorted_.end());
  const double most_px = 0.15 + 4 * sorted_[sorted_.size() / 2];
  size_t kept = 0;
  for (size_t i = 0; i < samples_.size(); ++i)
    if (residuals_[i] <= most_px) samples_[kept++] = samples_[i];
  samples_.resize(kept);
}

// After an interruption points rest where they are.
void SkinTracker::start_over(const ContactOutline* outline, std::span<const SkinPoint> points) {
  touching_ = false;
  onset_unseen_ = outline != nullptr;
  if (!outline) return;
  for (size_t i = 0; i < points.size(); ++i)
    if (points[i].correlation > 0) rest_[i] = {double{points[i].shift_x_px}, double{points[i].shift_y_px}};
}

// Without contact the points' rest follows them; with one, those under it become samples.
void SkinTracker::follow_points(const ContactOutline* outline, std::span<const SkinPoint> points,
                                std::span<const float> sd_px, SkinMotion& motion) {
  samples_.clear();
  for (size_t i = 0; i < points.size(); ++i) {
    const SkinPoint& p = points[i];
    if (!(p.correlation > 0)) {
      ++motion.lost;
      continue;
    }
    ++motion.points;
    if (!outline) {
      constexpr double kNews = 0.25;
      rest_[i].x_px += kNews * (double{p.shift_x_px} - rest_[i].x_px);
      rest_[i].y_px += kNews * (double{p.shift_y_px} - rest_[i].y_px);
      continue;
    }
    const double dx = double{p.rest_x_px} + double{p.shift_x_px} - outline->x_px,
                 dy = double{p.rest_y_px} + double{p.shift_y_px} - outline->y_px;
    const double c = std::cos(outline->angle_rad), s = std::sin(outline->angle_rad);
    const double rho = std::hypot((c * dx + s * dy) / std::max(outline->major_px / 2, 0.5),
                                  (c * dy - s * dx) / std::max(outline->minor_px / 2, 0.5));
    if (rho > 1) continue;
    const double sd = std::hypot(double{sd_px[i]}, kPointFloor_px);
    samples_.push_back({dx, dy, double{p.shift_x_px} - rest_[i].x_px, double{p.shift_y_px} - rest_[i].y_px,
                        rho, 1 / (sd * sd)});
  }
}

// Means over all stick shares and extents, each weighed by how well it fits.
void SkinTracker::fit_motion(SkinMotion& motion) {
  std::array<std::array<Fit, kFractions>, kExtents> fits;
  // Extents that earlier frames have ruled out are not tried.
  constexpr double kRuledOut = 12;
  const double least_misfit = misfit_[likeliest_extent()];
  std::array<bool, kExtents> tried{};
  tried[likeliest_extent()] = true;
  for (size_t e = 0; slopes_shown_ && has_moved() && e < kExtents; ++e)
    tried[e] = misfit_[e] - least_misfit < kRuledOut;
  double least = -1;
  std::array<double, kExtents> best{};
  for (size_t e = 0; e < kExtents; ++e) {
    if (!tried[e]) continue;
    for (int k = 0; k < kFractions; ++k) {
      fits[e][k] = fit(extent(e), static_cast<double>(k) / (kFractions - 1));
      if (k == 0 || fits[e][k].chi2 < best[e]) best[e] = fits[e][k].chi2;
    }
    if (least < 0 || best[e] < least) least = best[e];
  }
  // The points' own scatter about the best fit is the noise, where it is larger than theirs.
  const double freedom = std::max(1.0, 2 * static_cast<double>(samples_.size()) - 4);
  const double noise2 = std::max(least / freedom, 1.0);
  double weights = 0, fraction = 0, share2 = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), square = Eigen::Vector3d::Zero();
  for (size_t e = 0; e < kExtents; ++e) {
    if (!tried[e]) continue;
    const double before = slopes_shown_ ? misfit_[e] - least_misfit : 0;
    for (int k = 0; k < kFractions; ++k) {
      const Fit& f = fits[e][k];
      const double c = static_cast<double>(k) / (kFractions - 1),
                   w = std::exp(-((f.chi2 - least) / noise2 + before) / 2);
      weights += w;
      fraction += w * c;
      share2 += w * c * c;
      mean += w * f.value;
      square += w * (f.value.cwiseAbs2() + noise2 * f.inverse.diagonal());
    }
    // Errors of the model are the same from frame to frame: each frame counts a tenth.
    misfit_[e] += 0.1 * (best[e] - least) / noise2;
  }
  fraction /= weights;
  mean /= weights;
  const Eigen::Vector3d variance = (square / weights - mean.cwiseAbs2()).cwiseMax(0);
  const Validity validity = onset_unseen_ ? Validity::OnsetUnseen : Validity::Valid;
  const auto length = [&](int k) {
    return Estimate{mean[k] * pitch_mm_per_px_,
                    std::hypot(std::sqrt(variance[k]), kFitFloor_px) * pitch_mm_per_px_, validity};
  };
  motion.shift_x_mm = length(0);
  motion.shift_y_mm = length(1);
  motion.torsion_rad = {mean[2], std::hypot(std::sqrt(variance[2]), kModelError * mean[2]), validity};
  constexpr double kStep2 = 1.0 / (12.0 * (kFractions - 1) * (kFractions - 1));
  const double share_sd = std::sqrt(std::max(0.0, share2 / weights - fraction * fraction) + kStep2);
  motion.stick_share = {fraction, share_sd, share_sd > kShareTold ? Validity::BelowRange : validity};
}

SkinMotion SkinTracker::update(const ContactOutline* outline, std::span<const SkinPoint> points,
                               std::span<const float> sd_px) {
  SkinMotion motion;
  if (rest_.size() != points.size()) {
    rest_.assign(points.size(), {});
    samples_.reserve(points.size());
    residuals_.reserve(points.size());
    sorted_.reserve(points.size());
  }
  if (outline && !touching_) doubt_extents();
  if (std::exchange(interrupted_, false)) start_over(outline, points);
  follow_points(outline, points, sd_px, motion);
  touching_ = outline != nullptr;
  if (!outline) onset_unseen_ = false;
  if (outline) outline_radius_mm_ = std::sqrt(outline->major_px * outline->minor_px) / 2 * pitch_mm_per_px_;
  if (outline && samples_.size() >= 6) leave_out_strangers();
  motion.touching = static_cast<uint32_t>(samples_.size());
  if (samples_.size() < 3) {
    for (Estimate* e : {&motion.shift_x_mm, &motion.shift_y_mm, &motion.torsion_rad, &motion.stick_share})
      e->validity = Validity::NoContact;
    return motion;
  }
  fit_motion(motion);
  return motion;
}

}  // namespace palpate
