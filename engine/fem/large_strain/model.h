// One block at large strain: pressed step by step, its surface, and how both answer small changes.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/fem/large_strain/neo_hookean.h"
#include "engine/fem/large_strain/plate_friction.h"
#include "engine/fem/large_strain/press.h"
#include "engine/fem/large_strain/pressed_state.h"
#include "engine/fem/large_strain/pressed_surface.h"
#include "engine/fem/linear/multigrid.h"
#include "engine/numeric/conjugate_gradients.h"

namespace palpate::fem {

class LargeStrainModel {
 public:
  /// Throws as solve_large_strain() does. Keeps the team, which outlives it. `cells`: of this scene, whole or
  /// the quarter that the options ask for; voxelise()'s where there are none.
  LargeStrainModel(const Scene& scene, const LargeStrainOptions& options, WorkTeam& team,
                   std::optional<CellGrid> cells = std::nullopt);

  /// Moves the plate to `press_mm` in one step of Newton's search. False where that does not end: the block
  /// is as it was. `result` gathers rounds and iterations.
  bool move_to(double press_mm, LargeStrainResult& result);
  /// The same from a state that is near the one at `press_mm`, of this grid: a coarser grid's, or another
  /// lump's. It is scaled to the way first.
  bool move_near(PressedState guess, double press_mm, LargeStrainResult& result);
  /// From the next move on the plate is tilted about the block's middle, where the way is that of the move:
  /// it goes deeper by so much a mm along x and y. It stays frictionless, and nothing lifts off. Of a whole
  /// block.
  void tilt(const std::array<double, 2>& slope) { slope_ = slope; }

  double press_mm() const { return press_mm_; }
  double force_N() const { return force_N_; }
  PressedState state() const { return {press_mm_, displacement_, pressure_}; }
  PressedSurface surface() const { return surface_of(displacement_, force_); }
  PressedBlock measure() const;
  std::array<uint32_t, 2> map_nodes() const;
  uint64_t bytes() const;

  /// Changes of the surface (force and place) in this state, the plate held, per unit of a parameter that
  /// makes the grid `below` and `above` (their moduli and places) at either end of `span` of it.
  PressedSurface change_by_grids(const CellGrid& below, const CellGrid& above, double span,
                                 LargeStrainResult& result);
  /// The same per mm of the plate.
  PressedSurface change_by_press(LargeStrainResult& result);

  /// The options' stop says so: what was not finished is of no use.
  bool stopped() const { return options_.stop && options_.stop(); }

  const CellGrid& grid() const { return grid_; }
  bool quarter() const { return quarter_; }

 private:
  double out_of_balance(const std::vector<double>& displacement, std::vector<double>& force);
  void take_forces();
  double plate_mm(const std::vector<double>& displacement, size_t top_node, double press_mm) const;
  void put_under_plate(double press_mm, std::vector<double>& displacement) const;
  PressedSurface surface_of(const std::vector<double>& displacement, const std::vector<double>& force) const;
  double press_plate(const std::vector<double>& displacement, std::vector<double>& force);
  void form_tangent(const std::vector<double>& displacement, const std::vector<double>& pressure,
                    bool gentle = false);
  bool search(double press_mm, std::vector<double>& u, std::vector<double>& pressure,
              LargeStrainResult& result);
  uint32_t correct(double target_fraction, std::vector<double>& correction);
  PressedSurface change(std::vector<double>& displacement, const std::vector<double>& plus_force,
                        LargeStrainResult& result);

  Scene scene_;
  LargeStrainOptions options_;
  bool quarter_;
  WorkTeam& team_;
  CellGrid grid_;
  uint32_t above_;  // layers of the pad
  FixedNodes fixed_;
  PlateFriction friction_;
  NeoHookeanCells cells_;
  Multigrid multigrid_;  // of the block at rest: the tangents' preconditioner
  ConjugateGradients gradients_;
  std::vector<double> displacement_, last_;       // at press_mm_ and before it at last_mm_
  std::vector<double> pressure_, last_pressure_;  // of the cells, modulus' unit
  std::vector<double> force_;                     // of the tissue alone, on all nodes
  std::vector<double> residual_;
  double press_mm_ = 0, last_mm_ = 0, force_N_ = 0, all_forces_ = 0, least_ = 1, state_residual_ = 0;
  std::array<double, 2> slope_ = {0, 0};
  bool tangent_fresh_ = false;  // of displacement_
};

}  // namespace palpate::fem
