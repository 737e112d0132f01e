#include "engine/optics/fresnel.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "palpate/error.h"

namespace palpate::optics {
namespace {

using Complex = std::complex<double>;

/// Admittance, common to both of Fresnel's equations: N cos for s, cos / N for p.
Complex admittance(OpticalIndex index, double s, Polarisation polarisation) {
  const Complex q = normal_index(index, s);
  return polarisation == Polarisation::S ? q : q / (index * index);
}

/// sin(z) / z.
Complex sinc(Complex z) {
  return std::abs(z) < 1e-4 ? 1.0 - z * z / 6.0 : std::sin(z) / z;
}

}  // namespace

OpticalIndex optical_index(double n, double k) {
  const std::string remedy = "1.4 for silicone, 1 for air; for a metal its n and k";
  if (!(n > 0 && n <= 10))
    throw Error(Failure::Input, "a refractive index from 1 to 10 (above 0 where it absorbs)",
                std::to_string(n), remedy);
  if (!(k >= 0 && k <= 100))
    throw Error(Failure::Input, "an extinction coefficient from 0 to 100", std::to_string(k), remedy);
  if (k == 0 && n < 1)
    throw Error(Failure::Input, "a refractive index of at least 1 where nothing is absorbed",
                std::to_string(n), remedy);
  return {n, -k};
}

Complex normal_index(OpticalIndex index, double s) {
  // The product keeps its digits near the critical angle, where the difference of squares loses them.
  const Complex square = (index - s) * (index + s);
  if (index.imag() == 0)
    return square.real() >= 0 ? Complex(std::sqrt(square.real()), 0) : Complex(0, -std::sqrt(-square.real()));
  const Complex root = std::sqrt(square);
  return {std::abs(root.real()), -std::abs(root.imag())};
}

FresnelAmplitudes fresnel_amplitudes(OpticalIndex from, OpticalIndex to, double s) {
  const Complex q1 = normal_index(from, s), q2 = normal_index(to, s);
  const Complex cos1 = q1 / from, cos2 = q2 / to;
  const Complex sum_s = q1 + q2, sum_p = to * cos1 + from * cos2;
  return {(q1 - q2) / sum_s, (to * cos1 - from * cos2) / sum_p, 2.0 * q1 / sum_s, 2.0 * q1 / sum_p};
}

InterfaceFractions interface_fractions(OpticalIndex from, OpticalIndex to, double s,
                                       Polarisation polarisation) {
  if (from == to) return {0, 1};
  const auto total = [s](OpticalIndex index) { return index.imag() == 0 && s >= index.real(); };
  if (total(from) || total(to)) return {1, 0};
  const Complex y1 = admittance(from, s, polarisation), y2 = admittance(to, s, polarisation);
  const double sum = std::norm(y1 + y2);
  const double passed = 4 * (y1 * std::conj(y2)).real() / sum;
  if (!(passed > 0)) return {1, 0};
  return {std::norm(y1 - y2) / sum, passed};
}

double frustrated_transmittance(double from, double gap, OpticalIndex to, double s, double gap_nm,
                                double wavelength_nm, Polarisation polarisation) {
  const OpticalIndex first = optical_index(from), middle = optical_index(gap);
  optical_index(to.real(), -to.imag());
  if (!(gap_nm >= 0) || !std::isfinite(gap_nm))
    throw Error(Failure::Input, "a gap >= 0 nm", std::to_string(gap_nm), "0 for contact");
  if (!(wavelength_nm > 0) || !std::isfinite(wavelength_nm))
    throw Error(Failure::Input, "a wavelength > 0 nm", std::to_string(wavelength_nm), "630 for red light");
  if (s >= first.real() || (to.imag() == 0 && s >= to.real())) return 0;
  const double phase = 2 * std::numbers::pi * gap_nm / wavelength_nm;
  const Complex q = normal_index(middle, s), delta = phase * q;
  constexpr double kOpaque = 300;  // tanh is 1 and cosh near overflow
  if (-delta.imag() > kOpaque) return 0;
  const Complex square = middle * middle;
  const bool is_s = polarisation == Polarisation::S;
  // The layer's characteristic matrix, written so that it stays finite at the critical angle (q = 0).
  const Complex sine_over_y = phase * sinc(delta) * (is_s ? Complex(1) : square);
  const Complex y_sine = phase * q * q * sinc(delta) / (is_s ? Complex(1) : square);
  const Complex y1 = admittance(first, s, polarisation), y3 = admittance(to, s, polarisation);
  const Complex i(0, 1);
  const Complex b = std::cos(delta) + i * y3 * sine_over_y, c = y3 * std::cos(delta) + i * y_sine;
  // The gap takes nothing: the flux behind it is the flux in it.
  return std::min(4 * y1.real() * y3.real() / std::norm(y1 * b + c), 1.0);
}

}  // namespace palpate::optics
