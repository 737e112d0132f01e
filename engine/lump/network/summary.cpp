// From log-likelihood ratio to an answer: intervals that hold what they promise, and what is not to be used.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "engine/base/normal.h"
#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "engine/lump/network/detection_limit.h"
#include "engine/lump/network/fit.h"
#include "engine/lump/network/limit_search.h"

namespace palpate::lump {
namespace {

// Part of its way from the middle that a lump's centre is wrong by at the surface, and the depth over which
// that falls: tissue under a plate flows outwards, which the emulator knows best in the middle. Of 30 blocks
// with lumps up to 11 mm aside.
constexpr double kAside = 0.08, kAsideDepth_mm = 6;

// Over the pattern that one press of tissue alone leaves: what presses by hand leave, stitched.
constexpr double kStitched = 1.25;

// Fractions of a range: an interval all of which lies further beyond it is outside, and so is an estimate,
// for a lump beyond the range may be of any size or depth. Of ratios far above it little more is to be seen.
constexpr double kEdge = 0.05, kMiddleEdge = 0.02, kRatioEdge = 0.08;

}  // namespace

void clear_values(Estimate& e) {
  for (Value* value : {&e.size_mm, &e.depth_mm, &e.stiffness_ratio, &e.x_mm, &e.y_mm})
    *value = {kNaN, kNaN, kNaN};
}

void summarise(const Model& model, const PressedNodes& nodes, Method method, const Inference& found,
               Estimate& estimate) {
  const Calibration calibration = calibration_at(model, method, nodes.loads.size(), nodes.noise_fraction);
  estimate.detection_statistic = std::max(0.0, found.log_likelihood_ratio) / calibration.log_likelihood_ratio;
  estimate.false_alarm_rate = model.false_alarm_rate;
  estimate.shape_probability = found.posterior.shape_probability;
  const auto likeliest =
      std::max_element(estimate.shape_probability.begin(), estimate.shape_probability.end());
  estimate.shape = static_cast<InclusionShape>(likeliest - estimate.shape_probability.begin());
  bool outside = false;
  std::array<double, kParameters> logs{};
  for (const Parameter p : {kSize, kDepth, kRatio})
    if (!found.posterior.parts.empty()) logs[p] = found.posterior.quantile(p, 0.5);
  const auto value = [&](Parameter what, const std::array<double, 2>& range, const char* name) {
    const double middle = logs[what];
    const double inflation = calibration.inflation[what] * local_inflation(model, method, what, logs);
    const double low = middle - inflation * (middle - found.posterior.quantile(what, 0.05));
    const double high = middle + inflation * (found.posterior.quantile(what, 0.95) - middle);
    const double edge = what == kRatio ? kRatioEdge : kMiddleEdge;
    if (std::exp(low) > range[1] * (1 + kEdge) || std::exp(high) < range[0] * (1 - kEdge) ||
        std::exp(middle) > range[1] * (1 + edge) || std::exp(middle) < range[0] * (1 - edge)) {
      outside = true;
      estimate.reasons.push_back(
          text((std::string(name) + " of %.3g lies outside of the model's %.3g to %.3g").c_str(),
               std::exp(middle), range[0], range[1]));
    }
    const double beyond = what == kRatio ? 0 : kRatioEdge;
    const auto in_range = [&](double log_value) {
      return std::clamp(std::exp(log_value), range[0] * (1 - beyond), range[1] * (1 + beyond));
    };
    return Value{in_range(middle), in_range(low), in_range(high)};
  };
  if (estimate.detection_statistic < 1) {
    clear_values(estimate);
    const double allowed = kStitched * calibration.plain_pattern;
    if (found.plain_pattern > allowed) {
      estimate.verdict = Status::OutsideTraining;
      estimate.reasons.push_back(text(
          "the pressure is neither that of tissue alone nor that of a lump the model knows: a pattern of "
          "%.2g %% of the peak is left, %.2g %% allowed",
          100 * found.plain_pattern, 100 * allowed));
      return;
    }
    estimate.verdict = Status::NoLump;
    estimate.reasons.push_back(
        text("no lump: evidence %.3g, where 1 is reached by %.3g %% of observations without a lump",
             estimate.detection_statistic, 100 * model.false_alarm_rate));
    estimate.detection_limits = detection_limits(model, nodes, method);
    if (const std::string seen = sentence_of(estimate.detection_limits); !seen.empty())
      estimate.reasons.push_back(seen);
    return;
  }
  estimate.size_mm = value(kSize, model.size_mm, "a size in mm");
  estimate.depth_mm = value(kDepth, model.depth_mm, "a depth in mm");
  estimate.stiffness_ratio = value(kRatio, model.ratio, "a stiffness ratio");
  const double depth_mm = std::min(estimate.depth_mm.value, model.depth_mm[1]);
  for (size_t axis = 0; axis < 2; ++axis) {
    const double half =
        kNormal90 * std::hypot(calibration.place_inflation * found.place_sd_mm[axis],
                               kAside * std::exp(-depth_mm / kAsideDepth_mm) * found.place_mm[axis]);
    (axis == 0 ? estimate.x_mm : estimate.y_mm) = {found.place_mm[axis], found.place_mm[axis] - half,
                                                   found.place_mm[axis] + half};
  }
  if (found.misfit > calibration.misfit || found.rest > calibration.rest) {
    outside = true;
    estimate.reasons.push_back(
        found.misfit > calibration.misfit
            ? text("no lump that the model knows makes this pressure: a pattern of %.2g %% of the peak is "
                   "left, "
                   "%.2g %% allowed",
                   100 * found.pattern, 100 * found.pattern * calibration.misfit / found.misfit)
            : text("the pressure has detail that no lump makes (%.3g of the noise, %.3g allowed)", found.rest,
                   calibration.rest));
  }
  if (std::hypot(found.place_mm[0], found.place_mm[1]) > 1.5 * model.offset_mm + 2) {
    outside = true;
    estimate.reasons.push_back(
        text("the lump's centre lies %.3g mm from the block's middle, the model knows %.3g mm to each side",
             std::hypot(found.place_mm[0], found.place_mm[1]), model.offset_mm));
  }
  estimate.verdict = outside ? Status::OutsideTraining : Status::Found;
  open_wide_ratio(estimate);
  const Value& ratio = estimate.stiffness_ratio;
  if (estimate.verdict != Status::StiffnessOpen && ratio.high >= model.ratio[1] * 0.999)
    estimate.reasons.push_back(
        text("the stiffness ratio is %.3g or more: beyond %.3g the model does not distinguish", ratio.low,
             ratio.high));
}

}  // namespace palpate::lump
