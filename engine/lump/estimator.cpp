#include "engine/lump/estimator.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "engine/base/text.h"
#include "engine/lump/fem_inverse/inversion.h"
#include "engine/lump/observation/long_axis.h"
#include "engine/lump/pair/pair.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

constexpr double kLeastOdds = 0.05;  // of a shape that is worth a search

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

Inverse direct_inverse(std::shared_ptr<const Network> network, const LongRun& run) {
  return [network = std::move(network), run](const Observation& observation) {
    DirectInversionOptions options;
    options.model.threads = run.threads;
    options.stop = run.stop;
    options.most_work = run.most_work;
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
    options.otherwise = first;
    Estimate estimate = invert_directly(observation, options);
    if (reports_numbers(first.verdict) && reports_numbers(estimate.verdict)) hold_against(first, estimate);
    return estimate;
  };
}

std::shared_ptr<const Network> load_network(const std::string& file) {
  return std::make_shared<const Network>(file.empty() ? Network::built_in() : Network::read(file));
}

Estimator named_estimator(const std::string& method, std::shared_ptr<const Network> network,
                          const ErrorSources& sources, const LongRun& run) {
  const auto by = [&network](Method how) -> Inverse {
    return [network, how](const Observation& observation) {
      Estimate estimate = network->estimate(observation, how);
      estimate_pair(network->model(), observation, estimate);
      return estimate;
    };
  };
  const auto stopped_by = [&run](const Estimator& estimator) { return estimator.until(run.stop); };
  if (method == "direct") return stopped_by({direct_inverse(network, run), sources, by(Method::Network)});
  if (method == "network") return stopped_by({by(Method::Network), sources});
  if (method == "refined") return stopped_by({by(Method::Refined), sources});
  throw Error(Failure::Usage, "the method network, refined or direct", "'" + method + "'", "network");
}

}  // namespace palpate::lump
