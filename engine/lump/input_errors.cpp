#include "engine/lump/input_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Observation changed(const Observation& observation, const std::string& input, double factor) {
  Observation other = observation;
  if (input == "modulus") other.young_Pa *= factor;
  if (input == "thickness") other.block_mm[2] *= factor;
  if (input == "pitch")
    for (fem::Map& map : other.pressure_Pa)
      for (double& pitch : map.pitch_mm) pitch *= factor;
  return other;
}

std::array<double, 3> changes(const Estimate& estimate, const Estimate& other) {
  if (!reports_numbers(other.verdict)) return {kNaN, kNaN, kNaN};
  return {other.size_mm.value / estimate.size_mm.value - 1,
          other.depth_mm.value / estimate.depth_mm.value - 1,
          other.stiffness_ratio.value / estimate.stiffness_ratio.value - 1};
}

/// Logarithm of a change, of its mirror image where there is none.
double move_of(double change, double opposite) {
  if (std::isfinite(change)) return std::log1p(change);
  return std::isfinite(opposite) ? -std::log1p(opposite) : 0;
}

std::string side_text(const std::array<double, 3>& changes) {
  if (!std::isfinite(changes[0])) return "no numbers";
  return text("size %+.2g %%, depth %+.2g %%, ratio %+.2g %%", 100 * changes[0], 100 * changes[1],
              100 * changes[2]);
}

}  // namespace

void widen_for_input_errors(const Estimator& estimator, const Observation& observation,
                            const InputErrors& errors, Estimate& estimate) {
  for (const double share : {errors.young, errors.thickness, errors.pitch})
    if (!(share >= 0 && share <= 0.5))
      throw Error(Failure::Usage, "input errors from 0 to 0.5", text("%g", share), "0.1, which is 10 %");
  if (!reports_numbers(estimate.verdict)) return;
  const std::array<Value*, 3> values = {&estimate.size_mm, &estimate.depth_mm, &estimate.stiffness_ratio};
  std::array<double, 3> below{}, above{};  // squares
  for (size_t p = 0; p < values.size(); ++p) {
    below[p] = std::pow(std::log(values[p]->value / values[p]->low), 2);
    above[p] = std::pow(std::log(values[p]->high / values[p]->value), 2);
  }
  for (const auto& [input, share] :
       {std::pair{"modulus", errors.young}, {"thickness", errors.thickness}, {"pitch", errors.pitch}}) {
    if (share == 0) continue;
    const Estimate lower = estimator(changed(observation, input, 1 - share)),
                   higher = estimator(changed(observation, input, 1 + share));
    estimate.wall_s += lower.wall_s + higher.wall_s;
    const InputEffect effect{input, share, changes(estimate, lower), changes(estimate, higher)};
    for (size_t p = 0; p < values.size(); ++p) {
      const double down = move_of(effect.lower[p], effect.higher[p]),
                   up = move_of(effect.higher[p], effect.lower[p]);
      below[p] += std::pow(std::min({down, up, 0.0}), 2);
      above[p] += std::pow(std::max({down, up, 0.0}), 2);
    }
    estimate.input_effects.push_back(effect);
  }
  for (size_t p = 0; p < values.size(); ++p) {
    values[p]->low = values[p]->value * std::exp(-std::sqrt(below[p]));
    values[p]->high = values[p]->value * std::exp(std::sqrt(above[p]));
  }
  open_wide_ratio(estimate);
}

std::string effect_text(const InputEffect& effect) {
  return "if the " + effect.input + text(" is %.3g %% lower than told: ", 100 * effect.error) +
         side_text(effect.lower) + text("; %.3g %% higher: ", 100 * effect.error) + side_text(effect.higher);
}

}  // namespace palpate::lump
