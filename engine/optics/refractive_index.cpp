#include "engine/optics/refractive_index.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "palpate/error.h"

namespace palpate::optics {
namespace {

void check(const MeasuredLength& length, const char* name) {
  if (!(length.mm > 0) || !std::isfinite(length.mm))
    throw Error(Failure::Input, std::string(name) + " > 0 mm", std::to_string(length.mm),
                "the distance between the two points");
  if (!(length.sd_mm >= 0) || !std::isfinite(length.sd_mm))
    throw Error(Failure::Input, "an uncertainty of " + std::string(name) + " >= 0 mm",
                std::to_string(length.sd_mm), "half the ruler's division");
}

}  // namespace

MeasuredIndex index_from_spots(const LaserSpots& spots) {
  check(spots.od, "OD");
  check(spots.on, "ON");
  check(spots.m1m2, "M1M2");
  check(spots.nm2, "NM2");
  if (!(spots.n_air >= 1 && spots.n_air < 2) || !(spots.n_air_sd >= 0))
    throw Error(Failure::Input, "an index of air from 1 to 2 with an uncertainty >= 0",
                std::to_string(spots.n_air) + " +- " + std::to_string(spots.n_air_sd), "1.000271");
  if (spots.m1m2.mm >= spots.nm2.mm)
    throw Error(
        Failure::Input, "the spot M1 between N and M2 (M1M2 < NM2)",
        "M1M2 = " + std::to_string(spots.m1m2.mm) + " mm, NM2 = " + std::to_string(spots.nm2.mm) + " mm",
        "the spots the other way round: M2 comes from the liquid's surface, N from the bare glass");
  MeasuredIndex m;
  const double u = spots.od.mm / spots.on.mm, w = spots.m1m2.mm / spots.nm2.mm;
  m.incidence_rad = std::atan(u);
  m.refraction_rad = std::atan(w * u);
  m.index = spots.n_air * std::sin(m.incidence_rad) / std::sin(m.refraction_rad);
  // d ln sin(atan(u)) = cos^2(atan(u)) d ln u
  const double cos2_in = 1 / (1 + u * u), cos2_out = 1 / (1 + w * w * u * u);
  const auto part = [&](double slope, const MeasuredLength& length) {
    return m.index * std::abs(slope) * length.sd_mm / length.mm;
  };
  m.sd_od = part(cos2_in - cos2_out, spots.od);
  m.sd_on = part(cos2_in - cos2_out, spots.on);
  m.sd_m1m2 = part(cos2_out, spots.m1m2);
  m.sd_nm2 = part(cos2_out, spots.nm2);
  m.sd_air = m.index * spots.n_air_sd / spots.n_air;
  m.standard_error = std::sqrt(m.sd_od * m.sd_od + m.sd_on * m.sd_on + m.sd_m1m2 * m.sd_m1m2 +
                               m.sd_nm2 * m.sd_nm2 + m.sd_air * m.sd_air);
  return m;
}

CombinedIndex combine(std::span<const MeasuredIndex> parts) {
  if (parts.empty())
    throw Error(Failure::Input, "at least one measurement", "none", "the four lengths of one");
  const double n = static_cast<double>(parts.size());
  const auto known =
      std::count_if(parts.begin(), parts.end(), [](const MeasuredIndex& m) { return m.standard_error > 0; });
  if (known != 0 && known != std::ssize(parts))
    throw Error(Failure::Input, "uncertainties of all measurements or of none",
                std::to_string(known) + " of " + std::to_string(parts.size()), "--sd-mm for each");
  double weights = 0, sum = 0;
  for (const MeasuredIndex& m : parts) {
    const double weight = known ? 1 / (m.standard_error * m.standard_error) : 1;
    weights += weight;
    sum += weight * m.index;
  }
  CombinedIndex c;
  c.index = sum / weights;
  double scatter = 0;  // weighted squares about the mean
  for (const MeasuredIndex& m : parts) {
    const double off = m.index - c.index;
    scatter += off * off * (known ? 1 / (m.standard_error * m.standard_error) : 1);
  }
  if (!known) {
    c.standard_error = n > 1 ? std::sqrt(scatter / (n - 1) / n) : 0;
    return c;
  }
  c.chi_square = scatter;
  c.widened = n > 1 && scatter > n - 1;
  c.standard_error = std::sqrt((c.widened ? scatter / (n - 1) : 1) / weights);
  return c;
}

}  // namespace palpate::optics
