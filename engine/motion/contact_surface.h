// Contact surface: a height map made ready for registration, from fine to coarse.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "engine/motion/height_map.h"
#include "engine/motion/rigid_motion.h"

namespace palpate {

struct SurfaceOptions {
  /// Pixels from the contact's border that are left out: there the skin spans from the object to the pad.
  uint32_t border_px = 4;
  uint32_t levels = 4;  ///< at most; each is half as fine as the one before
};

/// Depths smoothed by a binomial filter of five pixels, with their slopes.
class ContactSurface {
 public:
  struct Level {
    uint32_t width = 0, height = 0;
    double pitch_mm = 0;
    double left_mm = 0, top_mm = 0;                             ///< of the first pixel's centre
    std::vector<float> depth = {}, slope_x = {}, slope_y = {};  ///< mm; mm/mm
    std::vector<float> variance = {};                           ///< of depth, up to a common factor
    std::vector<uint8_t> mask = {};            ///< of each pixel: whether it is inside the contact
    std::vector<uint32_t> inside = {};         ///< those pixels, rising
    std::vector<float> column = {}, row = {};  ///< of each of those
    /// Variance of each pixel inside, -1 of others.
    std::vector<float> inside_variance = {};
  };

  ContactSurface() = default;
  /// Throws Error where sizes do not fit.
  explicit ContactSurface(const HeightMap& map, const SurfaceOptions& options = {});

  const std::vector<Level>& levels() const { return levels_; }
  /// Another of each surface that was made; copies share it.
  uint64_t id() const { return id_; }
  /// Of the finest level's pixels inside: how many, their mean place, and the RMS distance from it along the
  /// pad, times sqrt(2), which is the radius of a round contact.
  size_t count() const { return levels_.empty() ? 0 : levels_.front().inside.size(); }
  const Eigen::Vector3d& centroid_mm() const { return centroid_mm_; }
  double radius_mm() const { return radius_mm_; }
  /// Covariance of a motion by HeightMap::level_sd_mm.
  Matrix6d error_of_level() const;
  double tilt_sd_rad() const { return tilt_sd_rad_; }  ///< HeightMap::tilt_sd_rad

 private:
  void find_centroid();

  std::vector<Level> levels_;
  uint64_t id_ = 0;
  Eigen::Vector3d centroid_mm_ = Eigen::Vector3d::Zero();
  double radius_mm_ = 0, level_sd_mm_ = 0, tilt_sd_rad_ = 0;
};

}  // namespace palpate
