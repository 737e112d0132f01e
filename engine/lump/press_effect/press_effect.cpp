#include "engine/lump/press_effect/press_effect.h"

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

constexpr Cells kCells = {24, 24, 12};       // of rough presses; other ones are extrapolated with them
constexpr Cells kPlainCells = {48, 48, 24};  // of the block alone
constexpr Cells kBumpCells = {36, 36, 18};   // of bumps, which follow the lump
constexpr Cells kQuickCells = {12, 12, 6};   // that tell about how far to press
constexpr double kPoisson = 0.495;
constexpr double kStep_mm = 2, kResidual = 1e-5;
constexpr double kQuickResidual = 1e-7;  // so that the force that is asked for is found
constexpr int kWays = 4;                 // of each press, in even steps
constexpr uint32_t kNodes = 33;          // of the maps along a side
constexpr double kLeastTissue_mm = 0.3;  // between skin and lump, and below the lump
constexpr std::array<double, 2> kFactor = {0.05, 20};
constexpr int kMostRounds = 8;
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

void put_under(const PressConditions& conditions, fem::Scene& scene) {
  scene.skin = conditions.skin;
  scene.plate_sticks = conditions.plate_sticks;
  scene.plate_friction = conditions.plate_friction;
}

}  // namespace

PressConditions conditions_of(const Observation& observation) {
  PressConditions conditions;
  if (observation.skin)
    conditions.skin = fem::Skin{observation.skin->thickness_mm, observation.skin->stiffness_ratio};
  if (observation.plate) {
    conditions.plate_sticks = observation.plate->sticks;
    conditions.plate_friction = observation.plate->sticks ? 0 : observation.plate->friction;
  }
  return conditions;
}

std::string conditions_text(const PressConditions& conditions) {
  std::string plate;
  if (conditions.plate_sticks) plate = "a plate that holds the tissue";
  if (conditions.plate_friction > 0)
    plate = text("a plate with a friction of %.3g", conditions.plate_friction);
  if (!conditions.skin) return plate.empty() ? "a plate that slides" : plate;
  return text("a skin of %.3g mm, %.3g times as stiff as the tissue below", conditions.skin->thickness_mm,
              conditions.skin->stiffness_ratio) +
         (plate.empty() ? "" : ", and " + plate);
}

/// Maps and ways at these forces, by the polynomials through the loads that were pressed.
PressEffect::Pressed PressEffect::at_forces(const fem::LargeStrainResult& result,
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

PressConditions PressEffect::conditions_for(bool there) const {
  if (there) return conditions_;
  PressConditions plain;
  if (conditions_.skin) plain.skin = fem::Skin{conditions_.skin->thickness_mm, 1};  // the same cells
  return plain;
}

PressEffect::PressEffect(const Observation& observation, const PressConditions& conditions, Effort effort)
    : block_mm_(observation.block_mm),
      young_Pa_(observation.young_Pa),
      force_N_(observation.force_N),
      conditions_(conditions),
      effort_(effort),
      factors_(observation.force_N.size(), 1) {
  for (const bool there : {true, false}) {
    fem::Scene scene;
    scene.block_mm = block_mm_;
    scene.young_Pa = young_Pa_;
    scene.poisson = kPoisson;
    scene.inclusion.reset();
    scene.cells = kQuickCells;
    put_under(conditions_for(there), scene);
    fem::LargeStrainOptions options = press_options();
    options.residual = kQuickResidual;
    const fem::LargeStrainResult last = solve_large_strain(scene, {{std::nullopt, force_N_.back()}}, options);
    if (!last.converged) return;
    most_mm_[there ? 0 : 1] = last.last_press_mm;
  }
  std::optional<Both> rough = press_both(std::nullopt, kCells), bumps = rough, alone = rough;
  if (effort == Effort::Full) {
    bumps = press_both(std::nullopt, kBumpCells);
    alone = press_both(std::nullopt, kPlainCells);
  }
  if (!rough || !bumps || !alone) return;
  alone_ = std::move(*alone);
  alone_rough_ = std::move(*rough);
  alone_bumps_ = std::move(*bumps);
  converged_ = true;
}

std::optional<PressEffect::Pressed> PressEffect::press(const std::optional<Case::Lump>& lump, bool there,
                                                       const Cells& cells) const {
  Case block;
  block.lump = lump;
  block.thickness_mm = block_mm_[2];
  block.young_Pa = young_Pa_;
  block.press_mm = {block_mm_[2] / 10};
  fem::Scene scene = scene_of(block, {block_mm_[0], block_mm_[1]}, kPoisson, cells);
  put_under(conditions_for(there), scene);
  check(scene);
  fem::LargeStrainOptions options = press_options();
  if (lump) {
    const fem::InclusionCells followed = inclusion_cells(scene);
    if (fit(scene, followed, symmetric(scene))) options.lump_cells = followed;
  }
  const double most_mm = most_mm_[there ? 0 : 1];
  std::vector<fem::PressLoad> loads;
  for (int k = 1; k <= kWays; ++k) loads.push_back({most_mm * k / kWays, std::nullopt});
  fem::LargeStrainResult result = cells == kCells ? solve_large_strain(scene, loads, options)
                                                  : solve_extrapolated(scene, kCells, loads, options);
  if (!result.converged) return std::nullopt;
  for (fem::PressedBlock& load : result.loads)
    load.pressure_Pa = in_case_axes(block, std::move(load.pressure_Pa));
  return at_forces(result, force_N_);
}

std::optional<PressEffect::Both> PressEffect::press_both(const std::optional<Case::Lump>& lump,
                                                         const Cells& cells) const {
  std::optional<Pressed> there = press(lump, true, cells), plain = press(lump, false, cells);
  if (!there || !plain) return std::nullopt;
  return Both{std::move(*there), std::move(*plain)};
}

/// What of a lump lies in the block below its skin.
Case::Lump PressEffect::allowed(Case::Lump lump) const {
  const double skin_mm = conditions_.skin ? conditions_.skin->thickness_mm : 0;
  const double room_mm = block_mm_[2] - skin_mm - 2 * kLeastTissue_mm;
  const double wide_mm = 0.9 * std::min(block_mm_[0], block_mm_[1]) / length_over_diameter(lump.shape);
  lump.diameter_mm = std::clamp(lump.diameter_mm, 0.02 * block_mm_[2], std::min(room_mm, wide_mm));
  lump.depth_mm =
      std::clamp(lump.depth_mm, skin_mm + kLeastTissue_mm, block_mm_[2] - kLeastTissue_mm - lump.diameter_mm);
  lump.stiffness_ratio = std::clamp(lump.stiffness_ratio, 0.02, 1e3);
  return lump;
}

bool PressEffect::set_lumps(const std::vector<Case::Lump>& lumps, Effort effort) {
  const bool rough = effort == Effort::Rough || effort_ == Effort::Rough;
  const Both& alone = rough ? alone_rough_ : alone_bumps_;
  std::vector<Seen> seen;
  for (const Case::Lump& lump : lumps) {
    Case::Lump centred = allowed(lump);
    centred.offset_mm = {0, 0};
    std::optional<Both> both = press_both(centred, rough ? kCells : kBumpCells);
    if (!both) return false;
    for (size_t k = 0; k < force_N_.size(); ++k) {
      subtract(both->there.pressure_Pa[k], alone.there.pressure_Pa[k]);
      subtract(both->plain.pressure_Pa[k], alone.plain.pressure_Pa[k]);
      both->there.press_mm[k] -= alone.there.press_mm[k];
      both->plain.press_mm[k] -= alone.plain.press_mm[k];
    }
    seen.push_back({lump, std::move(*both)});
  }
  seen_ = std::move(seen);
  PressureMap whole = alone_.plain.pressure_Pa.back();
  for (size_t k = 0; k < factors_.size(); ++k) factors_[k] = change_of(k, whole, {0, 0}).factor;
  return true;
}

double PressEffect::bump_factor() const {
  return factors_.back();
}

PressureMap PressEffect::block_change_Pa(size_t load) const {
  PressureMap change = alone_.there.pressure_Pa[load];
  subtract(change, alone_.plain.pressure_Pa[load]);
  return change;
}

PressEffect::Change PressEffect::change_of(size_t load, const PressureMap& nodes,
                                           const std::array<double, 2>& window_mm) const {
  Change change;
  change.left_Pa = nodes;
  std::vector<double> plain(nodes.values.size()), there(plain);
  double product = 0, square = 0;
  each_node(nodes, window_mm, [&](size_t n, double x, double y) {
    for (const Seen& one : seen_) {
      const double u = x - one.lump.offset_mm[0], v = y - one.lump.offset_mm[1];
      plain[n] += value_at(one.bump.plain.pressure_Pa[load], u, v);
      there[n] += value_at(one.bump.there.pressure_Pa[load], u, v);
    }
    product += plain[n] * there[n];
    square += plain[n] * plain[n];
  });
  if (square > 0) change.factor = std::clamp(product / square, kFactor[0], kFactor[1]);
  for (size_t n = 0; n < plain.size(); ++n)
    change.left_Pa.values[n] = static_cast<float>(there[n] / change.factor - plain[n]);
  return change;
}

Observation PressEffect::taken_off(const Observation& observation, double share) const {
  Observation plain = observation;
  plain.skin.reset();
  plain.plate.reset();
  double most = 0;
  for (size_t k = 0; k < plain.pressure_Pa.size(); ++k) {
    PressureMap& map = plain.pressure_Pa[k];
    const Change change = change_of(k, map, plain.window_mm);
    const double factor = std::pow(factors_[k], share);
    most = std::max(most, 1 / factor);
    each_node(map, plain.window_mm, [&](size_t n, double x, double y) {
      const double with = mean_at(alone_.there.pressure_Pa[k], x, y, map.pitch_mm),
                   without = mean_at(alone_.plain.pressure_Pa[k], x, y, map.pitch_mm);
      const double alone = without + (1 - share) * (with - without);
      map.values[n] = static_cast<float>(alone + (double{map.values[n]} - with) / factor -
                                         share * double{change.left_Pa.values[n]});
    });
    if (k >= plain.press_mm.size()) continue;
    // The way of the block alone, and what a lump changes of it there.
    double longer_mm = alone_.there.press_mm[k] - alone_.plain.press_mm[k];
    for (const Seen& one : seen_) longer_mm += one.bump.there.press_mm[k] - one.bump.plain.press_mm[k];
    plain.press_mm[k] -= share * longer_mm;
  }
  plain.noise_Pa *= most;
  return plain;
}

TakenOff take_off_effect(const Observation& observation,
                         const std::function<Estimate(const Observation&)>& estimate) {
  TakenOff taken;
  const PressConditions conditions = conditions_of(observation);
  taken.plain = observation;
  taken.plain.skin.reset();
  taken.plain.plate.reset();
  double young_Pa = observation.young_Pa;
  if (!(young_Pa > 0)) {
    const Estimate first = estimate(taken.plain);
    if (!first.tissue) {
      taken.unusable =
          first.reasons.empty() ? "the way of the plate tells no modulus" : first.reasons.front();
      return taken;
    }
    young_Pa = first.tissue->young_Pa.value;
  }
  PressEffect::Effort effort = PressEffect::Effort::Rough;  // until the lump stays
  for (int round = 0; round < kMostRounds && !taken.settled; ++round) {
    if (!taken.effect || !near(young_Pa, taken.effect->young_Pa(), kYoungSettled)) {
      Observation pressed = observation;
      pressed.young_Pa = young_Pa;
      taken.effect.emplace(pressed, conditions);
    }
    if (!taken.effect->converged() || !taken.effect->set_lumps(taken.lumps, effort)) {
      taken.effect.reset();
      taken.unusable =
          text("no equilibrium of a block under %s at these forces: are they in N, and the modulus in Pa?",
               conditions_text(conditions).c_str());
      return taken;
    }
    taken.plain = taken.effect->taken_off(observation);
    const Estimate found = estimate(taken.plain);
    const std::vector<Case::Lump> lumps = lumps_in(found, taken.plain);
    const double now_Pa = found.tissue ? found.tissue->young_Pa.value : young_Pa;
    const bool stays = settled(lumps, taken.lumps) && near(now_Pa, young_Pa, kYoungSettled);
    taken.settled = stays && (effort == PressEffect::Effort::Full || lumps.empty());
    if (stays)
      effort = PressEffect::Effort::Full;
    else
      taken.lumps = lumps;
    young_Pa = now_Pa;
  }
  return taken;
}

std::optional<Observation> taken_off_roughly(const Observation& observation, const TakenOff& taken,
                                             const PressConditions& conditions) {
  Observation pressed = observation;
  pressed.young_Pa = taken.effect->young_Pa();
  PressEffect effect(pressed, conditions, PressEffect::Effort::Rough);
  if (!effect.converged() || !effect.set_lumps(taken.lumps)) return std::nullopt;
  return effect.taken_off(observation);
}

}  // namespace palpate::lump
