// The tissue's modulus, and its thickness, by the way of the plate that presses it.
#pragma once

#include <string>

#include "engine/lump/observation/observation.h"

namespace palpate::lump {

/// What is known of the tissue before it is pressed: standard deviations of logarithms around what the
/// observation states.
struct TissuePrior {
  double young_sd = 0;  ///< infinite: not known at all
  double thickness_sd = 0;
};

struct FoundTissue {
  double young_Pa = 0, thickness_mm = 0;
  double young_sd = 0, thickness_sd = 0;  ///< of their logarithms
  /// Change of the modulus's logarithm with the thickness's, and what is open of it where that is exact.
  double young_by_thickness = 0, young_sd_at_thickness = 0;
  std::string unusable;       ///< why there are no numbers; empty: there are
  std::string contradiction;  ///< between the way and what is stated, a sentence; empty: none

  /// With 90 % intervals.
  Tissue tissue() const;
};

/// The likeliest tissue given forces, Observation::press_mm and the prior. `lump`: what was estimated in it,
/// or none. Throws Error(Failure::Usage) where ways and forces do not fit each other.
FoundTissue find_tissue(const Observation& observation, const TissuePrior& prior, const Estimate& lump);

}  // namespace palpate::lump
