#include "perf/lab/study/evaluation_cells.h"

#include <cmath>

#include "engine/base/numbers.h"

namespace palpate::lump {
namespace {

constexpr double kWrongFactor = 2;

bool far_off(const judge::JudgedValue& v) {
  const bool outside = v.truth < v.low || v.truth > v.high;
  return outside && std::abs(std::log(v.value / v.truth)) > std::log(kWrongFactor);
}

judge::JudgedCase case_of(const Judged& j) {
  judge::JudgedCase one;
  one.reported = reports_numbers(j.estimate.verdict);
  if (!j.truth.lump) {
    one.conditions.assign(6, kNaN);
    one.values.assign(3, {kNaN, kNaN, kNaN, kNaN});
    one.wrong = true;
    return one;
  }
  const Example& e = j.truth;
  one.conditions = {e.size_mm,
                    e.depth_mm,
                    e.stiffness_ratio,
                    e.block_mm[2],
                    std::hypot(e.offset_mm[0], e.offset_mm[1]),
                    static_cast<double>(e.shape)};
  const std::array<double, 3> truth = truth_of(e);
  const std::array<Value, 3> values = values_of(j.estimate);
  for (size_t p = 0; p < 3; ++p) {
    const bool stated = p < 2 || j.estimate.verdict != Status::StiffnessOpen;
    const judge::JudgedValue v{truth[p], values[p].value, values[p].low, values[p].high};
    one.wrong = one.wrong || (stated && far_off(v));
    one.values.push_back(v);
    if (!stated) one.values.back().value = kNaN;
  }
  return one;
}

}  // namespace

judge::Cases cases_of(const std::vector<Judged>& judged) {
  judge::Cases cases;
  cases.conditions = {{"size_mm", {}},      {"depth_mm", {}},  {"ratio", {}},
                      {"thickness_mm", {}}, {"offset_mm", {}}, {"shape", {}}};
  for (size_t s = 0; s < 4; ++s)
    cases.conditions.back().labels.emplace_back(to_string(static_cast<InclusionShape>(s)));
  cases.quantities = {{"size_mm", 0.9}, {"depth_mm", 0.9}, {"ratio", 0.9}};
  cases.wrong_means = "off by more than a factor of two and outside the interval, or no lump there";
  for (const Judged& j : judged) cases.cases.push_back(case_of(j));
  return cases;
}

}  // namespace palpate::lump
