// Verdict on a force calibration: how good it is, whether it is fit for use, and what would make it better.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "capture/calibrate/force/force.h"
#include "engine/base/text.h"

namespace palpate {
namespace {

constexpr size_t kEnoughPresses = 3;
constexpr double kManyLeftOut = 0.25;  // of the touched frames

/// Advice, the most helpful first.
std::string advice(const ForceOutcome& o, size_t presses) {
  std::map<LeftOut, size_t> counts;
  for (const ForceSample& s : o.samples) ++counts[s.left_out];
  const auto many = [&](LeftOut why) {
    return static_cast<double>(counts[why]) > kManyLeftOut * static_cast<double>(o.samples.size());
  };
  std::string advice;
  const auto add = [&](const std::string& what) { advice += (advice.empty() ? "" : "; ") + what; };
  if (many(LeftOut::AtBorder))
    add(text("%zu of %zu touched frames reach the border: --keep-border, or an object that stays inside",
             counts[LeftOut::AtBorder], o.samples.size()));
  if (many(LeftOut::Saturated))
    add(text("%zu of %zu touched frames are saturated: less exposure", counts[LeftOut::Saturated],
             o.samples.size()));
  if (many(LeftOut::NoGauge))
    add(text("%zu of %zu touched frames have no reading of the gauge: a table that spans the recording",
             counts[LeftOut::NoGauge], o.samples.size()));
  if (presses < kEnoughPresses)
    add(text("only %zu press%s: three or more, slowly in and out", presses, presses == 1 ? "" : "es"));
  if (advice.empty()) add("more presses, at several places and with several objects");
  return advice;
}

}  // namespace

ForceVerdict verdict_of(const ForceOutcome& o) {
  ForceVerdict verdict;
  const double full_N = o.choice.calibration.force_max_N;
  std::set<std::pair<uint32_t, uint64_t>> presses;
  double pressed_N = 0;
  for (const ForceSample& s : o.samples) {
    if (std::isfinite(s.force_N)) pressed_N = std::max(pressed_N, s.force_N);
    if (s.left_out == LeftOut::Used) presses.emplace(s.recording, s.press);
  }
  verdict.presses = presses.size();
  verdict.interval_fraction = full_N > 0 ? o.choice.interval_full_N / full_N : 1;
  verdict.reach = pressed_N > 0 ? full_N / pressed_N : 0;

  std::string against;
  const auto add = [&](const std::string& what) { against += (against.empty() ? "" : ", ") + what; };
  if (!(verdict.interval_fraction <= ForceVerdict::kWorstInterval))
    add(text("+- %.3g N at %.3g N (%.0f %% of full scale)", o.choice.interval_full_N, full_N,
             100 * verdict.interval_fraction));
  if (o.choice.readings < ForceVerdict::kFewestReadings)
    add(text("%zu readings (%zu or more are needed)", o.choice.readings, ForceVerdict::kFewestReadings));
  if (verdict.reach < ForceVerdict::kLeastReach)
    add(text("it ends at %.3g N of the %.3g N pressed", full_N, pressed_N));
  std::map<LeftOut, size_t> left_out;
  for (const ForceSample& s : o.samples) ++left_out[s.left_out];
  const auto outliers = static_cast<double>(left_out[LeftOut::Outlier]),
             fitted = outliers + static_cast<double>(o.choice.readings);
  if (outliers > ForceVerdict::kMostOutliers * fitted)
    add(text("%.0f of %.0f readings contradict the rest (outliers)", outliers, fitted));
  verdict.fit_for_use = against.empty();
  if (!verdict.fit_for_use) {
    verdict.line = "not fit for use: " + against + ". Try: " + advice(o, verdict.presses);
    return verdict;
  }
  verdict.line = text("good to +- %.3g N, %.2g %% of full scale (95 %%), up to %.4g N",
                      o.choice.interval_full_N, 100 * verdict.interval_fraction, full_N);
  if (2 * o.choice.readings < o.samples.size()) {
    std::string reasons;
    for (const auto& [why, count] : left_out)
      if (why != LeftOut::Used && count > 0)
        reasons += text("%s%zu %s", reasons.empty() ? "" : ", ", count, to_string(why));
    verdict.line +=
        text("; from %zu of %zu touched frames alone (left out: ", o.choice.readings, o.samples.size()) +
        reasons + ")";
  }
  if (verdict.presses == 1) verdict.line += "; judged within one press: another may differ";
  // A gel's pixels show slopes, and those go with the object's shape as well as with the force; its layer
  // knows shapes.
  const ForceSignal signal = o.choice.calibration.signal;
  const bool by_shape = signal == ForceSignal::LayerAndBending ||
                        (signal != ForceSignal::Layer &&
                         std::ranges::any_of(o.samples, [](auto& s) { return s.features.has_gradient; }));
  verdict.shapes_judged = !by_shape || count_objects(o.samples) >= kFewestObjects;
  if (!verdict.shapes_judged)
    verdict.line +=
        "; for objects shaped as those pressed alone: on a gel others may read half of their force, "
        "recordings of three objects or more judge that";
  return verdict;
}

}  // namespace palpate
