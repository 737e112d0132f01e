// What an estimate is worth where the tissue's modulus, its thickness or the maps' pitch are known to some
// per cent only: most of that contradicts nothing in an observation, and still moves every number.
#pragma once

#include "engine/lump/estimator.h"

namespace palpate::lump {

/// Shares within which the true value lies nine times out of ten; 0: exact.
struct InputErrors {
  double young = 0.1, thickness = 0.05, pitch = 0.01;
};

/// Estimates again with each input at both ends of its range, fills Estimate::input_effects and widens the
/// intervals of size, depth and ratio: distances to a value's interval and its moves add as squares, in
/// logarithms. An end where the estimator reports no numbers counts as the other end does. Estimates without
/// numbers stay as they are. Throws Error(Failure::Usage) for shares outside of 0 to 0.5.
void widen_for_input_errors(const Estimator& estimator, const Observation& observation,
                            const InputErrors& errors, Estimate& estimate);

/// "if the modulus is 10 % lower than told: size +2 %, depth -3 %, ratio -12 %; 10 % higher: ..."
std::string effect_text(const InputEffect& effect);

}  // namespace palpate::lump
