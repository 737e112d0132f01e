#include "engine/lump/estimator.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/lump/fem_inverse/inversion.h"
#include "engine/lump/pair/pair.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

constexpr double kReach_mm = 12;     // around a bump
constexpr double kLeastOdds = 0.05;  // of a shape that is worth a search

/// Whether the bump at a place is longer along y than along x.
bool longer_along_y(const Observation& observation, double x_mm, double y_mm) {
  const PressureMap& map = observation.pressure_Pa.back();
  std::vector<float> seen;
  std::copy_if(map.values.begin(), map.values.end(), std::back_inserter(seen),
               [](float p) { return std::isfinite(p); });
  if (seen.empty()) return false;
  const auto level = double{median(std::move(seen))};
  const auto each = [&](const auto& take) {
    for (uint32_t row = 0; row < map.height; ++row)
      for (uint32_t column = 0; column < map.width; ++column) {
        const double x = observation.window_mm[0] + (column - (map.width - 1) / 2.0) * map.pitch_mm[0] - x_mm;
        const double y = observation.window_mm[1] + (row - (map.height - 1) / 2.0) * map.pitch_mm[1] - y_mm;
        const auto value = double{map.at(column, row)};
        if (std::isfinite(value) && x * x + y * y <= kReach_mm * kReach_mm) take(x, y, value);
      }
  };
  // Nodes that stand out less than half as high as the top belong to the block as much as to the lump.
  double top = level;
  each([&](double, double, double value) { top = std::max(top, value); });
  double along_x = 0, along_y = 0;
  each([&](double x, double y, double value) {
    const double above = std::max(0.0, value - (level + top) / 2);
    along_x += above * x * x;
    along_y += above * y * y;
  });
  return along_y > along_x;
}

/// Cells are too coarse for some lumps, which their own fit does not show: where a value lies outside of
/// the network's interval, one of the two is wrong, and the interval holds both.
void hold_against(const Estimate& network, Estimate& direct) {
  const auto hold = [&direct](const char* name, const Value& other, Value& value) {
    if (value.value >= other.low && value.value <= other.high) return;
    const std::string line = text("%s of %.3g lies outside of the network's 90 %% interval, %.3g to %.3g",
                                  name, value.value, other.low, other.high);
    direct.reasons.emplace_back(line);
    widen(value, other);
  };
  hold("the size, mm,", network.size_mm, direct.size_mm);
  hold("the depth, mm,", network.depth_mm, direct.depth_mm);
  hold("the stiffness ratio", network.stiffness_ratio, direct.stiffness_ratio);
  open_wide_ratio(direct);
}

}  // namespace

Inverse direct_inverse(std::shared_ptr<const Network> network, uint32_t threads) {
  return [network = std::move(network), threads](const Observation& observation) {
    DirectInversionOptions options;
    options.model.threads = threads;
    options.emulator = network->shared_model();
    Estimate first = network->estimate(observation);
    estimate_pair(network->model(), observation, first);
    if (first.verdict == Status::SeveralLumps || first.verdict == Status::NotSeparable ||
        first.verdict == Status::Saturated || first.verdict == Status::Inconsistent)
      return first;
    if (first.size_mm.value > 0 && first.depth_mm.value > 0) {
      Case::Lump start = lump_of(first);
      const bool along_y = longer_along_y(observation, first.x_mm.value, first.y_mm.value);
      for (size_t s = 0; s < first.shape_probability.size(); ++s) {
        if (first.shape_probability[s] < kLeastOdds) continue;
        start.shape = static_cast<InclusionShape>(s);
        start.along_y = along_y && (start.shape == InclusionShape::Ellipsoid ||
                                    start.shape == InclusionShape::LyingCylinder);
        options.starts.push_back({start, first.shape_probability[s]});
      }
    }
    Estimate estimate = invert_directly(observation, options);
    if (reports_numbers(first.verdict) && reports_numbers(estimate.verdict)) hold_against(first, estimate);
    return estimate;
  };
}

std::shared_ptr<const Network> load_network(const std::string& file) {
  return std::make_shared<const Network>(file.empty() ? Network::built_in() : Network::read(file));
}

Estimator named_estimator(const std::string& method, std::shared_ptr<const Network> network,
                          const ErrorSources& sources, uint32_t threads) {
  const auto by = [&network](Method how) -> Inverse {
    return [network, how](const Observation& observation) {
      Estimate estimate = network->estimate(observation, how);
      estimate_pair(network->model(), observation, estimate);
      return estimate;
    };
  };
  if (method == "direct") return {direct_inverse(network, threads), sources, by(Method::Network)};
  if (method == "network") return {by(Method::Network), sources};
  if (method == "refined") return {by(Method::Refined), sources};
  throw Error(Failure::Usage, "the method network, refined or direct", "'" + method + "'", "network");
}

}  // namespace palpate::lump
