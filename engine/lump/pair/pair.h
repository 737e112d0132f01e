// Two lumps in one block, each estimated.
#pragma once

#include "engine/lump/network/network.h"

namespace palpate::lump {

/// Where an estimate reports two bumps and no more, estimates the lump behind each: Estimate::lumps, in the
/// order of Estimate::bumps_mm, each with a verdict of its own. Where it reports one bump that no lump makes
/// and that two lumps explain, its verdict becomes NotSeparable. Others stay as they are. `observation`: the
/// estimate's. About a second.
void estimate_pair(const Model& model, const Observation& observation, Estimate& estimate);

}  // namespace palpate::lump
