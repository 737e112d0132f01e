// Displacement of the plate from load to load, in steps small enough for the equilibrium solver to converge.
#pragma once

#include "engine/fem/large_strain/model.h"

namespace palpate::fem {

class PlatePress {
 public:
  /// Keeps all four, which outlive it; `result` gathers steps, cuts and why it ended.
  PlatePress(const Scene& scene, LargeStrainModel& model, const LargeStrainOptions& options,
             LargeStrainResult& result);

  /// False where the load is not reached: the model stands at the last good state.
  bool to(const PressLoad& load);

 private:
  bool to_way(double press_mm);
  bool to_force(double force_N);
  bool try_step(double to_mm);

  LargeStrainModel& model_;
  const LargeStrainOptions& options_;
  double most_mm_, step_mm_;
  double slope_N_per_mm_;  // of the last step
  LargeStrainResult& result_;
};

}  // namespace palpate::fem
