// Contradictions within an observation, or between it and the block as stated: units, pitch, window,
// order of the loads.
//
// Pressure has to add up to force, to rise with it, and to fall towards the block's rim as the model's own
// block does. Most wrong input breaks one of these by more than noise, gauge and any lump can; a lump's own
// bump is left open. What it does not break (a modulus 30 % off, at small loads) is not found here: see
// error_sources.h for its effect.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/lump/network/view.h"
#include "engine/lump/observation/observation.h"

namespace palpate::lump {

/// The input that is wrong, as far as it can be identified.
enum class Fault : uint8_t {
  Unit,      ///< of pressure, force or modulus
  Sum,       ///< the maps carry more than the force on the whole block
  Rim,       ///< pressure beside the block, or none on it
  Order,     ///< forces that belong to other maps
  OneForce,  ///< a map or force of another press
  Slide,     ///< the map moves between loads
  Pitch,     ///< another pitch fits
  Window,    ///< another place of the window fits
  Tilt,      ///< pressure rises from one side to the other
};
const char* to_string(Fault fault);  ///< "unit", "sum", ...

struct Contradiction {
  Fault fault = Fault::Unit;
  /// By how much: a factor (Unit, Sum, OneForce), mm (Slide, Window), a share (Pitch, Tilt); and
  /// its standard error from noise and gauge.
  double value = 0, sd = 0;
  std::string reason;  ///< a sentence for people: what contradicts what, what would fit, what to do
};

/// The contradictions beyond doubt; README.md says how often honest observations have one, and which faults
/// are found. `nodes`: of the same observation; null where the model cannot use it: units, sum, rim and order
/// are looked at alone.
std::vector<Contradiction> find_contradictions(const Model& model, const Observation& observation,
                                               const PressedNodes* nodes);

/// Makes the estimate of such an observation Inconsistent, its reasons first. Others stay as they are. Where
/// several lumps are reported the block around them is not looked at.
void report_contradictions(const Model& model, const Observation& observation, const PressedNodes* nodes,
                           Estimate& estimate);

}  // namespace palpate::lump
