#include "engine/motion/key_memory.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "engine/numeric/dense.h"

namespace palpate {
namespace {

using Eigen::Vector3d;

/// Turns count by what they move at the contact's border.
Vector6d by_radius(double radius_mm) {
  Vector6d scale;
  scale << 1, 1, 1, radius_mm, radius_mm, radius_mm;
  return scale;
}

/// Mean square of what an error moves in the contact, mm2.
double size_of(const Matrix6d& covariance, double radius_mm) {
  return covariance.diagonal().dot(by_radius(radius_mm).cwiseAbs2());
}

/// Of a motion by a key frame whose own error is `before`, seen at found.at_mm.
Matrix6d error_by(const Matrix6d& before, const Registration& found) {
  const Matrix6d moved = carried_by(found.motion);
  return found.covariance + moved * before * moved.transpose();
}

Matrix6d error_of(const TrackKey& key, const MemoryOptions& options) {
  return key.before + key.link +
         alike_error(key.tilted, options.gain_sd, key.smoothed, options.skin_smoothing_sd_mm2);
}

}  // namespace

Matrix6d alike_error(const Vector6d& tilted, double gain_sd, const Vector6d& smoothed,
                     double smoothing_sd_mm2) {
  return gain_sd * gain_sd * tilted * tilted.transpose() +
         smoothing_sd_mm2 * smoothing_sd_mm2 * smoothed * smoothed.transpose();
}

void KeyMemory::keep(TrackKey key) {
  const size_t pixels = key.surface.levels().front().depth.size();
  keys_.push_back(std::move(key));
  if (keys_.size() <= options_.most && keys_.size() * pixels <= options_.most_pixels) return;
  size_t least = keys_.size() - 1;
  double nearest_mm = INFINITY;
  for (size_t later = 1; later < keys_.size(); ++later)
    for (size_t one = 0; one < later; ++one) {
      const double way_mm = (keys_[later].place_mm() - keys_[one].place_mm()).norm();
      if (way_mm < nearest_mm) nearest_mm = way_mm, least = later;
    }
  keys_.erase(keys_.begin() + static_cast<std::ptrdiff_t>(least));
}

std::vector<const TrackKey*> KeyMemory::candidates(const ContactSurface& now,
                                                   const TrackedMotion& tracked) const {
  constexpr size_t kMost = 2;
  constexpr double kWorth = 0.5;  // of the error's square
  const double least_cosine = std::cos(options_.most_tilt_deg * std::numbers::pi / 180);
  const double radius_mm = now.radius_mm(), own = size_of(tracked.covariance, radius_mm);
  const Vector3d place = tracked.motion.inverse() * now.centroid_mm();
  std::vector<std::pair<double, const TrackKey*>> sure;
  for (const TrackKey& key : keys_) {
    const double square = size_of(error_of(key, options_), radius_mm);
    if ((key.place_mm() - place).norm() > options_.most_way * radius_mm || square > kWorth * own) continue;
    if ((tracked.motion.turn * key.motion.turn.transpose())(2, 2) < least_cosine) continue;
    sure.emplace_back(square, &key);
  }
  std::ranges::sort(sure);
  std::vector<const TrackKey*> out;
  for (size_t k = 0; k < std::min(sure.size(), kMost); ++k) out.push_back(sure[k].second);
  return out;
}

bool KeyMemory::fits(const Registration& found, double calm_mm) const {
  return found.found && found.converged && found.freedom.unknown.cols() == 0 &&
         found.overlap >= options_.least_overlap && found.fitting >= options_.least_fitting &&
         found.disagreement <= options_.most_disagreement &&
         (calm_mm <= 0 || found.residual_mm <= options_.most_residual * calm_mm);
}

// Searches from the ends of the two longest axes of what the motion may be off by.
bool KeyMemory::other_fits(const TrackKey& key, const ContactSurface& now, const TrackedMotion& tracked,
                           const Registration& found, const RegistrationOptions& registration,
                           PixelSums& sums) const {
  constexpr double kErrors = 2.5, kNear_px = 4;  // of way; nearer ones no search tells apart
  const Vector6d scale = by_radius(now.radius_mm());
  const Matrix6d moved = seen_at(tracked.at_mm, found.at_mm);
  const Eigen::MatrixXd spread =
      scale.asDiagonal() * (moved * tracked.covariance * moved.transpose()) * scale.asDiagonal();
  const dense::SymmetricEigen axes = dense::symmetric_eigen(spread);
  for (Eigen::Index k = 0; k < 6; ++k) {
    const double way_mm = kErrors * std::sqrt(std::max(axes.values[k], 0.0));
    if (way_mm < kNear_px * now.levels().front().pitch_mm) continue;
    for (const double part : {-1.0, -0.5, 0.5, 1.0}) {
      const Vector6d twist = scale.cwiseInverse().asDiagonal() * (part * way_mm * axes.vectors.col(k));
      const Registration other = register_surface(
          key.surface, now, motion_about(found.at_mm, twist) * found.motion, registration, sums);
      if (!other.found || other.overlap < 0.7 * found.overlap) continue;
      const Vector6d apart = scale.asDiagonal() * twist_between(found.motion, other.motion, found.at_mm);
      if (apart.norm() > 2 * now.levels().front().pitch_mm &&
          other.residual_mm < options_.least_contrast * found.residual_mm)
        return true;
    }
  }
  return false;
}

std::optional<KeyMemory::Return> KeyMemory::recognise(const ContactSurface& now, const TrackedMotion& tracked,
                                                      const RegistrationOptions& registration,
                                                      PixelSums& sums) const {
  const double radius_mm = now.radius_mm(), own = size_of(tracked.covariance, radius_mm);
  for (const TrackKey* key : candidates(now, tracked)) {
    const RigidMotion start = tracked.motion * key->motion.inverse();
    const Registration found = register_surface(key->surface, now, start, registration, sums);
    if (!fits(found, std::max(tracked.residual_mm, key->residual_mm))) continue;
    if (size_of(error_by(error_of(*key, options_), found), radius_mm) >= own) continue;
    const Vector6d apart = twist_between(start, found.motion, found.at_mm);
    const Matrix6d moved = seen_at(tracked.at_mm, found.at_mm);
    const Eigen::MatrixXd spread = found.covariance + moved * tracked.covariance * moved.transpose();
    const Eigen::VectorXd errors = dense::Cholesky(spread).solve_lower(Eigen::MatrixXd(apart));
    if (!(errors.squaredNorm() <= options_.most_square)) continue;
    if (other_fits(*key, now, tracked, found, registration, sums)) continue;
    return Return{key, found};
  }
  return std::nullopt;
}

}  // namespace palpate
