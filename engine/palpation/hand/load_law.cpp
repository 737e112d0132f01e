#include "engine/palpation/hand/load_law.h"

#include <Eigen/Core>
#include <cmath>
#include <utility>

#include "engine/base/numbers.h"
#include "engine/lump/observation/map_at_load.h"
#include "engine/lump/observation/pad_tilt.h"
#include "engine/numeric/dense.h"
#include "engine/tissue/map_sampling.h"

namespace palpate {
namespace {

/// Standard errors of a value, as a share for a force e times higher, by finite elements of a ball of 12 mm,
/// 3 mm deep, four times stiffer: of a place that the slide's beginning showed, beside it, and where there is
/// none.
constexpr double kSeen = 0.005, kBeside = 0.02, kUnseen = 0.09;

/// By how much a place's pressure changes otherwise than its mean law: as the slide's beginning showed it; a
/// plane through that beside it, since a tilt is what changes it most.
class Otherwise {
 public:
  explicit Otherwise(PressureMap ratio) : ratio_(std::move(ratio)) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() * 1e-9;
    Eigen::Vector3d right(1e-9, 0, 0);
    for (uint32_t j = 0; j < ratio_.height; ++j)
      for (uint32_t i = 0; i < ratio_.width; ++i) {
        const auto value = static_cast<double>(ratio_.at(i, j));
        if (!std::isfinite(value)) continue;
        const Eigen::Vector3d row(1, (i - (ratio_.width - 1) / 2.0) * ratio_.pitch_mm[0],
                                  (j - (ratio_.height - 1) / 2.0) * ratio_.pitch_mm[1]);
        normal += row * row.transpose();
        right += value * row;
      }
    plane_ = dense::inverse(normal) * right;
  }
  double at(double x_mm, double y_mm, bool& seen) const {
    seen = std::abs(x_mm) <= ratio_.pitch_mm[0] * (ratio_.width - 1) / 2 &&
           std::abs(y_mm) <= ratio_.pitch_mm[1] * (ratio_.height - 1) / 2;
    const double value = seen ? map_at(ratio_, x_mm, y_mm) : kNaN;
    seen = std::isfinite(value);
    return seen ? value : plane_[0] + plane_[1] * x_mm + plane_[2] * y_mm;
  }

 private:
  PressureMap ratio_;
  Eigen::Vector3d plane_;
};

}  // namespace

SlideWay SlideWay::then(const SlideWay& next) const {
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  return {
      {at_mm[0] + c * next.at_mm[0] - s * next.at_mm[1], at_mm[1] + s * next.at_mm[0] + c * next.at_mm[1]},
      turn_rad + next.turn_rad};
}

LoadLaw::LoadLaw(std::optional<lump::Observation> began, const std::array<double, 3>& block_mm,
                 double young_Pa)
    : began_(std::move(began)), block_mm_(block_mm), young_Pa_(young_Pa) {}

double LoadLaw::compression(double force_N) const {
  return lump::compression_under(1e6 * force_N / (block_mm_[0] * block_mm_[1]), young_Pa_);
}

double LoadLaw::wider(double force_N, double than_N) const {
  return std::sqrt((1 - compression(than_N)) / (1 - compression(force_N)));
}

PressureMap LoadLaw::change(const PressureMap& seen, double from_N, double to_N, const SlideWay& way,
                            double& error_Pa) const {
  const double mean_law = to_N / from_N * std::pow(wider(from_N, to_N), 2);
  std::optional<Otherwise> other;
  if (began_) {
    PressureMap ratio = lump::map_at_load(*began_, to_N);
    const PressureMap from = lump::map_at_load(*began_, from_N);
    for (size_t i = 0; i < ratio.values.size(); ++i)
      ratio.values[i] /= from.values[i] * static_cast<float>(mean_law);
    other.emplace(std::move(ratio));
  }
  PressureMap out = seen;
  double pressure = 0, nodes = 0, known = 0;
  const double c = std::cos(way.turn_rad), s = std::sin(way.turn_rad);
  for (uint32_t j = 0; j < seen.height; ++j)
    for (uint32_t i = 0; i < seen.width; ++i) {
      const double u = (i - (seen.width - 1) / 2.0) * seen.pitch_mm[0],
                   v = (j - (seen.height - 1) / 2.0) * seen.pitch_mm[1];
      bool there = false;
      const double share =
          other ? other->at(way.at_mm[0] + c * u - s * v, way.at_mm[1] + s * u + c * v, there) : 1;
      float& value = out.values[size_t{j} * seen.width + i];
      value *= static_cast<float>(mean_law * share);
      if (!std::isfinite(value)) continue;
      pressure += static_cast<double>(value);
      ++nodes;
      known += there;
    }
  const double beside = other ? kBeside : kUnseen;
  error_Pa = 0;
  if (nodes > 0)
    error_Pa = std::abs(std::log(to_N / from_N)) * pressure / nodes *
               std::sqrt((known * kSeen * kSeen + (nodes - known) * beside * beside) / nodes);
  return out;
}

}  // namespace palpate
