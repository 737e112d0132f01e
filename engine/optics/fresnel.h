// Light at one plane interface: Fresnel's equations with complex indices (Eq. 31-35), and what they say of
// intensities. Indices are written N = n - ik; k > 0 absorbs. Angles enter as the tangential index
// s = n sin(theta), which all layers of a plane stack share; s is real because light comes from a medium that
// does not absorb.
#pragma once

#include <complex>

namespace palpate::optics {

using OpticalIndex = std::complex<double>;

/// n - ik. Throws Error(Failure::Input) unless 0 < n <= 10, 0 <= k <= 100, and n >= 1 where k is 0 (below 1
/// are metals only).
OpticalIndex optical_index(double n, double k = 0);

/// The other half of s: N cos(theta) = sqrt(N^2 - s^2), real part >= 0, imaginary part <= 0 (a wave that
/// decays on its way). Imaginary beyond the critical angle.
std::complex<double> normal_index(OpticalIndex index, double s);

/// Amplitudes over the incident one; s: field perpendicular to the plane of incidence, p: in it.
struct FresnelAmplitudes {
  std::complex<double> r_s, r_p, t_s, t_p;
};
/// From `from` to `to` at the tangential index `s`. The denominator of t_p is N2 cos1 + N1 cos2: Eq. 33 is
/// misprinted.
FresnelAmplitudes fresnel_amplitudes(OpticalIndex from, OpticalIndex to, double s);

enum class Polarisation { S, P };

/// Fractions of the arriving intensity; they add up to 1. The same from either side.
struct InterfaceFractions {
  double reflected = 0;
  double passed = 1;
};
/// |r|^2 and 1 - |r|^2, the latter without cancellation. Exactly (1, 0) at and beyond the critical angle of a
/// far side that does not absorb.
/// Between two absorbing media the incident and reflected waves' interference carries power too, so that no
/// split of it is exact; 1 - |r|^2 is the one that conserves energy from both sides. Where it would be
/// negative (a surface plasmon at a layer that is itself beyond its critical angle) everything is
/// reflected.
InterfaceFractions interface_fractions(OpticalIndex from, OpticalIndex to, double s,
                                       Polarisation polarisation);

/// Share of light that passes from `from` to `to` through a plane gap as thin as the wavelength: frustrated
/// total reflection, waves added with their phase. Gap and `from` must not absorb. A gap of 0 is the
/// interface itself. Throws Error(Failure::Input) on a negative gap, wavelength <= 0 or an index out of
/// range.
double frustrated_transmittance(double from, double gap, OpticalIndex to, double s, double gap_nm,
                                double wavelength_nm, Polarisation polarisation);

}  // namespace palpate::optics
