#include "engine/fem/large_strain/plate_press.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace palpate::fem {
namespace {

constexpr double kForceError = 1e-6;  // relative, of a force that is asked for
constexpr int kMostForceSteps = 200;

double height_mm(const Scene& scene) {
  double whole = scene.block_mm[2];
  for (const PadSheet& sheet : scene.pad) whole += sheet.thickness_mm;
  return whole;
}

}  // namespace

PlatePress::PlatePress(const Scene& scene, LargeStrainModel& model, const LargeStrainOptions& options,
                       LargeStrainResult& result)
    : model_(model),
      options_(options),
      most_mm_(height_mm(scene) / 2),
      step_mm_(options.step_mm),
      // Bonded below and nearly incompressible, a block is stiffer than its modulus says.
      slope_N_per_mm_(2 * scene.young_Pa * 1e-6 * scene.block_mm[0] * scene.block_mm[1] / height_mm(scene)),
      result_(result) {}

bool PlatePress::to(const PressLoad& load) {
  return load.press_mm ? to_way(*load.press_mm) : to_force(*load.force_N);
}

bool PlatePress::to_way(double press_mm) {
  while (press_mm - model_.press_mm() > 1e-12 * press_mm) {
    const double left = press_mm - model_.press_mm();
    // The last two steps alike: no tiny one at the end.
    const double step = left <= step_mm_ ? left : left < 2 * step_mm_ ? left / 2 : step_mm_;
    if (!try_step(model_.press_mm() + step)) return false;
  }
  return true;
}

bool PlatePress::to_force(double force_N) {
  for (int step = 0; step < kMostForceSteps; ++step) {
    const double lack = force_N - model_.force_N();
    if (std::abs(lack) <= kForceError * force_N) return true;
    const double to_mm = model_.press_mm() + std::clamp(lack / slope_N_per_mm_, -step_mm_, step_mm_);
    if (to_mm > most_mm_) {
      result_.warnings.emplace_back("a force of " + std::to_string(force_N) +
                                    " N presses further than half the thickness");
      return false;
    }
    const double from_mm = model_.press_mm(), from_N = model_.force_N();
    if (!try_step(to_mm)) return false;
    slope_N_per_mm_ = (model_.force_N() - from_N) / (model_.press_mm() - from_mm);
  }
  return false;
}

// One step, shorter where the search does not end; afterwards steps grow again.
bool PlatePress::try_step(double to_mm) {
  if (model_.stopped()) return false;
  for (uint32_t cut = 0; !model_.move_to(to_mm, result_); ++cut) {
    if (cut == options_.most_cuts || model_.stopped()) return false;
    ++result_.cuts;
    to_mm = (to_mm + model_.press_mm()) / 2;
    step_mm_ = std::abs(to_mm - model_.press_mm());
  }
  ++result_.steps;
  step_mm_ = std::min(2 * step_mm_, options_.step_mm);
  return true;
}

}  // namespace palpate::fem
