// Young's modulus of a sample that is pressed between the sensor's pad and a rigid table (Eq. 78 and
// 79). The pad is known: modulus, thickness, bonded to its rigid base. Small strains, frictionless.
//
// What determines it. The camera sees the pad: force (by calibration or a gauge), where the
// contact ends, how deep the pad is. It does not see how far the sample gives way. That comes from
// - the stage: approach less mean depth of the pad is a flat sample's shortening, exactly, whatever the
//   distribution of pressure. A ball's share is that of the model. Only differences count where the zero of
//   the stage is not known.
// - the contact's edge, flat sample: compressed by e it grows by Poisson's ratio times e (more by a tenth
//   where sample and pad are alike, by half where the pad is softer: the model says). The size at rest is
//   known too poorly to be used by itself; its growth from press to press is what counts.
// - the contact's radius, ball: at one force a^3 ~ 1/E*, 1/E* = (1 - v^2)/E + (1 - vp^2)/Ep. An error da/a
//   becomes 3 (1 + E/Ep) da/a in E: a ball much stiffer than the pad looks like a rigid one.
// - depth and radius, ball: of a^2/R the pad takes the fraction of its compliance. Needs no force.
// Depth and force alone determine the pad, not the sample: a flat sample whose size stays and whose
// approach is not known is refused.
#pragma once

#include <vector>

#include "engine/elasticity/modulus/press_frames.h"

namespace palpate {

/// All methods and the chosen one: the joint fit where it is valid, and where its readings contradict it or
/// each other (DoesNotFit: no value, whatever a single way says); where it cannot be made, the narrowest
/// valid interval. Throws Error(Failure::Input) on setups out of range and on readings that are negative or
/// infinite.
ModulusAnswer estimate_modulus(const std::vector<PressFrame>& frames, const ModulusSetup& setup);
/// The same with the model made before, for many estimates of one setup.
ModulusAnswer estimate_modulus(const std::vector<PressFrame>& frames, const ModulusSetup& setup,
                               const PressModel& model);

}  // namespace palpate
