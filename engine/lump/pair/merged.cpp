#include "engine/lump/pair/merged.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "engine/base/text.h"
#include "engine/lump/network/second_bump.h"
#include "engine/numeric/dense.h"

namespace palpate::lump {
namespace {

constexpr int kDirections = 4;                             // in which two lumps are tried
constexpr std::array<double, 2> kTriedHalf_mm = {3, 4.5};  // halves of the distances at which they begin
constexpr double kLeastApart_mm = 4;  // between what is found: nearer ones are one lump of another shape
constexpr double kLessPattern = 0.6;  // of the pattern that one lump leaves: two leave less
constexpr double kDistanceStep_mm = 0.5, kFarthest_mm = 24;

}  // namespace

double separable_from_mm(const Model& model, const PressedNodes& nodes, const PairWeighing& pair) {
  const auto &one = pair.lumps[0].place_mm, &two = pair.lumps[1].place_mm;
  const double apart = std::hypot(two[0] - one[0], two[1] - one[1]);
  std::optional<double> from;
  for (double distance = std::max(kLeastApart_mm, apart); distance <= kFarthest_mm;
       distance += kDistanceStep_mm) {
    PressedNodes shown = nodes;
    shown.rest.setZero();
    for (size_t i = 0; i < 2; ++i) {
      std::array<double, 2> place{};
      for (size_t axis = 0; axis < 2; ++axis)
        place[axis] = 0.5 * (one[axis] + two[axis]) +
                      (i == 0 ? -0.5 : 0.5) * distance * (two[axis] - one[axis]) / std::max(apart, 1e-9);
      const PatchView view(model, nodes, place, false);
      Fit fit = pair.best.lumps[i];
      fit.at.tail<2>().setZero();
      add_bump(model, view, bump_of(model, view.setting, nodes.loads, fit), shown);
    }
    const auto bump = find_second_bump(shown);
    if (!bump || !reports_two(*bump))
      from.reset();
    else if (!from)
      from = distance;
  }
  return from.value_or(0);
}

void report_merged(const Model& model, const PressedNodes& nodes, Estimate& estimate) {
  if (estimate.verdict != Status::OutsideTraining || !(estimate.detection_statistic >= 1)) return;
  const Calibration calibration =
      calibration_at(model, Method::Refined, nodes.loads.size(), nodes.noise_fraction);
  const Inference alone = weigh_lumps(model, nodes, Method::Refined, calibration.temperature);
  if (alone.misfit <= calibration.misfit) return;
  const std::array<double, 2> middle = find_bump(model, nodes);
  std::vector<TwoPlaces> places;
  for (int d = 0; d < kDirections; ++d)
    for (const double half_mm : kTriedHalf_mm) {
      const double angle = std::numbers::pi * d / kDirections;
      const double x = half_mm * std::cos(angle), y = half_mm * std::sin(angle);
      places.push_back({{{middle[0] - x, middle[1] - y}, {middle[0] + x, middle[1] + y}}});
    }
  const PairWeighing pair = weigh_pair(model, nodes, places, calibration.temperature);
  const auto &one = pair.lumps[0], &two = pair.lumps[1];
  const double apart = std::hypot(two.place_mm[0] - one.place_mm[0], two.place_mm[1] - one.place_mm[1]);
  const double needed = calibration.log_likelihood_ratio;
  const bool explained = one.misfit <= calibration.misfit && one.rest <= calibration.rest &&
                         one.pattern < kLessPattern * alone.pattern;
  if (!explained || !(apart >= kLeastApart_mm) || one.log_likelihood_ratio < needed ||
      two.log_likelihood_ratio < needed)
    return;
  estimate.verdict = Status::NotSeparable;
  estimate.separable_from_mm = separable_from_mm(model, nodes, pair);
  clear_values(estimate);
  const std::string from =
      estimate.separable_from_mm > 0
          ? text("two such lumps would be told apart from a distance of %.3g mm on",
                 estimate.separable_from_mm)
          : std::string("two such lumps would not be told apart at any distance in this window");
  estimate.reasons.insert(
      estimate.reasons.begin(),
      text("one bump, which no lump that the model knows makes and two explain, about %.2g mm apart: ",
           apart) +
          from);
}

}  // namespace palpate::lump
