#include "perf/lab/study/stability.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "engine/base/text.h"
#include "engine/fem/large_strain/extrapolation.h"
#include "engine/fem/large_strain/large_strain.h"
#include "engine/fem/solve.h"

namespace palpate::lump {
namespace {

constexpr std::array<uint32_t, 3> kCells = {56, 56, 28}, kCellsOfPlate = {48, 48, 24},
                                  kCoarserOfStraight = {40, 40, 20};
constexpr double kOnFloor = 0.02;  // of the thickness: a lump that is so near touches the floor
constexpr double kDeepest = 0.2;   // of the thickness
constexpr uint32_t kLoads = 4;

struct Pressed {
  fem::Scene scene;
  fem::LargeStrainResult result;
};

bool same_block(const fem::Scene& a, const fem::Scene& b) {
  const auto same = [](const fem::Inclusion& x, const fem::Inclusion& y) {
    return x.shape == y.shape && x.size_mm == y.size_mm && x.depth_mm == y.depth_mm &&
           x.stiffness_ratio == y.stiffness_ratio && x.offset_mm == y.offset_mm;
  };
  return a.block_mm == b.block_mm && a.cells == b.cells && a.plate_half_mm == b.plate_half_mm &&
         a.plate_sticks == b.plate_sticks && a.plate_friction == b.plate_friction &&
         a.young_Pa == b.young_Pa && a.poisson == b.poisson &&
         a.inclusion.has_value() == b.inclusion.has_value() &&
         (!a.inclusion || same(*a.inclusion, *b.inclusion)) && a.others.size() == b.others.size() &&
         std::equal(a.others.begin(), a.others.end(), b.others.begin(), same);
}

fem::LargeStrainResult press(const fem::Scene& scene, uint32_t threads) {
  std::vector<fem::PressLoad> loads;
  for (uint32_t l = 1; l <= kLoads; ++l)
    loads.push_back({kDeepest * scene.block_mm[2] * l / kLoads, std::nullopt});
  fem::LargeStrainOptions options;
  options.threads = threads;
  options.residual = 1e-5;
  options.step_mm = 2;
  options.map_nodes = {33, 33};
  // Between a lump and the floor that it touches there is no room for cells that follow it: of these two
  // grids none can.
  const bool touches = scene.inclusion && scene.inclusion->depth_mm + scene.inclusion->size()[2] >
                                              scene.block_mm[2] * (1 - kOnFloor);
  if (touches) return solve_extrapolated(scene, kCoarserOfStraight, loads, options);
  return solve_extrapolated(scene, loads, options);
}

constexpr double kEndOfRatios = 39.5;  // the network knows ratios to 40: an interval that ends there is open

/// Cases around one, each with a change of its own.
class CaseList {
 public:
  explicit CaseList(StabilityCase middle) : middle_(std::move(middle)) {}

  template <typename Change>
  void add(const char* group, const std::string& name, const Change& change) {
    cases.push_back(middle_);
    cases.back().group = group;
    cases.back().name = name;
    change(cases.back());
  }
  /// A ball in tissue of another thickness.
  void add_ball(const char* group, const std::string& name, double size_mm, double depth_mm,
                double thickness_mm, double ratio = 6) {
    add(group, name, [&](StabilityCase& c) {
      c.scene.inclusion->size_mm = {size_mm, size_mm, size_mm};
      c.scene.inclusion->depth_mm = depth_mm;
      c.scene.inclusion->stiffness_ratio = ratio;
      c.scene.block_mm[2] = thickness_mm;
    });
  }

  std::vector<StabilityCase> cases;

 private:
  StabilityCase middle_;
};

/// Lumps that touch the floor, and in tissue thinner than twice the lump.
void add_thin(CaseList& list) {
  list.add_ball("floor", "8 mm, 12 mm deep, in 20 mm", 8, 12, 20);
  list.add_ball("floor", "8 mm, 8 mm deep, in 16 mm", 8, 8, 16);
  list.add_ball("floor", "12 mm, 8 mm deep, in 20 mm", 12, 8, 20);
  list.add_ball("floor", "12 mm, 8 mm deep, in 20 mm, E_r 1e4", 12, 8, 20, 1e4);
  list.add_ball("thin tissue", "8 mm, 2 mm deep, in 12 mm", 8, 2, 12);
  list.add_ball("thin tissue", "9 mm, 4 mm deep, in 16 mm", 9, 4, 16);
  list.add_ball("thin tissue", "11 mm, 3 mm deep, in 18 mm", 11, 3, 18);
}

/// Plates that are smaller than the block, that rub, and that hold the tissue sideways.
void add_plates(CaseList& list) {
  const auto small = [](StabilityCase& c) {
    c.scene.cells = kCellsOfPlate;
    c.scene.plate_half_mm = {10, 10};
    c.sensor.window_mm = {20, 20};
  };
  list.add("plate", "20 x 20 mm on 40 x 40", small);
  list.add("plate", "the same, block told as 20 x 20", [&](StabilityCase& c) {
    small(c);
    c.reported_block_mm = {20, 20};
  });
  list.add("plate", "20 x 20 mm on 40 x 40, no lump", [&](StabilityCase& c) {
    small(c);
    c.scene.inclusion.reset();
  });
  for (const double friction : {0.03, 0.1, 0.3})
    for (const bool told : {false, true})
      list.add("plate", text("friction %g", friction) + (told ? ", told" : ""), [&](StabilityCase& c) {
        c.scene.plate_friction = friction;
        c.plate_told = told;
      });
  list.add("plate", "friction 0.1, no lump", [](StabilityCase& c) {
    c.scene.plate_friction = 0.1;
    c.scene.inclusion.reset();
  });
  for (const bool lump : {true, false})
    for (const bool told : {false, true})
      list.add("plate", std::string("sticks") + (lump ? "" : ", no lump") + (told ? ", told" : ""),
               [&](StabilityCase& c) {
                 c.scene.plate_sticks = true;
                 c.plate_told = told;
                 if (!lump) c.scene.inclusion.reset();
               });
}

}  // namespace

std::string StabilityRow::misses_of(const Estimate& of) const {
  if (!reports_numbers(of.verdict)) return "";
  if (!what.scene.inclusion) return "false alarm";
  const fem::Inclusion& lump = *what.scene.inclusion;
  std::string missed;
  const auto judge = [&](const char* name, double truth, const Value& v) {
    if (truth < v.low || truth > v.high) missed += (missed.empty() ? "" : ", ") + std::string(name);
  };
  judge("size", lump.size()[0], of.size_mm);
  judge("depth", lump.depth_mm, of.depth_mm);
  const bool open = of.stiffness_ratio.high > kEndOfRatios;
  judge("ratio", open ? std::min(lump.stiffness_ratio, of.stiffness_ratio.high) : lump.stiffness_ratio,
        of.stiffness_ratio);
  return missed;
}

std::vector<StabilityCase> stability_cases(double noise) {
  StabilityCase middle;
  middle.scene.cells = kCells;
  middle.scene.inclusion->stiffness_ratio = 6;
  middle.sensor.noise_fraction = noise;
  middle.sensor.gauge_fraction = 0.001;
  CaseList list(middle);
  const auto add = [&](const char* group, const std::string& name, const auto& change) {
    list.add(group, name, change);
  };
  add("reference", "sphere 8 mm, 5 mm deep, E_r 6", [](StabilityCase&) {});
  for (const double ratio : {0.1, 0.5, 1.5, 3.0, 12.0, 30.0, 100.0, 1e4})
    add("stiffness ratio", text("E_r %g", ratio),
        [&](StabilityCase& c) { c.scene.inclusion->stiffness_ratio = ratio; });
  for (const double poisson : {0.45, 0.48, 0.499, 0.4999})
    add("Poisson's ratio", text("nu %g", poisson), [&](StabilityCase& c) { c.scene.poisson = poisson; });
  add("Poisson's ratio", "nu 0.4999, E_r 10000", [](StabilityCase& c) {
    c.scene.poisson = 0.4999;
    c.scene.inclusion->stiffness_ratio = 1e4;
  });
  for (const double depth : {0.0, 1.0, 9.0})
    add("depth", text("%g mm deep", depth), [&](StabilityCase& c) { c.scene.inclusion->depth_mm = depth; });
  add("size", "16 mm, 2 mm deep", [](StabilityCase& c) {
    c.scene.inclusion->size_mm = {16, 16, 16};
    c.scene.inclusion->depth_mm = 2;
  });
  add("size", "window of 10 x 7.5 mm on a lump of 14", [](StabilityCase& c) {
    c.scene.inclusion->size_mm = {14, 14, 14};
    c.scene.inclusion->depth_mm = 3;
    c.sensor.window_mm = {10, 7.5};
  });
  add("number", "no lump", [](StabilityCase& c) { c.scene.inclusion.reset(); });
  for (const double apart : {10.0, 16.0, 24.0})
    add("number", text("two, %g mm apart", apart), [&](StabilityCase& c) {
      c.scene.inclusion->offset_mm = {-apart / 2, 0};
      c.scene.others = {*c.scene.inclusion};
      c.scene.others[0].offset_mm = {apart / 2, 0};
    });
  for (const double fraction : {0.001, 0.002, 0.005, 0.01, 0.03, 0.1})
    add("noise", text("%g %% of the peak", 100 * fraction),
        [&](StabilityCase& c) { c.sensor.noise_fraction = fraction; });
  add("sensor", "saturated at 80 % of the peak", [](StabilityCase& c) { c.sensor.exposure = 1 / 0.8; });
  for (const double peak : {1.5, 2.0, 3.0})
    add("sensor", text("peak at %g %% of full scale", 100 * peak),
        [&](StabilityCase& c) { c.sensor.exposure = peak; });
  add("sensor", "the same at the last load alone", [](StabilityCase& c) {
    c.sensor.exposure = 3;
    c.loads = 1;
  });
  for (const double reported : {0.7, 0.9, 1.1, 1.3})
    add("tissue modulus", text("told %+.0f %%", 100 * (reported - 1)),
        [&](StabilityCase& c) { c.reported_modulus = reported; });
  for (const uint32_t loads : {1u, 2u})
    add("loads", std::to_string(loads) + " of 4", [&](StabilityCase& c) { c.loads = loads; });
  add_thin(list);
  add_plates(list);
  return std::move(list.cases);
}

std::vector<StabilityRow> judge_stability(const std::vector<StabilityCase>& cases, const Estimator& estimator,
                                          uint64_t seed, uint32_t threads,
                                          const std::function<void(uint64_t done)>& progress) {
  std::vector<Pressed> solved;
  std::vector<StabilityRow> rows;
  for (const StabilityCase& what : cases) {
    auto block = std::find_if(solved.begin(), solved.end(),
                              [&](const Pressed& p) { return same_block(p.scene, what.scene); });
    if (block == solved.end()) {
      solved.push_back({what.scene, press(what.scene, threads)});
      block = solved.end() - 1;
    }
    StabilityRow row{what, block->result.converged, {}};
    if (row.pressed) {
      std::vector<PressureMap> maps;
      std::vector<double> forces;
      for (size_t l = kLoads - what.loads; l < kLoads; ++l) {
        maps.push_back(block->result.loads[l].pressure_Pa);
        forces.push_back(block->result.loads[l].force_N);
      }
      Observation seen = sensor_observation(maps, forces, what.scene.block_mm,
                                            what.reported_modulus * what.scene.young_Pa, what.sensor, seed);
      if (what.reported_block_mm)
        seen.block_mm = {(*what.reported_block_mm)[0], (*what.reported_block_mm)[1], what.scene.block_mm[2]};
      if (what.plate_told) seen.plate = Plate{what.scene.plate_sticks, what.scene.plate_friction, 0};
      row.estimate = estimator(seen);
    } else {
      row.estimate.reasons = block->result.warnings;
    }
    rows.push_back(std::move(row));
    progress(rows.size());
  }
  return rows;
}

std::vector<Example> pressed_balls(uint32_t threads, const std::function<void(uint64_t done)>& progress) {
  std::vector<Example> examples;
  uint64_t done = 0;
  for (const double size_mm : {6.0, 8.0, 12.0})
    for (const double depth_mm : {3.0, 6.0})
      for (const double ratio : {3.0, 10.0}) {
        fem::Scene scene;
        scene.cells = kCells;
        scene.inclusion->size_mm = {size_mm, size_mm, size_mm};
        scene.inclusion->depth_mm = depth_mm;
        scene.inclusion->stiffness_ratio = ratio;
        const fem::LargeStrainResult result = press(scene, threads);
        progress(++done);
        if (!result.converged) continue;
        Example example;
        example.size_mm = size_mm;
        example.depth_mm = depth_mm;
        example.stiffness_ratio = ratio;
        for (const fem::PressedBlock& load : result.loads) {
          example.pressure_Pa.push_back(load.pressure_Pa);
          example.force_N.push_back(load.force_N);
        }
        examples.push_back(std::move(example));
      }
  return examples;
}

std::vector<CostRow> press_costs(uint32_t threads) {
  fem::Scene scene;
  scene.inclusion->stiffness_ratio = 6;
  const double way = kDeepest * scene.block_mm[2];
  fem::LargeStrainOptions options;
  options.threads = threads;
  options.residual = 1e-5;
  options.step_mm = 2;
  options.map_nodes = {33, 33};
  const std::vector<fem::PressLoad> loads = {{way, std::nullopt}};
  const auto cells = [](uint32_t n) { return std::array<uint32_t, 3>{n, n, n / 2}; };
  scene.cells = cells(64);
  const fem::PressedBlock truth = solve_extrapolated(scene, cells(48), loads, options).loads.at(0);
  std::vector<CostRow> rows;
  const auto add = [&](const char* choice, const std::string& name, double wall_s, const PressureMap& map,
                       double force_N) {
    CostRow row{choice, name, wall_s, 0, force_N / truth.force_N - 1};
    const auto at = [](const PressureMap& m, uint32_t x, uint32_t y) {
      return double{m.at(x * (m.width - 1) / 32, y * (m.height - 1) / 32)};
    };
    for (uint32_t y = 8; y <= 24; ++y)
      for (uint32_t x = 8; x <= 24; ++x)
        row.map_error = std::max(row.map_error, std::abs(at(map, x, y) - at(truth.pressure_Pa, x, y)) /
                                                    at(truth.pressure_Pa, 16, 16));
    rows.push_back(row);
  };
  for (const uint32_t n : {16u, 24u, 32u, 48u}) {
    scene.cells = cells(n);
    const fem::LargeStrainResult one = solve_large_strain(scene, loads, options);
    if (one.converged)
      add("grid", std::to_string(n) + " x " + std::to_string(n) + " x " + std::to_string(n / 2), one.wall_s,
          one.loads[0].pressure_Pa, one.loads[0].force_N);
  }
  for (const auto& [fine, coarse] :
       {std::pair{24u, 16u}, std::pair{32u, 24u}, std::pair{40u, 24u}, std::pair{48u, 32u}}) {
    scene.cells = cells(fine);
    const fem::LargeStrainResult two = solve_extrapolated(scene, cells(coarse), loads, options);
    if (two.converged)
      add("two grids", std::to_string(fine) + " and " + std::to_string(coarse) + " along x", two.wall_s,
          two.loads[0].pressure_Pa, two.loads[0].force_N);
  }
  scene.cells = cells(32);
  scene.press_mm = way;
  fem::Options linear;
  linear.threads = threads;
  const fem::Result small = fem::solve(scene, linear);
  if (small.converged)
    add("strain", "small strain, 32 x 32 x 16", small.wall_s, small.stress_Pa, small.force_N);
  return rows;
}

}  // namespace palpate::lump
