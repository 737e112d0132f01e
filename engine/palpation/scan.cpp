#include "engine/palpation/scan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/lump/network/network.h"
#include "engine/lump/network/second_bump.h"
#include "palpate/error.h"

namespace palpate {
namespace {

std::vector<double> along(double block_mm, double window_mm, double overlap) {
  // Over the rim by so much: what lies beside a window's own rim is seen in part only.
  constexpr double kOverRim_mm = 1.5;
  const double way_mm = block_mm + 2 * kOverRim_mm - window_mm;
  if (way_mm <= 0) return {0};
  const auto steps = static_cast<int>(std::ceil(way_mm / ((1 - overlap) * window_mm) - 1e-9));
  std::vector<double> places;
  for (int i = 0; i <= steps; ++i) places.push_back(-way_mm / 2 + way_mm * i / steps);
  return places;
}

/// The maps at one press's own forces, from those that were solved.
std::vector<PressureMap> maps_at(const fem::LargeStrainResult& solved, const std::vector<double>& forces_N) {
  std::vector<PressureMap> maps;
  for (const double force_N : forces_N) {
    size_t k = 0;
    while (k + 2 < solved.loads.size() && solved.loads[k + 1].force_N < force_N) ++k;
    const fem::PressedBlock &a = solved.loads[k], &b = solved.loads[k + 1];
    const double t = (force_N - a.force_N) / (b.force_N - a.force_N);
    PressureMap map = a.pressure_Pa;
    for (size_t i = 0; i < map.values.size(); ++i)
      map.values[i] =
          static_cast<float>(force_N * ((1 - t) * static_cast<double>(a.pressure_Pa.values[i]) / a.force_N +
                                        t * static_cast<double>(b.pressure_Pa.values[i]) / b.force_N));
    maps.push_back(std::move(map));
  }
  return maps;
}

/// Without what lies nearer to `hidden` than half of its way to `kept`: the smooth block under one bump is
/// not to be fitted to the other.
lump::Observation without_place(lump::Observation observation, const std::array<double, 2>& hidden,
                                const std::array<double, 2>& kept) {
  const double reach = 0.5 * std::hypot(hidden[0] - kept[0], hidden[1] - kept[1]);
  for (PressureMap& map : observation.pressure_Pa)
    for (uint32_t j = 0; j < map.height; ++j)
      for (uint32_t i = 0; i < map.width; ++i) {
        const double x = observation.window_mm[0] + (i - (map.width - 1) / 2.0) * map.pitch_mm[0],
                     y = observation.window_mm[1] + (j - (map.height - 1) / 2.0) * map.pitch_mm[1];
        if (std::hypot(x - hidden[0], y - hidden[1]) < reach)
          map.values[size_t{j} * map.width + i] = std::numeric_limits<float>::quiet_NaN();
      }
  return observation;
}

/// Sides of the presses' windows, the median.
std::array<double, 2> window_of(const std::vector<lump::ScanPress>& presses) {
  std::vector<double> width_mm, height_mm;
  for (const lump::ScanPress& press : presses) {
    const PressureMap& map = press.observation.pressure_Pa.back();
    width_mm.push_back(map.width * map.pitch_mm[0]);
    height_mm.push_back(map.height * map.pitch_mm[1]);
  }
  return {median(width_mm), median(height_mm)};
}

/// Whether a place lies in a press's window, off its edge.
bool sees(const lump::Observation& press, const std::array<double, 2>& place) {
  constexpr double kEdge_mm = 4;  // nearer to a window's edge a bump is cut
  const PressureMap& map = press.pressure_Pa.back();
  return std::abs(place[0] - press.window_mm[0]) < map.pitch_mm[0] * (map.width - 1) / 2 - kEdge_mm &&
         std::abs(place[1] - press.window_mm[1]) < map.pitch_mm[1] * (map.height - 1) / 2 - kEdge_mm;
}

/// Those with one bump well in their window and the other far off it.
std::vector<ScannedPress> press_answers(const std::vector<lump::ScanPress>& presses, const lump::ScanMap& map,
                                        const lump::SecondBump& bumps, const lump::Estimator& estimator) {
  std::vector<ScannedPress> answers;
  for (size_t p = 0; p < presses.size(); ++p) {
    const lump::Observation& observation = presses[p].observation;
    const PressureMap& window = observation.pressure_Pa.back();
    if (!map.places[p].used) continue;
    for (size_t b = 0; b < 2; ++b) {
      const auto &own = bumps.place_mm[b], &other = bumps.place_mm[1 - b];
      const bool other_in =
          std::abs(other[0] - observation.window_mm[0]) < window.pitch_mm[0] * (window.width - 1) / 2 &&
          std::abs(other[1] - observation.window_mm[1]) < window.pitch_mm[1] * (window.height - 1) / 2;
      if (sees(observation, own) && !other_in)
        answers.push_back({presses[p].name, own, estimator(observation)});
    }
  }
  return answers;
}

}  // namespace

std::vector<std::array<double, 2>> scan_places(const std::array<double, 3>& block_mm,
                                               const std::array<double, 2>& window_mm, double overlap) {
  if (!(window_mm[0] > 0 && window_mm[1] > 0 && overlap >= 0 && overlap < 0.9))
    throw Error(Failure::Usage, "a window with sides above 0 and an overlap of 0 to 0.9",
                text("%g x %g mm, %g", window_mm[0], window_mm[1], overlap), "--window-mm 27.84 20.88");
  std::vector<std::array<double, 2>> places;
  for (const double y : along(block_mm[1], window_mm[1], overlap))
    for (const double x : along(block_mm[0], window_mm[0], overlap)) places.push_back({x, y});
  if (places.size() > 100)
    throw Error(Failure::Usage, "at most 100 presses", std::to_string(places.size()) + " for this window",
                "a larger --window-mm");
  return places;
}

std::vector<lump::ScanPress> simulate_scan(const ScanPlan& plan, const fem::PressSolver& solver) {
  if (!(plan.force_N > 0) || plan.loads < 1 || plan.loads > 8 || !(plan.stage_sd_mm >= 0) ||
      !(plan.force_sd >= 0 && plan.force_sd < 0.2))
    throw Error(Failure::Usage,
                "a force above 0, 1 to 8 loads, a stage error of 0 or more, a force spread of 0 to 0.2",
                text("%g N, %u loads, %g mm", plan.force_N, plan.loads, plan.stage_sd_mm),
                "--force-N 2 --loads 4");
  std::mt19937_64 random(plan.seed * 7919 + 17);
  std::normal_distribution<double> deviate(0, 1);
  const auto places =
      plan.places_mm.empty() ? scan_places(plan.scene.block_mm, plan.sensor.window_mm) : plan.places_mm;

  // One step more than the loads, so that a press may be a little harder.
  const double hardest = 1 + 3 * plan.force_sd;
  std::vector<fem::PressLoad> loads;
  for (uint32_t k = 1; k <= plan.loads; ++k) loads.push_back({{}, plan.force_N * k / plan.loads});
  loads.push_back({{}, plan.force_N * std::max(1.01, hardest)});
  const fem::LargeStrainResult solved = solver(plan.scene, loads);
  if (!solved.converged)
    throw Error(Failure::Usage, text("a press of %.3g N", loads.back().force_N.value()),
                text("no convergence beyond %.3g N, %.3g mm", solved.last_force_N, solved.last_press_mm),
                "a smaller --force-N, or a stiffer tissue");

  std::vector<lump::ScanPress> presses;
  for (size_t p = 0; p < places.size(); ++p) {
    const double fraction = std::clamp(1 + plan.force_sd * deviate(random), 2 - hardest, hardest);
    std::vector<double> forces_N;
    for (uint32_t k = 1; k <= plan.loads; ++k) forces_N.push_back(fraction * plan.force_N * k / plan.loads);
    lump::PalpationSensor sensor = plan.sensor;
    sensor.window_center_mm = {places[p][0] + plan.stage_sd_mm * deviate(random),
                               places[p][1] + plan.stage_sd_mm * deviate(random)};
    lump::Observation observation =
        sensor_observation(maps_at(solved, forces_N), forces_N, plan.scene.block_mm, plan.scene.young_Pa,
                           sensor, plan.seed * 1000 + p);
    observation.window_mm = places[p];
    presses.push_back({"press " + std::to_string(p + 1), std::move(observation)});
  }
  return presses;
}

lump::Estimate estimate_map(const lump::ScanMap& map, const std::vector<lump::ScanPress>& presses,
                            const lump::StitchOptions& options, const lump::Estimator& estimator) {
  return estimator(map.observation, [&](double fraction) {
    std::vector<lump::ScanPress> lit = presses;
    for (lump::ScanPress& p : lit) p.observation = with_uneven_light(std::move(p.observation), fraction);
    return stitch(lit, options).observation;
  });
}

ScanAnswer evaluate_scan(const std::vector<lump::ScanPress>& presses, const lump::StitchOptions& options,
                         const lump::Estimator& estimator, uint64_t seed) {
  ScanAnswer answer;
  answer.map = stitch(presses, options);
  const auto two = second_bump_reported(lump::Network::built_in().model(), answer.map.observation);
  // The profile is fitted to the higher one of two bumps.
  const lump::Observation first =
      two ? without_place(answer.map.observation, two->place_mm[1], two->place_mm[0])
          : answer.map.observation;
  answer.outline = outline_lump(first, seed);
  if (two)
    answer.second_outline =
        outline_lump(without_place(answer.map.observation, two->place_mm[0], two->place_mm[1]), seed);
  if (estimator) answer.estimate = estimate_map(answer.map, presses, options, estimator);
  if (answer.estimate)
    answer.next = next_press(lump::Network::built_in().model(), answer.map, *answer.estimate,
                             {.window_mm = window_of(presses)});
  if (estimator && two) answer.presses = press_answers(presses, answer.map, *two, estimator);
  const double y_mm = answer.outline.found ? answer.outline.y_mm.value : 0;
  answer.profile = lump::profile_along_x(answer.map.observation.pressure_Pa.back(), y_mm);
  answer.block = lump::profile_along_x(answer.outline.block_Pa, y_mm);
  lump::Profile bump;
  const lump::Profile own = lump::profile_along_x(first.pressure_Pa.back(), y_mm);
  for (size_t i = 0; i < answer.profile.x_mm.size(); ++i) {
    if (!std::isfinite(own.value[i])) continue;
    bump.x_mm.push_back(answer.profile.x_mm[i]);
    bump.value.push_back(answer.profile.value[i] - answer.block.value[i]);
  }
  bump = inner_part(bump, 0.45 * answer.map.observation.block_mm[0]);
  if (bump.x_mm.size() >= 6) answer.fit = fit_gaussian(bump);
  answer.warnings = answer.map.warnings;
  if (two)
    answer.warnings.push_back(
        text("two bumps, %.3g mm apart: what is felt is given for each", two->distance_mm));
  if (!answer.outline.reason.empty()) answer.warnings.push_back("no outline: " + answer.outline.reason);
  if (answer.estimate)
    for (const std::string& reason : answer.estimate->reasons) answer.warnings.push_back(reason);
  return answer;
}

const char* shape_text(InclusionShape shape) {
  constexpr const char* kNames[] = {"sphere", "ellipsoid", "upright cylinder", "lying cylinder"};
  return kNames[static_cast<size_t>(shape)];
}

std::string interval_text(const lump::Value& v, const char* unit) {
  return text("%.3g%s%s (90 %%: %.3g to %.3g)", v.value, *unit ? " " : "", unit, v.low, v.high);
}

namespace {

void add_quantities(const lump::Estimate& e, std::vector<std::pair<std::string, std::string>>& rows) {
  rows.emplace_back("size", interval_text(e.size_mm, "mm"));
  rows.emplace_back("depth of its top", interval_text(e.depth_mm, "mm"));
  if (e.verdict == lump::Status::Found) {
    rows.emplace_back("stiffness over the tissue's", interval_text(e.stiffness_ratio, ""));
  } else {
    rows.emplace_back("stiffness over the tissue's", text("between %.3g and %.3g: not determined",
                                                          e.stiffness_ratio.low, e.stiffness_ratio.high));
  }
  rows.emplace_back("centre x", interval_text(e.x_mm, "mm"));
  rows.emplace_back("centre y", interval_text(e.y_mm, "mm"));
  std::string shapes;
  for (size_t i = 0; i < e.shape_probability.size(); ++i)
    shapes += (i ? ", " : "") + std::string(shape_text(static_cast<InclusionShape>(i))) +
              text(" %.0f %%", 100 * e.shape_probability[i]);
  rows.emplace_back("shape", std::string(shape_text(e.shape)) + " (" + shapes + ")");
}

}  // namespace

std::vector<std::pair<std::string, std::string>> estimate_rows(const lump::Estimate& e) {
  std::vector<std::pair<std::string, std::string>> rows;
  rows.emplace_back("verdict", lump::status_text(e.verdict));
  std::string line = text("%.3g of the threshold 1, which %.2g %% of readings without a lump reach",
                          e.detection_statistic, 100 * e.false_alarm_rate);
  if (e.verdict != lump::Status::Unusable) rows.emplace_back("evidence", line);
  if (reports_numbers(e.verdict)) add_quantities(e, rows);
  for (size_t i = 0; i < e.lumps.size(); ++i) {
    const lump::Estimate& each = e.lumps[i];
    rows.emplace_back(text("lump %zu", i + 1), lump::status_text(each.verdict));
    if (reports_numbers(each.verdict)) add_quantities(each, rows);
    for (const std::string& reason : each.reasons) rows.emplace_back("reason", reason);
  }
  for (const std::string& reason : e.reasons) rows.emplace_back("reason", reason);
  if (!e.method.empty())
    rows.emplace_back("method", e.method + (e.wall_s < 1 ? text(", %.3g ms", 1000 * e.wall_s)
                                                         : text(", %.3g s", e.wall_s)));
  return rows;
}

}  // namespace palpate
