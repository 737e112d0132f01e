#include "perf/lab/study/pairs/pair_interaction.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/text.h"
#include "engine/fem/large_strain/large_strain.h"

namespace palpate::lump {
namespace {

constexpr double kRimOfInteraction_mm = 1.5;  // nearer to the rim a grid's own error is larger

Interaction interaction_of(const std::array<const PressureMap*, 4>& both_one_two_none) {
  const auto& [both, one, two, none] = both_one_two_none;
  Interaction found;
  double most = 0, highest = 0, squares = 0, products = 0;
  for (uint32_t j = 0; j < both->height; ++j)
    for (uint32_t i = 0; i < both->width; ++i) {
      const double x = std::min(i, both->width - 1 - i) * both->pitch_mm[0],
                   y = std::min(j, both->height - 1 - j) * both->pitch_mm[1];
      if (std::min(x, y) < kRimOfInteraction_mm) continue;
      const double plain = double{none->at(i, j)};
      const double a = double{one->at(i, j)} - plain, b = double{two->at(i, j)} - plain,
                   beyond = double{both->at(i, j)} - plain - a - b;
      most = std::max(most, std::abs(beyond));
      highest = std::max({highest, a, b});
      squares += beyond * beyond;
      products += std::abs(a * b);
    }
  found.share = most / highest;
  found.over_both = std::sqrt(squares / products);
  return found;
}

}  // namespace

std::vector<Interaction> measure_interaction(const Data& data, uint32_t cells) {
  std::vector<Interaction> all;
  Sweep sweep = data.sweep;
  sweep.cells = {cells, cells, cells / 2};
  for (const Sample& sample : data.samples) {
    if (!sample.what.second || sample.pressure_Pa.empty()) continue;
    const std::vector<fem::PressLoad> loads = {{{}, 0.5 * sample.last_force_N}, {{}, sample.last_force_N}};
    fem::LargeStrainOptions options;
    options.residual = 1e-6;
    options.step_mm = sweep.step_mm;
    options.map_nodes = sweep.nodes;
    options.threads = 1;
    const fem::Scene both = scene_of(sweep, sample.what);
    fem::Scene one = both, two = both, none = both;
    for (fem::Scene* scene : {&one, &two, &none}) scene->others.clear();
    two.inclusion = both.others.at(0);
    none.inclusion.reset();
    const std::array<const fem::Scene*, 4> scenes = {&both, &one, &two, &none};
    std::array<fem::LargeStrainResult, 4> results;
    size_t least = loads.size();
    for (size_t s = 0; s < 4; ++s) {
      results[s] = solve_large_strain(*scenes[s], loads, options);
      least = std::min(least, results[s].loads.size());
    }
    const Case::Lump &first = *sample.what.lump, &second = *sample.what.second;
    for (size_t l = 0; l < least; ++l) {
      const auto map = [&](size_t s) { return &results[s].loads[l].pressure_Pa; };
      Interaction found = interaction_of({map(0), map(1), map(2), map(3)});
      found.number = sample.what.number;
      found.force_N = *loads[l].force_N;
      found.distance_over_size =
          2 * std::hypot(first.offset_mm[0] - second.offset_mm[0], first.offset_mm[1] - second.offset_mm[1]) /
          (first.diameter_mm + second.diameter_mm);
      all.push_back(found);
    }
  }
  std::sort(all.begin(), all.end(), [](const Interaction& a, const Interaction& b) {
    return a.distance_over_size < b.distance_over_size;
  });
  return all;
}

std::string interaction_text(const std::vector<Interaction>& measured) {
  std::string table = "block  distance over size  force, N  largest over the higher bump  RMS over both\n";
  for (const Interaction& i : measured)
    table += text("%5u %19.2f %9.3g %28.1f %% %12.3f\n", i.number, i.distance_over_size, i.force_N,
                  100 * i.share, i.over_both);
  return table;
}

json::Value interaction_json(const std::vector<Interaction>& measured) {
  json::Value rows = json::Value::array();
  for (const Interaction& i : measured)
    rows.push_back({{"block", i.number},
                    {"distance_over_size", i.distance_over_size},
                    {"force_N", i.force_N},
                    {"share", i.share},
                    {"over_both", i.over_both}});
  return {{"rows", rows}};
}

}  // namespace palpate::lump
