// Whether maps show that the plate does not slide freely on the tissue.
#pragma once

#include <optional>

#include "engine/lump/observation/observation.h"

namespace palpate::lump {

class Network;

/// How the pressure around any lump falls towards the rim, against a plate that slides.
struct PlateGrip {
  double grip = 0;  ///< of what a friction of 0.1 makes of the block alone; under a plate that sticks far off
  double sd = 0;    ///< its standard error
  bool slides = true;  ///< nothing beyond doubt
};

/// Presses the block alone at the observation's forces, under a sliding plate and with a friction of 0.1 (1 s
/// of a core), and fits what differs beside any bump, see BlockHypotheses. None where the model cannot use
/// the observation, or there is no equilibrium. Of an observation with a modulus and without skin and plate.
std::optional<PlateGrip> plate_grip(const Network& network, const Observation& observation);

/// Makes an estimate of a press that seems not to slide Inconsistent, its reason first. Others stay as they
/// are, so do those of observations with a skin, a plate or relaxation.
void report_plate(const Network& network, const Observation& observation, Estimate& estimate);

}  // namespace palpate::lump
