#include "perf/map/relief.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "engine/numeric/catmull_rom.h"
#include "engine/numeric/dense.h"

namespace palpate::scenes {
namespace {

using Eigen::Vector3d;

constexpr double kStep_mm = 0.05, kAround_mm = 6;
constexpr double kLeft_mm = -Relief::kWidth_mm / 2 - kAround_mm,
                 kTop_mm = -Relief::kHeight_mm / 2 - kAround_mm;

/// Frames along corners at that speed, each standing for its pad's place.
std::vector<std::array<double, 2>> along(const std::vector<std::array<double, 2>>& corners, double step_mm) {
  std::vector<std::array<double, 2>> out = {corners.front()};
  for (size_t k = 1; k < corners.size(); ++k) {
    const double x = corners[k][0] - corners[k - 1][0], y = corners[k][1] - corners[k - 1][1];
    const auto steps = static_cast<int>(std::ceil(std::hypot(x, y) / step_mm));
    for (int s = 1; s <= steps; ++s)
      out.push_back({corners[k - 1][0] + x * s / steps, corners[k - 1][1] + y * s / steps});
  }
  return out;
}

/// The pad at each place, turning and tilting on the way; as at the begin at its end.
std::vector<RigidMotion> motions(const std::vector<std::array<double, 2>>& places, double turn_deg) {
  std::vector<RigidMotion> out;
  for (size_t k = 0; k < places.size(); ++k) {
    const double t = 2 * M_PI * double(k) / double(places.size() - 1);
    Vector6d twist;
    twist << 0, 0, 0.03 * std::sin(5 * t), 3 * kDegree * std::sin(3 * t), 2 * kDegree * std::sin(4 * t),
        turn_deg * kDegree * std::sin(2 * t);
    out.push_back(motion_about(Vector3d::Zero(), twist) *
                  RigidMotion{Eigen::Matrix3d::Identity(), {-places[k][0], -places[k][1], 0}});
  }
  return out;
}

/// A seam is long: between strips of 0.5 x 4 mm on both sides of a line, along both axes.
double largest_jump(const FusedMap& map, const std::vector<float>& off) {
  const auto wide = static_cast<uint32_t>(std::lround(0.5 / map.pitch_mm)), length = 8 * wide;
  double largest = 0;
  for (const bool upright : {true, false}) {
    const uint32_t across = upright ? wide : length, down = upright ? length : wide;
    const auto mean = [&](uint32_t column, uint32_t row) {
      double sum = 0;
      for (uint32_t y = 0; y < down; ++y)
        for (uint32_t x = 0; x < across; ++x) sum += double{off[size_t{row + y} * map.width + column + x]};
      return sum / static_cast<double>(size_t{across} * down);
    };
    const uint32_t right = upright ? wide : 0, below = upright ? 0 : wide;
    for (uint32_t row = 0; row + down + below <= map.height; row += wide / 2)
      for (uint32_t column = 0; column + across + right <= map.width; column += wide / 2) {
        const double jump = mean(column + right, row + below) - mean(column, row);
        if (!std::isnan(jump)) largest = std::max(largest, std::abs(jump));
      }
  }
  return largest;
}

}  // namespace

Relief::Relief(uint32_t seed, double smooth_mm) {
  width_ = static_cast<uint32_t>((kWidth_mm + 2 * kAround_mm) / kStep_mm) + 1;
  height_ = static_cast<uint32_t>((kHeight_mm + 2 * kAround_mm) / kStep_mm) + 1;
  struct Wave {
    double x, y, phase, size;
  };
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0, 2 * M_PI);
  std::vector<Wave> waves;
  for (int k = 0; k < 36; ++k) {
    const double way = any(random), length = 0.9 * std::pow(10.0, k / 35.0);
    waves.push_back({2 * M_PI / length * std::cos(way), 2 * M_PI / length * std::sin(way), any(random),
                     0.012 * std::pow(length, 0.6)});
  }
  auto table = std::make_shared<std::vector<float>>();
  for (uint32_t row = 0; row < height_; ++row)
    for (uint32_t column = 0; column < width_; ++column) {
      const double x = kLeft_mm + column * kStep_mm, y = kTop_mm + row * kStep_mm;
      double sum = 0;
      for (const Wave& w : waves) sum += w.size * std::sin(w.x * x + w.y * y + w.phase);
      if (smooth_mm > 0) sum *= 1 / (1 + std::exp(-(std::abs(x) - smooth_mm / 2) / 0.3));
      table->push_back(static_cast<float>(0.45 + sum));
    }
  table_ = table;
}

double Relief::depth_mm(double x_mm, double y_mm) const {
  const double x = std::clamp((x_mm - kLeft_mm) / kStep_mm, 1.0, width_ - 3.001),
               y = std::clamp((y_mm - kTop_mm) / kStep_mm, 1.0, height_ - 3.001);
  const auto left = static_cast<size_t>(x), top = static_cast<size_t>(y);
  const auto across = catmull_rom(x - double(left)), down = catmull_rom(y - double(top));
  double depth = 0;
  for (size_t k = 0; k < 4; ++k) {
    const float* p = table_->data() + (top + k - 1) * width_ + left - 1;
    for (size_t j = 0; j < 4; ++j) depth += down[k] * across[j] * double{p[j]};
  }
  return depth;
}

Relief Relief::smoothed(double sd_mm) const {
  std::vector<double> kernel;
  double sum = 0;
  for (int k = 0; k * kStep_mm <= 4 * sd_mm; ++k) {
    kernel.push_back(std::exp(-0.5 * std::pow(k * kStep_mm / sd_mm, 2)));
    sum += (k == 0 ? 1 : 2) * kernel.back();
  }
  auto table = std::make_shared<std::vector<float>>(*table_);
  const auto pass = [&](uint32_t lines, uint32_t length, size_t next, size_t step) {
    std::vector<float> line(length);
    for (uint32_t l = 0; l < lines; ++l) {
      for (uint32_t i = 0; i < length; ++i) line[i] = (*table)[l * next + i * step];
      for (uint32_t i = 0; i < length; ++i) {
        double value = kernel[0] * double{line[i]};
        for (uint32_t k = 1; k < kernel.size(); ++k)
          value += kernel[k] * (double{line[i < k ? 0 : i - k]} + double{line[std::min(i + k, length - 1)]});
        (*table)[l * next + i * step] = static_cast<float>(value / sum);
      }
    }
  };
  pass(height_, width_, width_, 1);
  pass(width_, height_, 1, width_);
  Relief out(*this);
  out.table_ = table;
  return out;
}

SolidObject Relief::object() const {
  return {"relief", [relief = *this](double x, double y) { return relief.depth_mm(x, y); }};
}

PadView wide_pad(bool fine) {
  return {.width = fine ? 320u : 160u,
          .height = fine ? 240u : 120u,
          .pitch_mm = fine ? 0.05 : 0.1,
          .skin_px = fine ? 3.0 : 1.5,
          .radius_mm = 100};
}

std::vector<RigidMotion> raster_path(double speed_mm_s) {
  return motions(
      along({{-22, -4}, {22, -4}, {22, 0}, {-22, 0}, {-22, 4}, {22, 4}, {22, 0}, {-22, -4}}, speed_mm_s / 60),
      8);
}

std::vector<RigidMotion> free_path(double speed_mm_s) {
  std::vector<std::array<double, 2>> curve;
  for (int k = 0; k <= 400; ++k) {
    const double t = 2 * M_PI * k / 400;
    curve.push_back(
        {-22 * std::cos(2 * t) + 2 * std::sin(7 * t), 3.5 * std::sin(3 * t) + 1.2 * std::sin(8 * t)});
  }
  return motions(along(curve, speed_mm_s / 60), 25);
}

std::vector<RigidMotion> straight_path(double speed_mm_s) {
  return motions(along({{-22, 0}, {22, 0}}, speed_mm_s / 60), 8);
}

MapErrors errors_of(const FusedMap& map, const Relief& relief, double skin_mm, const RigidMotion& first) {
  const Relief shown = relief.smoothed(skin_mm);
  RigidMotion to_relief = first.inverse();
  const auto miss = [&](const Relief& of, uint32_t column, uint32_t row) {
    const Vector3d p =
        to_relief * Vector3d(map.left_mm + column * map.pitch_mm, map.top_mm + row * map.pitch_mm,
                             double{map.height_mm[size_t{row} * map.width + column]});
    return std::pair{p[2] - of.depth_mm(p[0], p[1]), p};
  };
  for (int step = 0; step < 8; ++step) {
    Matrix6d square = Matrix6d::Zero();
    Vector6d right = Vector6d::Zero();
    for (uint32_t row = 0; row < map.height; row += 3)
      for (uint32_t column = 0; column < map.width; column += 3) {
        if (std::isnan(map.height_mm[size_t{row} * map.width + column])) continue;
        const auto [off, p] = miss(shown, column, row);
        constexpr double kHalf = 0.02;
        const Vector3d normal(
            (shown.depth_mm(p[0] - kHalf, p[1]) - shown.depth_mm(p[0] + kHalf, p[1])) / (2 * kHalf),
            (shown.depth_mm(p[0], p[1] - kHalf) - shown.depth_mm(p[0], p[1] + kHalf)) / (2 * kHalf), 1);
        Vector6d line;
        line << normal, cross(p) * normal;
        square += line * line.transpose();
        right -= line * off;
      }
    to_relief =
        motion_about(Vector3d::Zero(), dense::solve_lu(Eigen::MatrixXd(square), Eigen::VectorXd(right))) *
        to_relief;
  }
  MapErrors out;
  double seen = 0, held = 0;
  std::vector<float> off(map.height_mm.size(), NAN);
  for (uint32_t row = 0; row < map.height; ++row)
    for (uint32_t column = 0; column < map.width; ++column) {
      const size_t at = size_t{row} * map.width + column;
      if (std::isnan(map.height_mm[at])) continue;
      const auto [error, p] = miss(shown, column, row);
      const double from_relief = miss(relief, column, row).first, stated = double{map.error_mm[at]};
      off[at] = static_cast<float>(error);
      out.rms_mm += error * error;
      out.relief_rms_mm += from_relief * from_relief;
      out.stated_mm += stated * stated;
      held += std::abs(error) < 1.96 * stated ? 1 : 0;
      if (std::abs(p[0]) < 29 && std::abs(p[1]) < 9) out.covered += map.pitch_mm * map.pitch_mm / (58 * 18);
      ++seen;
    }
  out.rms_mm = std::sqrt(out.rms_mm / seen);
  out.relief_rms_mm = std::sqrt(out.relief_rms_mm / seen);
  out.stated_mm = std::sqrt(out.stated_mm / seen);
  out.held = held / seen;
  out.seam_mm = largest_jump(map, off);
  return out;
}

}  // namespace palpate::scenes
