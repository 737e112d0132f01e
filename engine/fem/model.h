// One scene's equations with their supports, and what their solution says about the surface.
#pragma once

#include "engine/fem/solver_choice.h"

namespace palpate::fem {

class ContactModel {
 public:
  ContactModel(const Scene& scene, const Options& options, WorkTeam& team);

  /// Presses by a way, mm, from where the last press left the solution. `result` gathers iterations, rounds
  /// and bytes; converged and residual are of this press.
  void press(double way_mm, Result& result);

  /// Results of the last press that `scene` asks for: maps, force, strain. All scale with the press but under
  /// a ball.
  void measure(double scale, Result& result);

 private:
  bool by_ball() const { return scene_.presser == Presser::Sphere; }
  size_t surface_nodes() const { return size_t{grid_.cells[0] + 1} * (grid_.cells[1] + 1); }
  double rim_fraction(uint32_t i, uint32_t j) const;
  double gap_mm(uint32_t i, uint32_t j) const;
  double core_strain() const;
  bool solve(double residual, Result& result);
  bool revise_contact(double way_mm);

  Scene scene_;
  Options options_;
  bool quarter_;
  CellGrid grid_;
  uint32_t above_;  // layers of the pad
  FixedNodes fixed_;
  std::vector<double> load_, displacement_, force_;
  SolverChoice solver_;
  double way_mm_ = 0;
};

}  // namespace palpate::fem
