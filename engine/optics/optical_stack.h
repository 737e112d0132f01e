// Reflectance, transmittance and absorptance of a stack of plane layers, each thick against the light's
// coherence length, so that intensities add and phases do not matter (Eq. 36-44, as they should read).
//
// Layer by layer: R = R12 + T12 a^2 R23 T21 / (1 - a^2 R21 R23), T = T12 a T23 / (1 - a^2 R21 R23). Eq.
// 41-43 print T12 T23 where T12 R23 T21 belongs, and Eq. 40 adds reflectances of separate interfaces, which
// can pass 1. A single pass leaves a = exp(-2 k0 |Im(N cos)| d) of the light: exact for the plane wave that
// Snell's law makes in an absorbing layer, and exp(-alpha d / cos(theta)), alpha = 4 pi k / lambda, where k
// is small. A layer that the light meets beyond its critical angle passes nothing: as thick as it is, no
// light tunnels through.
#pragma once

#include <vector>

#include "engine/optics/fresnel.h"

namespace palpate::optics {

struct OpticalLayer {
  OpticalIndex index = {1, 0};
  double thickness_mm = 0;  ///< > 0; of no effect where the layer does not absorb
};

struct OpticalStack {
  OpticalIndex from = {1, 0};  ///< the medium the light comes from; it must not absorb
  std::vector<OpticalLayer> layers;
  OpticalIndex to = {1, 0};    ///< the medium behind; what enters it counts as transmitted
  double wavelength_nm = 630;  ///< in vacuum
};

/// Fractions of the incident intensity. The reflectance comes from adding upwards, what passes and what each
/// layer takes from the light followed downwards: that they add up to 1 is a check, not a definition.
struct StackLight {
  double reflectance = 0;
  double transmittance = 0;
  std::vector<double> absorptance;  ///< of each layer

  double absorbed() const;
};

/// Throws Error(Failure::Input) on indices out of range (see optical_index), a `from` that absorbs, a
/// thickness <= 0, a wavelength <= 0, an angle outside [0, pi/2].
StackLight stack_light(const OpticalStack& stack, double angle_rad, Polarisation polarisation);

/// The mean of s and p, taken last.
StackLight unpolarised_light(const OpticalStack& stack, double angle_rad);

/// n0 sin(theta0): the tangential index of light that meets the stack at that angle.
double tangential_index(const OpticalStack& stack, double angle_rad);

}  // namespace palpate::optics
