// Choice of who solves what device and host both can: the one place that decides, by a rule and not by a
// measurement, so that a recording gives the same digits each time.
#pragma once

#include "engine/stages/surface/solve.h"
#include "palpate/options.h"

namespace palpate {

/// Properties of a surface's equations that the choice depends on.
struct SolveCase {
  bool transforms = true;  ///< slopes without weights: a cosine transform solves them on the host
  bool processor = false;  ///< the device is the processor's own driver
};

Solve choose_solve(SurfaceSolver solver, SolveBy by, const SolveCase& what);

/// The sums over pixels of Output::Motion: by the host.
bool motion_on_host(SolveBy by, bool processor);

/// The pressure of Output::Traction: by the host. `surface`: what was chosen for it.
bool traction_on_host(SolveBy by, Solve surface, bool processor);

}  // namespace palpate
