// Tissue that relaxes while the plate rests, and a press as it would be if it did not.
#pragma once

#include <vector>

#include "engine/lump/observation/observation.h"

namespace palpate::lump {

/// Modulus at a time after a step, over that right after it: 1 - sum of share (1 - exp(-t / time_s)), a Prony
/// series. `ramp_s`: the step was made evenly over so long before that time began.
double modulus_after(const Relaxation& relaxation, double seconds, double ramp_s);

/// What is read of such tissue at loads that come in turn, in place of elastic maps and forces. Lump and
/// tissue relax alike, and strains are those of the ways alone (quasi-linear, Fung): what is read is the sum
/// over all steps of modulus_after(time since the step) times the elastic change of that step.
void relax(const Relaxation& relaxation, std::vector<PressureMap>& pressure_Pa, std::vector<double>& force_N);

/// The inverse: maps and forces as tissue that does not relax would show them at these ways; the noise grows
/// by what the inverse makes of it. Nodes that were not seen at a load are not seen at those after it.
/// `share`: of the relaxation that is taken back.
Observation without_relaxation(const Observation& observation, double share = 1);

}  // namespace palpate::lump
