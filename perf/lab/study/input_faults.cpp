#include "perf/lab/study/input_faults.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "engine/base/json.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"

namespace palpate::lump {
namespace {

constexpr size_t kHonest = 10;  // draws of each block

/// One block's press; `slide_mm`: of the window from load to load.
struct Press {
  const Example& example;
  PalpationSensor sensor;
  uint32_t loads;
  uint64_t seed;

  Observation read(std::array<double, 2> last_mm = {0, 0}) const {
    const size_t all = example.force_N.size(), count = loads == 0 ? all : std::min<size_t>(loads, all);
    std::vector<PressureMap> maps;
    std::vector<double> forces;
    for (size_t k = 0; k < count; ++k) {
      const size_t load = all - 1 - (count - 1 - k) * all / count;
      maps.push_back(example.pressure_Pa[load]);
      forces.push_back(example.force_N[load]);
    }
    Observation observation =
        sensor_observation(maps, forces, example.block_mm, example.young_Pa, sensor, seed);
    if (last_mm != std::array<double, 2>{0, 0}) {
      PalpationSensor beside = sensor;
      for (size_t axis = 0; axis < 2; ++axis) beside.window_center_mm[axis] += last_mm[axis];
      observation.pressure_Pa.back() = sensor_observation({maps.back()}, {forces.back()}, example.block_mm,
                                                          example.young_Pa, beside, seed + 1)
                                           .pressure_Pa.back();
    }
    for (size_t k = 1; k < count; ++k)
      observation.force_N[k] = std::max(observation.force_N[k], 1.0001 * observation.force_N[k - 1]);
    return observation;
  }
};

Press seen_in(Press press, std::array<double, 2> window_mm, std::array<double, 2> center_mm = {0, 0}) {
  press.sensor.window_mm = window_mm;
  press.sensor.window_center_mm = center_mm;
  return press;
}

template <typename Change>
Observation each_map(Observation observation, const Change& change) {
  for (PressureMap& map : observation.pressure_Pa) change(map);
  return observation;
}

Observation with_pitch(Observation observation, double factor) {
  return each_map(std::move(observation), [factor](PressureMap& map) {
    for (double& pitch : map.pitch_mm) pitch *= factor;
  });
}

Observation with_pressures(Observation observation, double factor) {
  observation.noise_Pa *= factor;
  return each_map(std::move(observation), [factor](PressureMap& map) {
    for (float& value : map.values) value *= static_cast<float>(factor);
  });
}

Observation with_forces(Observation observation, double factor) {
  for (double& force : observation.force_N) force *= factor;
  return observation;
}

/// The nodes of the whole face from a corner on.
Observation part(Observation observation, uint32_t first, uint32_t side) {
  return each_map(std::move(observation), [&](PressureMap& map) {
    PressureMap cut{side, side, map.pitch_mm, {}};
    for (uint32_t y = 0; y < side; ++y)
      for (uint32_t x = 0; x < side; ++x) cut.values.push_back(map.at(first + x, first + y));
    map = std::move(cut);
  });
}

Observation tilted(Observation observation, double share) {
  return each_map(std::move(observation), [&](PressureMap& map) {
    for (uint32_t y = 0; y < map.height; ++y)
      for (uint32_t x = 0; x < map.width; ++x) {
        const double place = 2 * (x - (map.width - 1) / 2.0) * map.pitch_mm[0] / observation.block_mm[0];
        map.values[size_t{y} * map.width + x] *= static_cast<float>(1 + share * place);
      }
  });
}

Observation transposed(Observation observation) {
  return each_map(std::move(observation), [](PressureMap& map) {
    PressureMap turned{map.height, map.width, map.pitch_mm, {}};
    for (uint32_t x = 0; x < map.width; ++x)
      for (uint32_t y = 0; y < map.height; ++y) turned.values.push_back(map.at(x, y));
    map = std::move(turned);
  });
}

Observation told(Observation observation, const std::function<void(Observation&)>& wrong) {
  wrong(observation);
  return observation;
}

/// Window, noise, gauge and loads at random.
Observation honest(const Press& press, uint64_t draw) {
  std::mt19937_64 random(press.seed * 31 + draw);
  std::uniform_real_distribution<double> share(0, 1);
  Press any = press;
  const double kind = share(random);
  if (kind > 0.5) any.sensor.window_mm = {40, 40};
  if (kind > 0.75) {
    any.sensor.window_mm = {24 + 16 * share(random), 18 + 22 * share(random)};
    for (size_t axis = 0; axis < 2; ++axis)
      any.sensor.window_center_mm[axis] =
          press.example.offset_mm[axis] + (share(random) - 0.5) * any.sensor.window_mm[axis] / 2;
  }
  any.sensor.noise_fraction = 0.001 * std::pow(100, share(random));
  any.sensor.gauge_fraction = 0.002 * std::pow(5, share(random));
  any.loads = 1 + static_cast<uint32_t>(random() % 4);
  any.seed = random();
  return any.read();
}

struct NamedFault {
  const char* name;
  std::function<Observation(const Press&)> read;
  /// The same observation told right: what the moves are compared with. Null: as the job's sensor reads it.
  std::function<Observation(const Press&)> right = nullptr;
};

Observation whole(const Press& p) {
  return seen_in(p, {40, 40}).read();
}
Observation small(const Press& p) {
  return seen_in(p, {30, 25}).read();
}

/// A window whose true place differs from the stated one.
Observation displaced(const Press& p, std::array<double, 2> by_mm) {
  return told(seen_in(p, {30, 25}, by_mm).read(), [](Observation& o) { o.window_mm = {0, 0}; });
}

std::vector<NamedFault> geometry_faults() {
  return {
      {"none, window 40 x 30 mm", [](const Press& p) { return p.read(); }},
      {"none, whole face", whole, whole},
      {"none, window 30 x 25 mm", small, small},
      {"pitch 1 for 1.25 mm", [](const Press& p) { return with_pitch(p.read(), 0.8); }},
      {"pitch 1.56 for 1.25 mm", [](const Press& p) { return with_pitch(p.read(), 1.25); }},
      {"the same, whole face: 1 mm", [](const Press& p) { return with_pitch(whole(p), 0.8); }, whole},
      {"the same, whole face: 1.56 mm", [](const Press& p) { return with_pitch(whole(p), 1.25); }, whole},
      {"pitch 5 % small", [](const Press& p) { return with_pitch(p.read(), 0.95); }},
      {"pitch 5 % large", [](const Press& p) { return with_pitch(p.read(), 1.05); }},
      {"window 30 x 25 mm off by 3, 0 mm",
       [](const Press& p) {
         return displaced(p, {3, 0});
       },
       small},
      {"off by 2.1, 2.1 mm",
       [](const Press& p) {
         return displaced(p, {2.1, 2.1});
       },
       small},
      {"off by 5, 0 mm",
       [](const Press& p) {
         return displaced(p, {5, 0});
       },
       small},
      {"window 40 x 30 mm stated 3 mm off",
       [](const Press& p) { return told(p.read(), [](Observation& o) {
                              o.window_mm = {3, 0};
                            }); }},
      {"a corner's 26 mm told as the middle", [](const Press& p) { return part(whole(p), 0, 21); }, whole},
      {"the middle's 26 mm told as the face",
       [](const Press& p) { return with_pitch(part(whole(p), 5, 21), 40 / (21 * 1.25)); }, whole},
      {"rows for columns", [](const Press& p) { return transposed(p.read()); }},
      {"plate tilted, 10 % at the rim", [](const Press& p) { return tilted(p.read(), 0.1); }},
      {"last load slid by 2 mm",
       [](const Press& p) {
         return p.read({0, 2});
       }},
  };
}

std::vector<NamedFault> quantity_faults() {
  return {
      {"pressures in kPa", [](const Press& p) { return with_pressures(p.read(), 1e-3); }},
      {"pressures in mmHg", [](const Press& p) { return with_pressures(p.read(), 1 / 133.322); }},
      {"pressures in N/mm2", [](const Press& p) { return with_pressures(p.read(), 1e-6); }},
      {"forces in mN", [](const Press& p) { return with_forces(p.read(), 1e3); }},
      {"forces in gf", [](const Press& p) { return with_forces(p.read(), 1 / 9.80665e-3); }},
      {"modulus in kPa",
       [](const Press& p) { return told(p.read(), [](Observation& o) { o.young_Pa *= 1e-3; }); }},
      {"two loads exchanged",
       [](const Press& p) {
         return told(p.read(), [](Observation& o) {
           if (o.pressure_Pa.size() > 2) std::swap(o.pressure_Pa[1], o.pressure_Pa[2]);
         });
       }},
      {"loads in reverse",
       [](const Press& p) {
         return told(p.read(),
                     [](Observation& o) { std::reverse(o.pressure_Pa.begin(), o.pressure_Pa.end()); });
       }},
      {"one force 20 % high",
       [](const Press& p) {
         return told(p.read(), [](Observation& o) { o.force_N[o.force_N.size() / 3] *= 1.2; });
       }},
      {"last force 15 % high",
       [](const Press& p) { return told(p.read(), [](Observation& o) { o.force_N.back() *= 1.15; }); }},
      {"pressures 5 % high", [](const Press& p) { return with_pressures(p.read(), 1.05); }},
      {"pressures 20 % high", [](const Press& p) { return with_pressures(p.read(), 1.2); }},
      {"thickness 10 % low",
       [](const Press& p) { return told(p.read(), [](Observation& o) { o.block_mm[2] *= 0.9; }); }},
      {"thickness 10 % high",
       [](const Press& p) { return told(p.read(), [](Observation& o) { o.block_mm[2] *= 1.1; }); }},
      {"modulus 30 % low",
       [](const Press& p) { return told(p.read(), [](Observation& o) { o.young_Pa *= 0.7; }); }},
      {"modulus 30 % high",
       [](const Press& p) { return told(p.read(), [](Observation& o) { o.young_Pa *= 1.3; }); }},
  };
}

std::vector<NamedFault> faults() {
  std::vector<NamedFault> all = geometry_faults(), more = quantity_faults();
  std::move(more.begin(), more.end(), std::back_inserter(all));
  return all;
}

FaultRow row_of(const NamedFault& fault, const std::vector<Press>& presses, const EvaluationJob& job,
                const std::function<void()>& done) {
  FaultRow row{fault.name, presses.size(), 0, 0, {}};
  std::array<std::vector<double>, 3> moves;
  for (const Press& press : presses) {
    const Estimate wrong = job.estimator(fault.read(press));
    row.inconsistent += wrong.verdict == Status::Inconsistent;
    row.numbers += reports_numbers(wrong.verdict);
    if (reports_numbers(wrong.verdict)) {
      const Estimate right = job.estimator(fault.right ? fault.right(press) : press.read());
      const auto a = values_of(right), b = values_of(wrong);
      for (size_t p = 0; p < 3 && reports_numbers(right.verdict); ++p)
        moves[p].push_back(b[p].value / a[p].value - 1);
    }
    done();
  }
  for (double* share : {&row.inconsistent, &row.numbers})
    *share /= static_cast<double>(std::max<size_t>(1, presses.size()));
  for (size_t p = 0; p < 3; ++p)
    row.move[p] = moves[p].empty() ? std::numeric_limits<double>::quiet_NaN() : median(moves[p]);
  return row;
}

}  // namespace

size_t fault_count() {
  return faults().size() + kHonest;
}

std::vector<FaultRow> fault_rows(const std::vector<Example>& examples, const EvaluationJob& job) {
  std::vector<Press> presses;
  for (size_t i = job.first; i < examples.size(); i += job.every)
    presses.push_back({examples[i], job.sensor, job.loads, job.seed * 1000003 + i});
  size_t count = 0;
  const auto done = [&] {
    if (job.progress && !job.progress(++count)) throw Stopped();
  };
  std::vector<FaultRow> rows(1);
  FaultRow& drawn = rows.front();
  drawn.fault = "none, sensors drawn at random";
  drawn.blocks = presses.size() * kHonest;
  drawn.move.fill(std::numeric_limits<double>::quiet_NaN());
  for (const Press& press : presses)
    for (size_t draw = 0; draw < kHonest; ++draw) {
      const Estimate estimate = job.estimator(honest(press, draw));
      drawn.inconsistent += (estimate.verdict == Status::Inconsistent) / static_cast<double>(drawn.blocks);
      drawn.numbers += reports_numbers(estimate.verdict) / static_cast<double>(drawn.blocks);
      done();
    }
  for (const NamedFault& fault : faults()) rows.push_back(row_of(fault, presses, job, done));
  return rows;
}

std::string faults_text(const std::vector<FaultRow>& rows) {
  std::string all =
      "fault                                 blocks  inconsistent  numbers all the same  move of d, h, E_r\n";
  for (const FaultRow& r : rows)
    all += text("%-38s %5zu    %5.1f %%       %5.1f %%             %+5.1f %% %+5.1f %% %+6.1f %%\n",
                r.fault.c_str(), r.blocks, 100 * r.inconsistent, 100 * r.numbers, 100 * r.move[0],
                100 * r.move[1], 100 * r.move[2]);
  return all;
}

std::string faults_csv(const std::vector<FaultRow>& rows) {
  std::string csv = "fault,blocks,inconsistent,numbers,size_move,depth_move,ratio_move\n";
  for (const FaultRow& r : rows) {
    csv += "\"" + r.fault + text("\",%zu,%.5g,%.5g", r.blocks, r.inconsistent, r.numbers);
    for (const double move : r.move) csv += "," + (std::isfinite(move) ? text("%.5g", move) : std::string());
    csv += "\n";
  }
  return csv;
}

json::Value faults_json(const std::vector<FaultRow>& rows) {
  auto json = json::Value::array();
  for (const FaultRow& r : rows)
    json.push_back({{"fault", r.fault},
                    {"blocks", r.blocks},
                    {"inconsistent", r.inconsistent},
                    {"numbers", r.numbers},
                    {"size_move", r.move[0]},
                    {"depth_move", r.move[1]},
                    {"ratio_move", r.move[2]}});
  return json;
}

}  // namespace palpate::lump
