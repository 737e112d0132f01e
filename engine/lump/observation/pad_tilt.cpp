#include "engine/lump/observation/pad_tilt.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/numbers.h"

namespace palpate::lump {
namespace {

/// How much stiffer the bonded floor makes a block of 40 x 40 mm, 16 to 24 mm thick.
constexpr double kBonded = 1.27;
/// By what share the size and place of a window change the tilt that its moments tell.
constexpr double kWindow_sd = 0.04;

/// A tilt over what the column's rise makes of it: where the tissue is pressed more it spreads, and the
/// pressure rises less than the force. Fitted to finite elements of blocks of 40 x 40 mm, 16, 20 and 24 mm
/// thick, 5 to 25 % compressed, under a window of 28 x 21 mm in their middle; beyond these it stays.
double spreading(double compression, double thickness_mm) {
  const double c = std::clamp(compression, 0.05, 0.25);
  const double t = std::clamp(thickness_mm, 16.0, 24.0) / 20 - 1;
  return 0.956 + 2.442 * c - 2.460 * c * c + (0.538 - 0.743 * c) * t;
}

}  // namespace

double compression_under(double pressure_Pa, double young_Pa) {
  const double wanted = 3 * std::max(0.0, pressure_Pa) / (kBonded * young_Pa);
  double low = 0.05, high = 1;  // of height left; 1 / h^2 - h, force over the area at rest, falls with it
  for (int k = 0; k < 60; ++k) {
    const double h = (low + high) / 2;
    (1 / (h * h) - h > wanted ? low : high) = h;
  }
  return 1 - high;
}

double rise_with_compression(double compression) {
  const double h = 1 - compression;
  return (2 / (h * h * h) + 1) / std::max(1e-9, 1 / (h * h) - h);
}

double load_share(double compression, double deeper) {
  const auto load = [](double share) {
    const double h = 1 - std::clamp(share, 0.0, 0.9);
    return 1 / (h * h) - h;
  };
  return load(compression + deeper) / std::max(1e-9, load(compression));
}

double PadTilt::size_deg() const {
  return std::hypot(x_deg, y_deg);
}

PadTilt pad_tilt(const PressureMap& map, const TissueLayer& tissue, double bump_sd) {
  double count = 0, sum = 0, first[2] = {}, second[2] = {}, middle[2] = {};
  const auto each = [&](const auto& take) {
    for (uint32_t j = 0; j < map.height; ++j)
      for (uint32_t i = 0; i < map.width; ++i)
        if (const auto p = static_cast<double>(map.at(i, j)); std::isfinite(p))
          take((i - (map.width - 1) / 2.0) * map.pitch_mm[0], (j - (map.height - 1) / 2.0) * map.pitch_mm[1],
               p);
  };
  each([&](double x, double y, double p) {
    count += 1;
    sum += p;
    middle[0] += x;
    middle[1] += y;
  });
  PadTilt tilt{kNaN, kNaN, kNaN, kNaN};
  if (count < 9 || !(sum > 0)) return tilt;
  for (double& m : middle) m /= count;
  each([&](double x, double y, double p) {
    first[0] += p * (x - middle[0]);
    first[1] += p * (y - middle[1]);
    second[0] += (x - middle[0]) * (x - middle[0]);
    second[1] += (y - middle[1]) * (y - middle[1]);
  });
  const double mean_Pa = sum / count;
  const double compression = compression_under(mean_Pa, tissue.young_Pa);
  const double degrees = 180 / std::numbers::pi * tissue.thickness_mm / rise_with_compression(compression) *
                         spreading(compression, tissue.thickness_mm);
  const double share = std::hypot(tissue.young_sd, tissue.thickness_sd, kWindow_sd);
  double* value[2] = {&tilt.x_deg, &tilt.y_deg};
  double* sd[2] = {&tilt.x_sd_deg, &tilt.y_sd_deg};
  for (int axis = 0; axis < 2; ++axis) {
    if (!(second[axis] > 0)) return {kNaN, kNaN, kNaN, kNaN};
    *value[axis] = degrees * first[axis] / mean_Pa / second[axis];
    const double edge_mm = std::sqrt(3 * second[axis] / count);
    *sd[axis] = std::hypot(share * *value[axis], degrees * bump_sd / edge_mm);
  }
  return tilt;
}

}  // namespace palpate::lump
