// Key frame of a map: a height map with its contact, kept in little memory.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "engine/motion/height_map.h"
#include "engine/motion/rigid_motion.h"

namespace palpate {

class KeyFrame {
 public:
  KeyFrame() = default;
  /// Halves the map until it has at most `most_px` pixels (places stay). Throws Error where it is not as
  /// HeightMap says.
  KeyFrame(const HeightMap& map, uint32_t most_px);

  uint32_t width() const { return width_; }
  uint32_t height() const { return height_; }
  double pitch_mm() const { return pitch_mm_; }
  double left_mm() const { return -0.5 * (width_ - 1) * pitch_mm_; }  ///< of the first pixel's centre
  double top_mm() const { return -0.5 * (height_ - 1) * pitch_mm_; }
  /// Mean place of the contact, at its mean depth.
  const Eigen::Vector3d& middle_mm() const { return middle_mm_; }
  double radius_mm() const { return radius_mm_; }  ///< of a round contact of that area
  size_t bytes() const;

  /// Depths within kStep_mm, and ratios of their errors; HeightMap refers to it.
  struct Unpacked {
    uint32_t width = 0, height = 0;
    double pitch_mm = 0;
    std::vector<float> depth, sd;
    std::vector<uint8_t> contact;
    HeightMap map() const {
      return {.width = width,
              .height = height,
              .pitch_mm_per_px = pitch_mm,
              .depth_mm = depth,
              .sd_mm = sd,
              .contact = contact};
    }
  };
  Unpacked unpacked() const;

  /// Part of the smaller contact that both show, were this one moved onto `other` by that motion.
  double overlap(const KeyFrame& other, const RigidMotion& motion) const;
  /// Part of this contact that another frame's contact shows after that motion.
  double shown_by(const HeightMap& other, const RigidMotion& motion) const;

  static constexpr double kStep_mm = 1e-4;  ///< depths reach to 3.2 mm either way of their mean

 private:
  bool touches(double x_mm, double y_mm) const;

  uint32_t width_ = 0, height_ = 0;
  double pitch_mm_ = 0, mean_mm_ = 0, radius_mm_ = 0;
  Eigen::Vector3d middle_mm_ = Eigen::Vector3d::Zero();
  std::vector<int16_t> depth_;
  std::vector<uint8_t> sd_;               ///< 255ths of the largest; empty: alike everywhere
  std::vector<uint8_t> contact_;          ///< a bit a pixel
  std::vector<Eigen::Vector3f> samples_;  ///< places of the contact, one of some pixels
};

}  // namespace palpate
