// Normals as PhotometricCalibration's polynomial in colours and place, in doubles.
#pragma once

#include <array>

#include "palpate/sensor.h"

namespace palpate {

/// The normal (n_x, n_y) that a calibration reads from the changes of red, green and blue,
/// in units of full scale, at X, Y in [-1, 1] across the frame.
std::array<double, 2> polynomial_normal(const PhotometricCalibration& calibration,
                                        const std::array<double, 3>& change, double across, double down);

namespace photometric {

inline constexpr int kColours = 9, kPlaces = 10, kDegree = 3, kTerms = kColours * kPlaces;

/// The changes and their products rr, rg, rb, gg, gb, bb.
std::array<double, kColours> colour_terms(const std::array<double, 3>& change);
/// 1, X, Y, XX, XY, YY, ...: `count` of them, full degrees.
void place_terms(double across, double down, int count, double* terms);
/// The number of terms of a full degree; 0 of degree -1.
constexpr int places_of(int degree) {
  return (degree + 1) * (degree + 2) / 2;
}

}  // namespace photometric
}  // namespace palpate
