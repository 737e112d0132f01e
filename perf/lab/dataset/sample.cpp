#include "perf/lab/dataset/sample.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "engine/fem/large_strain/extrapolation.h"
#include "palpate/error.h"
#include "perf/lab/dataset/pair_press.h"

namespace palpate::lump {
namespace {

constexpr double kNotReached = std::numeric_limits<double>::quiet_NaN();

struct Head {
  uint32_t number, state, steps, cuts, newton_rounds, iterations, reached, reserved;
  double last_press_mm, last_force_N;
};

size_t map_values(const Sweep& sweep) {
  return size_t{sweep.nodes[0]} * sweep.nodes[1];
}

}  // namespace

fem::LargeStrainResult press_lump(const fem::Scene& scene, const std::array<uint32_t, 3>& coarser_cells,
                                  const std::vector<fem::PressLoad>& loads,
                                  const fem::LargeStrainOptions& options) {
  if (!scene.others.empty() && coarser_cells[0] != 0) return press_pair(scene, coarser_cells, loads, options);
  return coarser_cells[0] != 0 ? solve_extrapolated(scene, coarser_cells, loads, options)
                               : solve_large_strain(scene, loads, options);
}

std::optional<Sample> press_case(const Sweep& sweep, uint32_t number, const Presser& presser,
                                 const std::function<bool()>& stop) {
  Sample sample;
  sample.what = lump_case(sweep, number);
  std::vector<fem::PressLoad> loads;
  for (const double press_mm : sample.what.press_mm) loads.push_back({press_mm, std::nullopt});
  fem::LargeStrainOptions options;
  options.residual = sweep.residual;
  options.step_mm = sweep.step_mm;
  options.map_nodes = in_scene_axes(sample.what, sweep.nodes);
  options.threads = 1;
  options.stop = stop;
  fem::LargeStrainResult result =
      presser(scene_of(sweep, sample.what), in_scene_axes(sample.what, sweep.coarser_cells), loads, options);
  if (!result.converged && stop && stop()) return std::nullopt;

  sample.state = result.converged ? State::Good : State::NotConverged;
  sample.last_press_mm = result.last_press_mm;
  sample.last_force_N = result.last_force_N;
  sample.steps = result.steps;
  sample.cuts = result.cuts;
  sample.newton_rounds = result.newton_rounds;
  sample.iterations = result.iterations;
  for (auto* values : {&sample.force_N, &sample.residual, &sample.least_volume_ratio})
    values->assign(loads.size(), kNotReached);
  for (size_t l = 0; l < result.loads.size(); ++l) {
    fem::PressedBlock& load = result.loads[l];
    sample.force_N[l] = load.force_N;
    sample.residual[l] = load.residual;
    sample.least_volume_ratio[l] = load.least_volume_ratio;
    sample.pressure_Pa.push_back(in_case_axes(sample.what, std::move(load.pressure_Pa)));
    if (sample.pressure_Pa.back().width != sweep.nodes[0] ||
        sample.pressure_Pa.back().height != sweep.nodes[1])
      throw std::logic_error("a map of another size than the sweep's");
  }
  return sample;
}

size_t packed_bytes(const Sweep& sweep) {
  return sizeof(Head) + sweep.loads * (3 * sizeof(double) + map_values(sweep) * sizeof(float));
}

std::string pack(const Sweep& sweep, const Sample& sample) {
  std::string bytes(packed_bytes(sweep), '\0');
  char* to = bytes.data();
  const auto put = [&to](const void* from, size_t count) {
    std::memcpy(to, from, count);
    to += count;
  };
  const Head head{sample.what.number,
                  static_cast<uint32_t>(sample.state),
                  sample.steps,
                  sample.cuts,
                  sample.newton_rounds,
                  sample.iterations,
                  static_cast<uint32_t>(sample.pressure_Pa.size()),
                  0,
                  sample.last_press_mm,
                  sample.last_force_N};
  put(&head, sizeof head);
  for (const auto* values : {&sample.force_N, &sample.residual, &sample.least_volume_ratio})
    put(values->data(), sweep.loads * sizeof(double));
  for (const PressureMap& map : sample.pressure_Pa) put(map.values.data(), map.values.size() * sizeof(float));
  return bytes;
}

Sample unpack(const Sweep& sweep, const std::string& bytes) {
  const auto refuse = [](const std::string& found) -> Error {
    return {Failure::Input, "a case of this sweep", found, "the file that the sweep wrote"};
  };
  if (bytes.size() != packed_bytes(sweep)) throw refuse(std::to_string(bytes.size()) + " bytes");
  const char* from = bytes.data();
  const auto get = [&from](void* to, size_t count) {
    std::memcpy(to, from, count);
    from += count;
  };
  Head head{};
  get(&head, sizeof head);
  if (head.reached > sweep.loads || head.state < 1 || head.state > 2) throw refuse("other bytes");
  Sample sample;
  sample.what = lump_case(sweep, head.number);
  sample.state = static_cast<State>(head.state);
  sample.last_press_mm = head.last_press_mm;
  sample.last_force_N = head.last_force_N;
  sample.steps = head.steps;
  sample.cuts = head.cuts;
  sample.newton_rounds = head.newton_rounds;
  sample.iterations = head.iterations;
  for (auto* values : {&sample.force_N, &sample.residual, &sample.least_volume_ratio}) {
    values->resize(sweep.loads);
    get(values->data(), sweep.loads * sizeof(double));
  }
  for (uint32_t l = 0; l < head.reached; ++l) {
    PressureMap map;
    map.width = sweep.nodes[0];
    map.height = sweep.nodes[1];
    map.pitch_mm = sweep.pitch_mm();
    map.values.resize(map_values(sweep));
    get(map.values.data(), map.values.size() * sizeof(float));
    sample.pressure_Pa.push_back(std::move(map));
  }
  return sample;
}

}  // namespace palpate::lump
