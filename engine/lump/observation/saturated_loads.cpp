#include "engine/lump/observation/saturated_loads.h"
#include "engine/base/text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace palpate::lump {
namespace {

/// Unseen nodes from which a way over unseen nodes leads to the map's border.
std::vector<bool> open_to_border(const PressureMap& map) {
  std::vector<bool> open(map.values.size());
  std::vector<size_t> next;
  const auto visit = [&](uint32_t i, uint32_t j) {
    const size_t n = size_t{j} * map.width + i;
    if (open[n] || std::isfinite(map.values[n])) return;
    open[n] = true;
    next.push_back(n);
  };
  for (uint32_t i = 0; i < map.width; ++i) {
    visit(i, 0);
    visit(i, map.height - 1);
  }
  for (uint32_t j = 0; j < map.height; ++j) {
    visit(0, j);
    visit(map.width - 1, j);
  }
  while (!next.empty()) {
    const auto i = static_cast<uint32_t>(next.back() % map.width),
               j = static_cast<uint32_t>(next.back() / map.width);
    next.pop_back();
    if (i > 0) visit(i - 1, j);
    if (j > 0) visit(i, j - 1);
    if (i + 1 < map.width) visit(i + 1, j);
    if (j + 1 < map.height) visit(i, j + 1);
  }
  return open;
}

}  // namespace

double unseen_fraction(const PressureMap& map) {
  const auto unseen =
      std::count_if(map.values.begin(), map.values.end(), [](float value) { return !std::isfinite(value); });
  return map.values.empty() ? 0 : static_cast<double>(unseen) / static_cast<double>(map.values.size());
}

std::vector<double> saturated_fractions(const Observation& observation) {
  std::vector<double> fractions;
  for (const PressureMap& map : observation.pressure_Pa) fractions.push_back(unseen_fraction(map));
  if (fractions.empty()) return fractions;
  const double saturated = std::clamp(observation.saturated_fraction, 0.0, 1.0);
  // The highest load's unseen nodes are saturated ones and those that no load sees.
  double never = saturated < 1 ? (fractions.back() - saturated) / (1 - saturated) : 0;
  never = std::clamp(never, 0.0, *std::min_element(fractions.begin(), fractions.end()));
  for (double& fraction : fractions) fraction = never < 1 ? (fraction - never) / (1 - never) : 0;
  return fractions;
}

double saturated_fraction(const std::vector<PressureMap>& pressure_Pa) {
  if (pressure_Pa.empty() || pressure_Pa.back().values.empty()) return 0;
  const PressureMap &first = pressure_Pa.front(), &last = pressure_Pa.back();
  const std::vector<bool> open = open_to_border(last);
  const bool same = first.values.size() == last.values.size();
  size_t saturated = 0, seen = 0;
  for (size_t n = 0; n < last.values.size(); ++n) {
    if (std::isfinite(last.values[n]))
      ++seen;
    else if (!open[n] || (same && std::isfinite(first.values[n])))
      ++saturated;
  }
  return static_cast<double>(saturated) / static_cast<double>(std::max<size_t>(1, seen + saturated));
}

std::optional<Observation> without_saturated_loads(const Observation& observation, Estimate& estimate) {
  if (observation.pressure_Pa.size() != observation.force_N.size() || observation.pressure_Pa.empty())
    return observation;
  const std::vector<double> fractions = saturated_fractions(observation);
  Observation seen = observation;
  seen.pressure_Pa.clear();
  seen.force_N.clear();
  for (size_t k = 0; k < fractions.size(); ++k) {
    const double force_N = observation.force_N[k];
    if (fractions[k] > kMostSaturation) {
      estimate.reasons.push_back(
          text("the load of %.3g N is left out: the sensor is saturated in %.2g %% of the window, where "
               "the pressure is "
               "highest",
               force_N, 100 * fractions[k]));
      continue;
    }
    if (fractions[k] >= kReportedSaturation)
      estimate.reasons.push_back(
          text("at %.3g N the sensor is saturated in %.2g %% of the window", force_N, 100 * fractions[k]));
    seen.pressure_Pa.push_back(observation.pressure_Pa[k]);
    seen.force_N.push_back(force_N);
  }
  if (seen.force_N.empty()) {
    estimate.verdict = Status::Saturated;
    estimate.reasons.emplace_back("no load is left: a larger full scale (less light), or press less");
    return std::nullopt;
  }
  seen.saturated_fraction =
      seen.force_N.back() == observation.force_N.back() ? observation.saturated_fraction : 0;
  return seen;
}

}  // namespace palpate::lump
