// Response of a block with a lump, and its derivatives, by the grid that is searched alone.
#pragma once

#include <optional>

#include "engine/lump/fem_inverse/effort.h"
#include "engine/lump/fem_inverse/response.h"

namespace palpate::lump {

fem::InclusionCells response_cells(const Observation& observation, const Case::Lump& lump,
                                   const ResponseOptions& options);
/// Whether these cells still follow the lump without much bending.
bool matches(const fem::InclusionCells& cells, const Observation& observation, const Case::Lump& lump,
             const ResponseOptions& options);

/// Presses the lump's block (`lump` empty: tissue alone) to the observation's forces, on the grid that is
/// searched.
/// `derivatives`: all of the prediction. Not converged where there is no equilibrium, or the cells cannot
/// follow the lump, or all effort is spent. Throws as solve_large_strain(), and Stopped.
Prediction predict(const ComparedNodes& nodes, const std::optional<FittedLump>& lump,
                   const ResponseOptions& options, bool derivatives, Effort& effort);

}  // namespace palpate::lump
