#include "engine/lump/observation/observation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/statistics.h"

namespace palpate::lump {

std::vector<double> loads_of(const Observation& o) {
  std::vector<double> loads;
  for (const double force_N : o.force_N)
    loads.push_back(force_N / (o.block_mm[0] * o.block_mm[1] * 1e-6 * o.young_Pa));
  return loads;
}

double roughness(const PressureMap& map) {
  std::vector<double> sizes;
  for (uint32_t y = 1; y + 1 < map.height; ++y)
    for (uint32_t x = 1; x + 1 < map.width; ++x) {
      constexpr std::array<double, 3> kSecond = {1, -2, 1};
      double sum = 0;
      for (uint32_t b = 0; b < 3; ++b)
        for (uint32_t a = 0; a < 3; ++a)
          sum += kSecond[a] * kSecond[b] * static_cast<double>(map.at(x + a - 1, y + b - 1));
      if (std::isfinite(sum)) sizes.push_back(std::abs(sum));
    }
  // Median of a normal variable's size; root of the squares' sum, 36.
  return sizes.empty() ? 0 : median(std::move(sizes)) / (0.6745 * 6);
}

const char* to_string(Status verdict) {
  switch (verdict) {
    case Status::Found:
      return "found";
    case Status::StiffnessOpen:
      return "stiffness open";
    case Status::NoLump:
      return "no lump";
    case Status::OutsideTraining:
      return "outside training";
    case Status::SeveralLumps:
      return "several lumps";
    case Status::NotSeparable:
      return "not separable";
    case Status::Saturated:
      return "saturated";
    case Status::Inconsistent:
      return "inconsistent";
    case Status::Unusable:
      return "unusable";
  }
  return "";
}

const char* status_text(Status verdict) {
  switch (verdict) {
    case Status::Found:
      return "a lump";
    case Status::StiffnessOpen:
      return "a lump whose stiffness cannot be determined";
    case Status::NoLump:
      return "no lump";
    case Status::OutsideTraining:
      return "unlike what the model was made for: no numbers";
    case Status::SeveralLumps:
      return "more than one lump: no numbers of one alone";
    case Status::NotSeparable:
      return "two lumps behind one bump, not told apart: no numbers";
    case Status::Saturated:
      return "saturated where the pressure is highest: no numbers";
    case Status::Inconsistent:
      return "the observation contradicts itself: no numbers";
    case Status::Unusable:
      return "not usable";
  }
  return "";
}

void widen(Value& value, const Value& other) {
  value.low = std::min(value.low, other.low);
  value.high = std::max(value.high, other.high);
}

void open_wide_ratio(Estimate& estimate) {
  const Value& ratio = estimate.stiffness_ratio;
  if (estimate.verdict != Status::Found || ratio.high <= kOpenRatio * ratio.low) return;
  estimate.verdict = Status::StiffnessOpen;
  estimate.reasons.emplace_back(
      "the stiffness ratio is not determined: its interval spans more than a factor of four");
}

}  // namespace palpate::lump
