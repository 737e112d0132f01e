#include "engine/lump/skin/skin_effect.h"

#include <algorithm>
#include <cmath>

#include "engine/base/text.h"
#include "engine/fem/large_strain/extrapolation.h"
#include "engine/fem/large_strain/large_strain.h"
#include "engine/lump/observation/long_axis.h"
#include "engine/lump/observation/map_at_load.h"
#include "engine/numeric/through_origin.h"
#include "engine/tissue/map_sampling.h"

namespace palpate::lump {
namespace {

using Cells = std::array<uint32_t, 3>;

constexpr Cells kCells = {24, 24, 12};       // of bumps, which follow the lump, and of a rough block alone
constexpr Cells kPlainCells = {36, 36, 18};  // of the block alone, extrapolated with kCells
constexpr Cells kQuickCells = {12, 12, 6};   // that tell about how far to press
constexpr double kPoisson = 0.495;
constexpr double kStep_mm = 2, kResidual = 1e-5;
constexpr int kWays = 4;                 // of each press, in even steps
constexpr uint32_t kNodes = 33;          // of the maps along a side
constexpr double kLeastTissue_mm = 0.3;  // between skin and lump, and below the lump
constexpr std::array<double, 2> kFactor = {0.05, 20};
constexpr int kMostRounds = 6;
constexpr double kSettled = 0.01, kSettledRatio = 0.03;  // of size and depth, of the ratio
constexpr double kYoungSettled = 2e-3;

/// A value at a place from a map's middle; beyond its nodes there is none.
double value_at(const PressureMap& map, double x_mm, double y_mm) {
  if (std::abs(x_mm) > map.pitch_mm[0] * (map.width - 1) / 2.0 ||
      std::abs(y_mm) > map.pitch_mm[1] * (map.height - 1) / 2.0)
    return 0;
  return map_at(map, x_mm, y_mm);
}

/// Calls `take(node, x, y)` for each node of a map, places from the block's middle.
template <typename Take>
void each_node(const PressureMap& map, const std::array<double, 2>& window_mm, const Take& take) {
  for (uint32_t j = 0; j < map.height; ++j)
    for (uint32_t i = 0; i < map.width; ++i)
      take(size_t{j} * map.width + i, window_mm[0] + (i - (map.width - 1) / 2.0) * map.pitch_mm[0],
           window_mm[1] + (j - (map.height - 1) / 2.0) * map.pitch_mm[1]);
}

/// Mean of a map over a square of the pitch around a place, which is what an observation's node has.
double mean_at(const PressureMap& map, double x_mm, double y_mm, const std::array<double, 2>& pitch_mm) {
  const double gauss = 0.5 / std::sqrt(3.0), dx = gauss * pitch_mm[0], dy = gauss * pitch_mm[1];
  double sum = 0;
  for (const double x : {x_mm - dx, x_mm + dx})
    for (const double y : {y_mm - dy, y_mm + dy}) sum += map_at(map, x, y);
  return sum / 4;
}

void subtract(PressureMap& from, const PressureMap& map) {
  for (size_t n = 0; n < from.values.size(); ++n) from.values[n] -= map.values[n];
}

fem::LargeStrainOptions press_options() {
  fem::LargeStrainOptions options;
  options.residual = kResidual;
  options.step_mm = kStep_mm;
  options.threads = 1;
  options.map_nodes = {kNodes, kNodes};
  return options;
}

/// Lumps of an estimate that are worth a press.
std::vector<Case::Lump> lumps_in(const Estimate& estimate, const Observation& observation) {
  std::vector<Case::Lump> lumps;
  const auto add = [&](const Estimate& one) {
    if (!(one.size_mm.value > 0) || !(one.depth_mm.value > 0) || !(one.stiffness_ratio.value > 0)) return;
    Case::Lump lump = lump_of(one);
    lump.along_y =
        length_over_diameter(lump.shape) > 1 && longer_along_y(observation, one.x_mm.value, one.y_mm.value);
    lumps.push_back(lump);
  };
  if (!estimate.lumps.empty())
    for (const Estimate& one : estimate.lumps) add(one);
  else if (estimate.detection_statistic >= 1)
    add(estimate);
  return lumps;
}

bool near(double a, double b, double share) {
  return std::abs(a / b - 1) <= share;
}

bool settled(const std::vector<Case::Lump>& a, const std::vector<Case::Lump>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Case::Lump& one, const Case::Lump& two) {
    return one.shape == two.shape && near(one.diameter_mm, two.diameter_mm, kSettled) &&
           near(one.depth_mm, two.depth_mm, kSettled) &&
           near(one.stiffness_ratio, two.stiffness_ratio, kSettledRatio);
  });
}

}  // namespace

/// Maps and ways at these forces, by the polynomials through the loads that were pressed.
SkinEffect::Pressed SkinEffect::at_forces(const fem::LargeStrainResult& result,
                                          const std::vector<double>& force_N) {
  Observation maps;
  for (const fem::PressedBlock& load : result.loads) {
    maps.force_N.push_back(load.force_N);
    maps.pressure_Pa.push_back(load.pressure_Pa);
  }
  Pressed pressed;
  for (const double force : force_N) {
    pressed.pressure_Pa.push_back(map_at_load(maps, force));
    const std::vector<double> weights = weights_through_origin(maps.force_N, force);
    double& way_mm = pressed.press_mm.emplace_back(0);
    for (size_t k = 0; k < weights.size(); ++k) way_mm += weights[k] * result.loads[k].press_mm;
  }
  return pressed;
}

SkinEffect::SkinEffect(const Observation& observation, const fem::Skin& skin, Effort effort)
    : block_mm_(observation.block_mm),
      young_Pa_(observation.young_Pa),
      force_N_(observation.force_N),
      skin_(skin),
      factors_(observation.force_N.size(), 1) {
  for (const bool under : {true, false}) {
    fem::Scene scene;
    scene.block_mm = block_mm_;
    scene.young_Pa = young_Pa_;
    scene.poisson = kPoisson;
    scene.inclusion.reset();
    scene.skin = fem::Skin{skin_.thickness_mm, under ? skin_.stiffness_ratio : 1};
    scene.cells = kQuickCells;
    const fem::LargeStrainResult last =
        solve_large_strain(scene, {{std::nullopt, force_N_.back()}}, press_options());
    if (!last.converged) return;
    most_mm_[under ? 0 : 1] = last.last_press_mm;
  }
  std::optional<Both> coarse = press_both(std::nullopt, false);
  std::optional<Both> plain = effort == Effort::Rough ? coarse : press_both(std::nullopt, true);
  if (!plain || !coarse) return;
  plain_ = std::move(*plain);
  plain_coarse_ = std::move(*coarse);
  converged_ = true;
}

std::optional<SkinEffect::Pressed> SkinEffect::press(const std::optional<Case::Lump>& lump, double ratio,
                                                     bool extrapolated, double most_mm) const {
  Case block;
  block.lump = lump;
  block.thickness_mm = block_mm_[2];
  block.young_Pa = young_Pa_;
  block.skin = fem::Skin{skin_.thickness_mm, ratio};
  block.press_mm = {block_mm_[2] / 10};
  const fem::Scene scene =
      scene_of(block, {block_mm_[0], block_mm_[1]}, kPoisson, extrapolated ? kPlainCells : kCells);
  check(scene);
  fem::LargeStrainOptions options = press_options();
  if (lump) {
    const fem::InclusionCells cells = inclusion_cells(scene);
    if (fit(scene, cells, symmetric(scene))) options.lump_cells = cells;
  }
  std::vector<fem::PressLoad> loads;
  for (int k = 1; k <= kWays; ++k) loads.push_back({most_mm * k / kWays, std::nullopt});
  fem::LargeStrainResult result = extrapolated ? solve_extrapolated(scene, kCells, loads, options)
                                               : solve_large_strain(scene, loads, options);
  if (!result.converged) return std::nullopt;
  for (fem::PressedBlock& load : result.loads)
    load.pressure_Pa = in_case_axes(block, std::move(load.pressure_Pa));
  return at_forces(result, force_N_);
}

std::optional<SkinEffect::Both> SkinEffect::press_both(const std::optional<Case::Lump>& lump,
                                                       bool extrapolated) const {
  std::optional<Pressed> skin = press(lump, skin_.stiffness_ratio, extrapolated, most_mm_[0]),
                         bare = press(lump, 1, extrapolated, most_mm_[1]);
  if (!skin || !bare) return std::nullopt;
  return Both{std::move(*skin), std::move(*bare)};
}

/// What of a lump lies in the block below its skin.
Case::Lump SkinEffect::allowed(Case::Lump lump) const {
  const double room_mm = block_mm_[2] - skin_.thickness_mm - 2 * kLeastTissue_mm;
  const double wide_mm = 0.9 * std::min(block_mm_[0], block_mm_[1]) / length_over_diameter(lump.shape);
  lump.diameter_mm = std::clamp(lump.diameter_mm, 0.02 * block_mm_[2], std::min(room_mm, wide_mm));
  lump.depth_mm = std::clamp(lump.depth_mm, skin_.thickness_mm + kLeastTissue_mm,
                             block_mm_[2] - kLeastTissue_mm - lump.diameter_mm);
  lump.stiffness_ratio = std::clamp(lump.stiffness_ratio, 0.02, 1e3);
  return lump;
}

bool SkinEffect::set_lumps(const std::vector<Case::Lump>& lumps) {
  std::vector<Seen> seen;
  for (const Case::Lump& lump : lumps) {
    Case::Lump centred = allowed(lump);
    centred.offset_mm = {0, 0};
    std::optional<Both> both = press_both(centred, false);
    if (!both) return false;
    for (size_t k = 0; k < force_N_.size(); ++k) {
      subtract(both->skin.pressure_Pa[k], plain_coarse_.skin.pressure_Pa[k]);
      subtract(both->bare.pressure_Pa[k], plain_coarse_.bare.pressure_Pa[k]);
    }
    seen.push_back({lump, std::move(*both)});
  }
  seen_ = std::move(seen);
  PressureMap whole = plain_.bare.pressure_Pa.back();
  for (size_t k = 0; k < factors_.size(); ++k) factors_[k] = change_of(k, whole, {0, 0}).factor;
  return true;
}

double SkinEffect::bump_factor() const {
  return factors_.back();
}

SkinEffect::Change SkinEffect::change_of(size_t load, const PressureMap& nodes,
                                         const std::array<double, 2>& window_mm) const {
  Change change;
  change.left_Pa = nodes;
  std::vector<double> bare(nodes.values.size()), skin(bare);
  double product = 0, square = 0;
  each_node(nodes, window_mm, [&](size_t n, double x, double y) {
    for (const Seen& one : seen_) {
      const double u = x - one.lump.offset_mm[0], v = y - one.lump.offset_mm[1];
      bare[n] += value_at(one.bump.bare.pressure_Pa[load], u, v);
      skin[n] += value_at(one.bump.skin.pressure_Pa[load], u, v);
    }
    product += bare[n] * skin[n];
    square += bare[n] * bare[n];
  });
  if (square > 0) change.factor = std::clamp(product / square, kFactor[0], kFactor[1]);
  for (size_t n = 0; n < bare.size(); ++n)
    change.left_Pa.values[n] = static_cast<float>(skin[n] / change.factor - bare[n]);
  return change;
}

Observation SkinEffect::without_skin(const Observation& observation, double share) const {
  Observation bare = observation;
  bare.skin.reset();
  double most = 0;
  for (size_t k = 0; k < bare.pressure_Pa.size(); ++k) {
    PressureMap& map = bare.pressure_Pa[k];
    const Change change = change_of(k, map, bare.window_mm);
    const double factor = std::pow(factors_[k], share);
    most = std::max(most, 1 / factor);
    each_node(map, bare.window_mm, [&](size_t n, double x, double y) {
      const double with = mean_at(plain_.skin.pressure_Pa[k], x, y, map.pitch_mm),
                   without = mean_at(plain_.bare.pressure_Pa[k], x, y, map.pitch_mm);
      const double plain = without + (1 - share) * (with - without);
      map.values[n] = static_cast<float>(plain + (double{map.values[n]} - with) / factor -
                                         share * double{change.left_Pa.values[n]});
    });
    if (k >= bare.press_mm.size()) continue;
    // The way of the block alone, and what a lump changes of it under the skin.
    double longer_mm = plain_.skin.press_mm[k] - plain_.bare.press_mm[k];
    for (const Seen& one : seen_)
      longer_mm += (one.bump.skin.press_mm[k] - plain_coarse_.skin.press_mm[k]) -
                   (one.bump.bare.press_mm[k] - plain_coarse_.bare.press_mm[k]);
    bare.press_mm[k] -= share * longer_mm;
  }
  bare.noise_Pa *= most;
  return bare;
}

SkinTakenOff take_off_skin(const Observation& observation,
                           const std::function<Estimate(const Observation&)>& estimate) {
  SkinTakenOff taken;
  const fem::Skin skin{observation.skin->thickness_mm, observation.skin->stiffness_ratio};
  taken.bare = observation;
  taken.bare.skin.reset();
  double young_Pa = observation.young_Pa;
  if (!(young_Pa > 0)) {
    const Estimate first = estimate(taken.bare);
    if (!first.tissue) {
      taken.unusable =
          first.reasons.empty() ? "the way of the plate tells no modulus" : first.reasons.front();
      return taken;
    }
    young_Pa = first.tissue->young_Pa.value;
  }
  for (int round = 0; round < kMostRounds && !taken.settled; ++round) {
    if (!taken.effect || !near(young_Pa, taken.effect->young_Pa(), kYoungSettled)) {
      Observation pressed = observation;
      pressed.young_Pa = young_Pa;
      taken.effect.emplace(pressed, skin);
    }
    if (!taken.effect->converged() || !taken.effect->set_lumps(taken.lumps)) {
      taken.effect.reset();
      taken.unusable = text(
          "no equilibrium of a block under a skin of %.3g mm, %.3g times as stiff, at these forces: are they "
          "in N, and the modulus in Pa?",
          skin.thickness_mm, skin.stiffness_ratio);
      return taken;
    }
    taken.bare = taken.effect->without_skin(observation);
    const Estimate found = estimate(taken.bare);
    const std::vector<Case::Lump> lumps = lumps_in(found, taken.bare);
    const double now_Pa = found.tissue ? found.tissue->young_Pa.value : young_Pa;
    taken.settled = settled(lumps, taken.lumps) && near(now_Pa, young_Pa, kYoungSettled);
    if (!taken.settled) taken.lumps = lumps;
    young_Pa = now_Pa;
  }
  return taken;
}

std::optional<Observation> without_other_skin(const Observation& observation, const SkinTakenOff& taken,
                                              double thickness, double ratio) {
  fem::Skin skin{observation.skin->thickness_mm * thickness, observation.skin->stiffness_ratio * ratio};
  skin.thickness_mm = std::min(skin.thickness_mm, observation.block_mm[2] / 2);
  Observation pressed = observation;
  pressed.young_Pa = taken.effect->young_Pa();
  SkinEffect effect(pressed, skin, SkinEffect::Effort::Rough);
  if (!effect.converged() || !effect.set_lumps(taken.lumps)) return std::nullopt;
  return effect.without_skin(observation);
}

}  // namespace palpate::lump
