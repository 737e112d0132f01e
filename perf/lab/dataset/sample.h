// One case of a data set of lumps with what its press gave.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/fem/large_strain/large_strain.h"
#include "perf/lab/dataset/sweep.h"

namespace palpate::lump {

enum class State : uint8_t {
  NotDone,
  Good,
  NotConverged,  ///< loads up to last_press_mm are good
};

struct Sample {
  Case what;
  State state = State::NotDone;
  double last_press_mm = 0, last_force_N = 0;  ///< how far the press came
  uint32_t steps = 0, cuts = 0, newton_rounds = 0, iterations = 0;
  // One per load of the case; NaN for loads that were not reached.
  std::vector<double> force_N, residual, least_volume_ratio;
  /// True pressure in the frame of the plate, one per load that was reached; axes are the case's.
  std::vector<PressureMap> pressure_Pa;
};

/// Who presses a scene, on two grids where the coarser one has cells: press_lump(), or another in tests.
using Presser = std::function<fem::LargeStrainResult(
    const fem::Scene& scene, const std::array<uint32_t, 3>& coarser_cells,
    const std::vector<fem::PressLoad>& loads, const fem::LargeStrainOptions& options)>;
/// solve_extrapolated(), of two lumps press_pair(), or solve_large_strain() on one grid.
fem::LargeStrainResult press_lump(const fem::Scene& scene, const std::array<uint32_t, 3>& coarser_cells,
                                  const std::vector<fem::PressLoad>& loads,
                                  const fem::LargeStrainOptions& options);

/// Presses a case on one thread: the same numbers wherever it runs. None where `stop` (may be empty) said so.
std::optional<Sample> press_case(const Sweep& sweep, uint32_t number, const Presser& presser,
                                 const std::function<bool()>& stop = {});

/// A sample that is done as bytes, all samples of a sweep as many, and back: without what follows from the
/// case's number. For one kind of machine.
size_t packed_bytes(const Sweep& sweep);
std::string pack(const Sweep& sweep, const Sample& sample);
/// Throws Error(Failure::Input) where bytes are no sample of this sweep.
Sample unpack(const Sweep& sweep, const std::string& bytes);

}  // namespace palpate::lump
