// Pictures of balls, cylinders, cones and dots in a gel under three coloured lights, with the depth behind
// them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <vector>

#include "engine/calibrate/ball/press.h"
#include "palpate/frame.h"

namespace palpate::scenes {

/// One shape and its contact; beyond its rim the pad goes back as a half space does, cut off by a Gaussian as
/// by the thickness of a layer.
class PressedPlace {
 public:
  PressedPlace(const PressedShape& shape, const FoundBall& contact, double pitch_mm)
      : contact_(contact), pitch_mm_(pitch_mm) {
    const double rim_mm = contact.radius_px * pitch_mm;
    step_mm_ = rim_mm / 200;
    std::vector<double> slopes(1600);
    const auto slope = [&](double off_mm) {
      const double off_px = off_mm / pitch_mm;
      const double n = normal_at(shape, {off_px, 0, off_px}, pitch_mm)[0];
      return -n / std::sqrt(1 - n * n);
    };
    for (size_t i = 0; i < slopes.size(); ++i) {
      const double rho = static_cast<double>(i) * step_mm_ / rim_mm,
                   root = std::sqrt(std::max(0.0, rho * rho - 1));
      slopes[i] = slope(std::min(rho, 1.0) * rim_mm);
      if (rho <= 1) continue;
      const double back = shape.kind == PressedShape::Kind::Cylinder ? rho - root
                          : shape.kind == PressedShape::Kind::Cone
                              ? 1 - root / rho
                              : 2 / std::numbers::pi * (rho * std::asin(1 / rho) - root / rho);
      slopes[i] *= back * std::exp(-std::pow((rho - 1) / 1.3, 2));
    }
    depth_mm_.assign(slopes.size(), 0);
    for (size_t i = slopes.size() - 1; i-- > 0;)
      depth_mm_[i] = depth_mm_[i + 1] + (slopes[i] + slopes[i + 1]) / 2 * step_mm_;
  }

  double depth_mm(double x_px, double y_px) const {
    const double dx = x_px - contact_.center_x_px, dy = y_px - contact_.center_y_px;
    if (!(contact_.half_length_px > 0)) return across_mm(std::hypot(dx, dy));
    const double ux = std::cos(contact_.axis_rad), uy = std::sin(contact_.axis_rad);
    const double beyond =
        (std::abs(dx * ux + dy * uy) - contact_.half_length_px) / contact_.radius_px;  // the end is round
    const double share = std::clamp(0.5 - beyond, 0.0, 1.0);
    return across_mm(std::abs(dy * ux - dx * uy)) * share * share * (3 - 2 * share);
  }

 private:
  double across_mm(double off_px) const {
    const double at = off_px * pitch_mm_ / step_mm_;
    const auto i = static_cast<size_t>(at);
    if (i + 1 >= depth_mm_.size()) return 0;
    const double t = at - static_cast<double>(i);
    return depth_mm_[i] + t * (depth_mm_[i + 1] - depth_mm_[i]);
  }

  FoundBall contact_;
  double pitch_mm_, step_mm_ = 0;
  std::vector<double> depth_mm_;  // by distance from the middle
};

/// Contact at a place; with a length that of a cylinder.
inline FoundBall contact_at(double x_px, double y_px, double half_width_px, double axis_rad = 0,
                            double half_length_px = 0) {
  FoundBall contact;
  contact.center_x_px = x_px;
  contact.center_y_px = y_px;
  contact.radius_px = half_width_px;
  contact.axis_rad = axis_rad;
  contact.half_length_px = half_length_px;
  return contact;
}

/// A gel of 320 x 240 px, 8 bits, with noise of 1.5 gray.
class ShapePictures {
 public:
  static constexpr double kPitch_mm = 0.087;
  static constexpr FrameFormat kFormat{320, 240, 3, 8};

  static double depth_mm(const std::vector<PressedPlace>& places, double x_px, double y_px) {
    double depth = 0;
    for (const PressedPlace& place : places) depth += place.depth_mm(x_px, y_px);
    return depth;
  }

  Frame picture(const std::vector<PressedPlace>& places) {
    std::normal_distribution<double> noise(0, 1.5);
    Frame frame;
    frame.reshape(kFormat);
    constexpr double kStep_px = 0.05, kElevation = std::numbers::pi / 4;
    for (uint32_t y = 0; y < kFormat.height; ++y)
      for (uint32_t x = 0; x < kFormat.width; ++x) {
        const auto slope = [&](double dx, double dy) {
          return (depth_mm(places, x + dx, y + dy) - depth_mm(places, x - dx, y - dy)) /
                 (2 * kStep_px * kPitch_mm);
        };
        const double sx = slope(kStep_px, 0), sy = slope(0, kStep_px),
                     nz = 1 / std::sqrt(1 + sx * sx + sy * sy);
        for (uint32_t c = 0; c < 3; ++c) {
          const double azimuth = std::numbers::pi * (0.5 + 2.0 / 3 * c), ax = std::cos(azimuth),
                       ay = std::sin(azimuth);
          const double across = (2.0 * x + 1) / kFormat.width - 1, down = (2.0 * y + 1) / kFormat.height - 1;
          const double facing = nz * ((sx * ax + sy * ay) * std::cos(kElevation) + std::sin(kElevation));
          const double gray =
              178 * (1 + 0.05 * (across * ax + down * ay)) * std::max(0.0, facing) + noise(random_);
          frame.set(c, x, y, static_cast<uint32_t>(std::clamp(gray + 0.5, 0.0, 255.0)));
        }
      }
    return frame;
  }

  void save(const std::filesystem::path& file, const std::vector<PressedPlace>& places) {
    const Frame frame = picture(places);
    cv::Mat image(static_cast<int>(kFormat.height), static_cast<int>(kFormat.width), CV_8UC3);
    for (uint32_t y = 0; y < kFormat.height; ++y)
      for (uint32_t x = 0; x < kFormat.width; ++x)
        for (uint32_t c = 0; c < 3; ++c)
          image.at<cv::Vec3b>(static_cast<int>(y), static_cast<int>(x))[2 - static_cast<int>(c)] =
              static_cast<uint8_t>(frame.at(c, x, y));
    std::filesystem::create_directories(file.parent_path());
    cv::imwrite(file.string(), image);
  }

 private:
  std::mt19937 random_{1};
};

}  // namespace palpate::scenes
