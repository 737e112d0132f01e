// Two lumps so near to each other that their bumps have one top.
#pragma once

#include "engine/lump/network/view.h"
#include "engine/lump/pair/pair_fit.h"

namespace palpate::lump {

/// Makes an estimate NotSeparable where one bump is left unexplained by any lump and two lumps explain it;
/// says from which distance on they would be told apart. Others stay as they are.
void report_merged(const Model& model, const PressedNodes& nodes, Estimate& estimate);

/// The distance from which on two such lumps on the same line about the same middle would show two tops under
/// the noise of these nodes, mm, by the emulator; 0: at none that fits into the window.
double separable_from_mm(const Model& model, const PressedNodes& nodes, const PairWeighing& pair);

}  // namespace palpate::lump
