// An estimator with the sources of error that its intervals cover: the one place that widens them, so that a
// press has the same interval wherever it is estimated.
#pragma once

#include <concepts>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>

#include "engine/base/stop.h"
#include "engine/lump/observation/observation.h"

namespace palpate::lump {

/// Errors that intervals cover in addition to the noise of the maps, which they always do. Shares are those
/// within which the true value lies nine times out of ten; 0: exact.
struct ErrorSources {
  double young = 0.1, thickness = 0.05, pitch = 0.01;
  double young_by_thickness = 0;  ///< the logarithm of the modulus changes so much with the thickness's
  bool light = true;              ///< slow errors across the window, Observation::uneven_sd
  bool place = true;              ///< of the window in the block, Observation::place_sd_mm

  /// All inputs are exact, as of a synthetic block.
  static constexpr ErrorSources none() { return {0, 0, 0, 0, false, false}; }
};

/// An estimate from the maps alone.
using Inverse = std::function<Estimate(const Observation&)>;
/// The observation as it would be if the middle of each window read brighter than its corners by this share.
using UnevenLight = std::function<Observation(double fraction)>;

class Estimator {
 public:
  Estimator() = default;
  /// `moves`: which finds how far an error moves the estimate; empty: the inverse itself. Throws
  /// Error(Failure::Usage) for shares outside of 0 to 0.5.
  Estimator(Inverse inverse, const ErrorSources& sources, Inverse moves = {});
  /// The inverse alone: all inputs are exact.
  template <std::invocable<const Observation&> F>
  requires(!std::same_as<std::remove_cvref_t<F>, Estimator>) Estimator(F inverse)
      : Estimator(Inverse(std::move(inverse)), ErrorSources::none()) {}

  /// The same, which throws Stopped between two estimates once `stop` says so.
  Estimator until(const StopAsked& stop) const;

  explicit operator bool() const { return static_cast<bool>(inverse_); }

  /// Where the observation has Observation::press_mm the tissue is found first: its stated modulus and
  /// thickness are as near as the sources say (a modulus of 0: not known), and what is left open of both
  /// takes the place of these sources. What contradicts itself is Inconsistent, a modulus that is known to no
  /// better than a half Unusable.
  ///
  /// An Observation::skin and the effect of an Observation::plate are taken off first
  /// (press_effect/README.md); what is open of them, and of their effect, is in the intervals.
  ///
  /// Estimates, and again with each source at both ends of its range; fills Estimate::input_effects and
  /// widens the intervals: distances to a value's interval and its moves add as squares, of size, depth and
  /// ratio in logarithms. An end where there are no numbers counts as the other end does. A lump that goes
  /// away with uneven light is Unusable. Estimates without numbers stay as they are. `uneven`: of an
  /// observation that is put together from several windows; empty: it is of one window.
  Estimate operator()(const Observation& observation, const UnevenLight& uneven = {}) const;

 private:
  Estimate of_relaxing(const Observation& observation, const UnevenLight& uneven) const;
  Estimate pressed_otherwise(const Observation& observation, const UnevenLight& uneven) const;
  Estimate in_found_tissue(const Observation& observation, const UnevenLight& uneven) const;
  Estimate widened(const Observation& observation, const ErrorSources& sources,
                   const UnevenLight& uneven) const;

  Inverse inverse_, moves_;
  ErrorSources sources_ = ErrorSources::none();
};

/// What an observation is told with.
enum class Input : uint8_t { Modulus, Thickness, Pitch };
const char* to_string(Input input);  ///< "modulus", "thickness", "pitch"
/// The same maps told with `factor` times the input.
Observation with_input(Observation observation, Input input, double factor);

/// A single window whose middle reads brighter than its corners by `fraction`; the mean stays.
Observation with_uneven_light(Observation observation, double fraction);

/// "if the modulus is 10 % lower than stated: size +2 %, depth -3 %, ratio -12 %; 10 % higher: ..."
std::string effect_text(const InputEffect& effect);

}  // namespace palpate::lump
