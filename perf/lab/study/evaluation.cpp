#include "perf/lab/study/evaluation.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <utility>

#include "engine/base/json.h"
#include "engine/base/normal.h"
#include "engine/base/numbers.h"
#include "engine/base/stop.h"
#include "engine/base/text.h"
#include "engine/lump/tissue/relaxation.h"
#include "perf/lab/dataset/sweep.h"
#include "perf/lab/study/judged_by_team.h"

namespace palpate::lump {
namespace {

constexpr std::array<double, 6> kRatioEdges = {1, 2, 5, 10, 20, 1e9};
constexpr double kGoalSize_mm = 6, kGoalDepth_mm = 8;  // lumps that a person wants found

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return kNaN;
  const auto place = static_cast<size_t>(std::floor(fraction * static_cast<double>(values.size() - 1) + 0.5));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(place), values.end());
  return values[place];
}

/// The observation as it is without its modulus, with the plate's way instead; and with the skin and the
/// plate that are told.
void untell(const EvaluationJob& job, const Example& e, const std::vector<double>& press_mm, uint64_t seed,
            Observation& o) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  o.block_mm[2] *= std::exp(job.thickness_sd * normal(random));
  if (job.skin_told && e.skin) {
    // Of its own, so that the other errors are those of the same reading without a skin told.
    std::mt19937_64 of_skin(seed ^ 0x2545f491ULL);
    std::normal_distribution<double> skin_normal;
    const double thicker = std::exp(job.skin_sd * skin_normal(of_skin)),
                 stiffer = std::exp(job.skin_sd * skin_normal(of_skin));
    o.skin =
        Skin{e.skin->thickness_mm * thicker, e.skin->stiffness_ratio * stiffer, job.skin_sd, job.skin_sd};
  }
  if (job.plate_told && e.plate_sticks) o.plate = Plate{true, 0, 0};
  if (job.plate_told && e.plate_friction > 0) {
    std::mt19937_64 of_plate(seed ^ 0x7f4a7c15ULL);
    const double wrong = job.plate_sd * std::normal_distribution<double>()(of_plate);
    o.plate = Plate{false, std::max(0.0, e.plate_friction + wrong), job.plate_sd};
  }
  if (job.press_sd_mm == 0) return;
  const double zero_mm = std::sqrt(job.press_sd_alike) * job.press_sd_mm * normal(random);
  if (job.modulus_error == 0) o.young_Pa = 0;
  o.press_sd_mm = job.press_sd_mm;
  for (const double press : press_mm)
    o.press_mm.push_back(press + zero_mm +
                         std::sqrt(1 - job.press_sd_alike) * job.press_sd_mm * normal(random));
}

/// With shares that are all wrong alike, by the error that they have.
std::optional<Relaxation> told(std::optional<Relaxation> relaxation, uint64_t seed) {
  if (!relaxation) return relaxation;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, relaxation->share_error / kNormal90);
  const double wrong = 1 + normal(random);
  for (Relaxation::Term& term : relaxation->terms) term.share *= wrong;
  return relaxation;
}

std::vector<std::array<double, 2>> roc_of(const std::vector<Judged>& judged) {
  std::vector<std::pair<double, bool>> order;  // evidence, of a lump
  double lumps = 0, plain = 0;
  for (const Judged& j : judged) {
    if (j.truth.lump && (j.truth.size_mm < kGoalSize_mm || j.truth.depth_mm > kGoalDepth_mm)) continue;
    order.emplace_back(j.estimate.detection_statistic, j.truth.lump);
    (j.truth.lump ? lumps : plain) += 1;
  }
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::array<double, 2>> roc = {{0, 0}};
  double found = 0, alarms = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    (order[i].second ? found : alarms) += 1;
    if (i + 1 == order.size() || order[i + 1].first != order[i].first)
      roc.push_back({plain > 0 ? alarms / plain : 0, lumps > 0 ? found / lumps : 0});
  }
  return roc;
}

/// As the sensor reads the example.
Judged judge_reading(size_t number, const Example& e, const EvaluationJob& job, uint64_t seed) {
  std::vector<PressureMap> maps;
  std::vector<double> forces, press_mm;
  const size_t all = e.force_N.size(), count = job.loads == 0 ? all : std::min<size_t>(job.loads, all);
  for (size_t k = 0; k < count; ++k) {
    const size_t load = all - 1 - (count - 1 - k) * all / count;
    maps.push_back(e.pressure_Pa[load]);
    forces.push_back(e.force_N[load]);
    if (job.press_sd_mm > 0) press_mm.push_back(e.press_mm.at(load));
  }
  if (job.relaxation) relax(*job.relaxation, maps, forces);
  Observation observation = sensor_observation(maps, forces, e.block_mm, e.young_Pa, job.sensor, seed);
  observation.young_Pa *= 1 + job.modulus_error;
  // A gauge's error must not turn the order of near loads.
  for (size_t k = 1; k < count; ++k)
    observation.force_N[k] = std::max(observation.force_N[k], 1.0001 * observation.force_N[k - 1]);
  untell(job, e, press_mm, seed ^ 0x5851f42dULL, observation);
  if (job.relaxation_told) observation.relaxation = told(job.relaxation, seed ^ 0x9d2c5681ULL);
  Judged judged{number, e, job.estimator(observation), observation.saturated_fraction};
  judged.truth.pressure_Pa.clear();
  return judged;
}

}  // namespace

std::array<double, 3> truth_of(const Example& e) {
  return {e.size_mm, e.depth_mm, e.stiffness_ratio};
}
std::array<Value, 3> values_of(const Estimate& e) {
  return {e.size_mm, e.depth_mm, e.stiffness_ratio};
}

size_t count_judged(size_t examples, const EvaluationJob& job) {
  return job.first < examples ? ((examples - job.first - 1) / job.every + 1) * job.repeats : 0;
}

std::vector<Judged> judge_lumps(const std::vector<Example>& examples, const EvaluationJob& job) {
  return judged_by_team(count_judged(examples.size(), job), job.threads, job.progress, [&](size_t n) {
    const size_t i = job.first + n / job.repeats * job.every;
    return judge_reading(i, examples[i], job, job.seed * 1000003 + i + n % job.repeats * 0x9e3779b1ULL);
  });
}

Score score_of(const std::vector<Judged>& judged) {
  Score score;
  std::array<std::vector<double>, 3> errors, determined;
  std::array<size_t, 3> covered{};
  std::vector<double> walls, young_errors, place_errors;
  size_t young_covered = 0, place_covered = 0;
  size_t shapes_right = 0, found = 0, goal_found = 0, plain_right = 0;
  std::array<std::array<std::vector<double>, 3>, kRatioEdges.size() - 1> by_ratio;
  for (const Judged& j : judged) {
    const Estimate& e = j.estimate;
    walls.push_back(1e3 * e.wall_s);
    if (e.tissue) {
      const Value& young = e.tissue->young_Pa;
      young_errors.push_back(std::abs(young.value / j.truth.young_Pa - 1));
      young_covered += j.truth.young_Pa >= young.low && j.truth.young_Pa <= young.high;
    }
    const bool seen = e.detection_statistic >= 1;
    if (!j.truth.lump) {
      ++score.plain;
      ++score.plain_verdicts[static_cast<size_t>(e.verdict)];
      plain_right += !seen;
      continue;
    }
    ++score.lumps;
    ++score.verdicts[static_cast<size_t>(e.verdict)];
    found += seen;
    if (j.truth.size_mm >= kGoalSize_mm && j.truth.depth_mm <= kGoalDepth_mm) {
      ++score.goal_lumps;
      goal_found += seen;
    }
    if (!seen || e.verdict == Status::Unusable || !std::isfinite(e.size_mm.value)) continue;
    ++score.judged;
    const auto truth = truth_of(j.truth);
    const auto values = values_of(e);
    size_t range = 0;
    while (range + 2 < kRatioEdges.size() && truth[2] >= kRatioEdges[range + 1]) ++range;
    for (size_t p = 0; p < 3; ++p) {
      const double error = std::abs(values[p].value / truth[p] - 1);
      covered[p] += truth[p] >= values[p].low && truth[p] <= values[p].high;
      by_ratio[range][p].push_back(error);
      if (p == 2 && (truth[2] < 2 || truth[2] > 20)) continue;
      errors[p].push_back(error);
      if (e.verdict == Status::Found) determined[p].push_back(error);
    }
    const auto& [x_mm, y_mm] = j.truth.offset_mm;
    if (reports_numbers(e.verdict) && (x_mm != 0 || y_mm != 0))
      for (const auto& [place, at_mm] : {std::pair{e.x_mm, x_mm}, {e.y_mm, y_mm}}) {
        place_errors.push_back(std::abs(place.value - at_mm));
        place_covered += at_mm >= place.low && at_mm <= place.high;
      }
    ++score.shapes[static_cast<size_t>(j.truth.shape)][static_cast<size_t>(e.shape)];
    shapes_right += j.truth.shape == e.shape;
  }
  const auto fraction = [](size_t part, size_t whole) {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : kNaN;
  };
  for (size_t p = 0; p < 3; ++p) {
    score.median[p] = quantile(errors[p], 0.5);
    score.ninetieth[p] = quantile(errors[p], 0.9);
    score.determined_median[p] = quantile(determined[p], 0.5);
    score.coverage[p] = fraction(covered[p], score.judged);
  }
  for (size_t r = 0; r < by_ratio.size(); ++r) {
    ErrorRange range;
    range.low = kRatioEdges[r];
    range.high = kRatioEdges[r + 1];
    range.count = by_ratio[r][0].size();
    for (size_t p = 0; p < 3; ++p) range.median[p] = quantile(by_ratio[r][p], 0.5);
    score.by_ratio.push_back(range);
  }
  score.shape_rate = fraction(shapes_right, score.judged);
  score.sensitivity = fraction(found, score.lumps);
  score.goal_sensitivity = fraction(goal_found, score.goal_lumps);
  score.specificity = fraction(plain_right, score.plain);
  score.roc = roc_of(judged);
  score.places = place_errors.size();
  score.place_median_mm = quantile(place_errors, 0.5);
  score.place_ninetieth_mm = quantile(place_errors, 0.9);
  score.place_coverage = fraction(place_covered, score.places);
  score.tissues = young_errors.size();
  score.young_median = quantile(young_errors, 0.5);
  score.young_ninetieth = quantile(young_errors, 0.9);
  score.young_coverage = fraction(young_covered, score.tissues);
  score.wall_ms = quantile(walls, 0.5);
  score.wall_p95_ms = quantile(walls, 0.95);
  return score;
}

std::string score_text(const Score& s) {
  std::string text = palpate::text("%zu blocks with a lump, %zu without; %.2f ms each (95 %%: %.2f ms)\n\n",
                                   s.lumps, s.plain, s.wall_ms, s.wall_p95_ms);
  text += "                       size     depth   stiffness ratio (of 2 to 20)\n";
  const auto row = [&text](const char* name, const std::array<double, 3>& v) {
    text += palpate::text("%-20s %5.1f %%   %5.1f %%   %5.1f %%\n", name, 100 * v[0], 100 * v[1], 100 * v[2]);
  };
  row("median error", s.median);
  row("90 % of errors below", s.ninetieth);
  row("median, where found", s.determined_median);
  row("intervals hold", s.coverage);
  if (s.places > 0)
    text += palpate::text(
        "\ncentre off the middle, along x and y: median error %.2f mm, 90 %% of errors below %.2f mm, "
        "intervals hold %.0f %% of %zu\n",
        s.place_median_mm, s.place_ninetieth_mm, 100 * s.place_coverage, s.places);
  if (s.tissues > 0)
    text += palpate::text(
        "\nmodulus by the way of the plate: median error %.1f %%, 90 %% of errors below %.1f %%, intervals "
        "hold "
        "%.0f %% of %zu\n",
        100 * s.young_median, 100 * s.young_ninetieth, 100 * s.young_coverage, s.tissues);
  text += "\ntrue ratio     lumps   median error of size, depth, ratio\n";
  for (const ErrorRange& r : s.by_ratio)
    text += palpate::text("%3.0f to %-7s %5zu   %5.1f %%  %5.1f %%  %5.1f %%\n", r.low,
                          r.high < 1e8 ? palpate::text("%.0f", r.high).c_str() : "more", r.count,
                          100 * r.median[0], 100 * r.median[1], 100 * r.median[2]);
  text += palpate::text("\nshape right in %.1f %%; truth by answer:\n%-10s", 100 * s.shape_rate, "");
  for (size_t b = 0; b < 4; ++b) text += palpate::text(" %9s", to_string(static_cast<InclusionShape>(b)));
  for (size_t a = 0; a < 4; ++a) {
    text += palpate::text("\n%-10s", to_string(static_cast<InclusionShape>(a)));
    for (const size_t n : s.shapes[a]) text += palpate::text(" %9zu", n);
  }
  text += palpate::text(
      "\n\nlumps detected: %.1f %%; of 6 mm and more at 8 mm and less (%zu): %.1f %%; blocks without one "
      "told so: %.1f %%\n",
      100 * s.sensitivity, s.goal_lumps, 100 * s.goal_sensitivity, 100 * s.specificity);
  text += "verdicts (with a lump, without):";
  for (size_t v = 0; v < kStatuses; ++v)
    text += palpate::text("%s %s %zu, %zu", v > 0 ? ";" : "", to_string(static_cast<Status>(v)),
                          s.verdicts[v], s.plain_verdicts[v]);
  return text + "\n";
}

json::Value score_json(const Score& s, const std::string& method, const EvaluationJob& job) {
  using Json = json::Value;
  const auto three = [](const std::array<double, 3>& v) {
    return Json{{"size", v[0]}, {"depth", v[1]}, {"stiffness_ratio", v[2]}};
  };
  Json json{
      {"method", method},
      {"noise_share", job.sensor.noise_fraction},
      {"gauge_share", job.sensor.gauge_fraction},
      {"loads", job.loads},
      {"modulus_error", job.modulus_error},
      {"press_sd_mm", job.press_sd_mm},
      {"thickness_sd", job.thickness_sd},
      {"skin_told", job.skin_told},
      {"skin_sd", job.skin_sd},
      {"plate_told", job.plate_told},
      {"plate_sd", job.plate_sd},
      {"relaxes", job.relaxation.has_value()},
      {"relaxation_told", job.relaxation_told},
      {"tissues", s.tissues},
      {"young",
       {{"median_error", s.young_median}, {"p90_error", s.young_ninetieth}, {"coverage", s.young_coverage}}},
      {"first", job.first},
      {"every", job.every},
      {"seed", job.seed},
      {"lumps", s.lumps},
      {"without_lump", s.plain},
      {"judged", s.judged},
      {"median_error", three(s.median)},
      {"p90_error", three(s.ninetieth)},
      {"median_error_where_found", three(s.determined_median)},
      {"coverage", three(s.coverage)},
      {"place",
       {{"median_error_mm", s.place_median_mm},
        {"p90_error_mm", s.place_ninetieth_mm},
        {"coverage", s.place_coverage},
        {"places", s.places}}},
      {"shape_rate", s.shape_rate},
      {"shapes", s.shapes},
      {"sensitivity", s.sensitivity},
      {"goal_lumps", s.goal_lumps},
      {"goal_sensitivity", s.goal_sensitivity},
      {"specificity", s.specificity},
      {"wall_ms", s.wall_ms},
      {"wall_p95_ms", s.wall_p95_ms}};
  json["by_ratio"] = Json::array();
  for (const ErrorRange& r : s.by_ratio)
    json["by_ratio"].push_back({{"low", r.low},
                                {"high", r.high < 1e8 ? Json(r.high) : Json(nullptr)},
                                {"lumps", r.count},
                                {"median_error", three(r.median)}});
  json["verdicts"] = Json::object();
  for (size_t v = 0; v < kStatuses; ++v)
    json["verdicts"][to_string(static_cast<Status>(v))] = {{"lump", s.verdicts[v]},
                                                           {"none", s.plain_verdicts[v]}};
  json["roc"] = s.roc;
  return json;
}

}  // namespace palpate::lump
