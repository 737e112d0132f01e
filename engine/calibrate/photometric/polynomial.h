// Normals as PhotometricCalibration's polynomial in colours and place, in doubles.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "palpate/sensor.h"

namespace palpate {

/// The normal (n_x, n_y) that a calibration reads from the changes of red, green and blue,
/// in units of full scale, at X, Y in [-1, 1] across the frame.
std::array<double, 2> polynomial_normal(const PhotometricCalibration& calibration,
                                        const std::array<double, 3>& change, double across, double down);

namespace photometric {

inline constexpr int kColours = 9, kPlaces = 10, kDegree = 3, kTerms = kColours * kPlaces;
/// The place's monomials up to twice the degree: those of products of two terms.
inline constexpr int kMoments = (2 * kDegree + 1) * (2 * kDegree + 2) / 2;
/// Products of two colour terms, and each once.
inline constexpr int kPairs = kColours * (kColours + 1) / 2;

/// A pixel's change of colour (units of full scale) and its place.
struct Pixel {
  std::array<double, 3> change{};
  double across = 0, down = 0;
};

/// The changes and their products rr, rg, rb, gg, gb, bb.
std::array<double, kColours> colour_terms(const std::array<double, 3>& change);
/// 1, X, Y, XX, XY, YY, ...: `count` of them, full degrees.
void place_terms(double across, double down, int count, double* terms);
/// The number of terms of a full degree; 0 of degree -1.
constexpr int places_of(int degree) {
  return (degree + 1) * (degree + 2) / 2;
}

/// Sums over pixels from which the normal equations of every order follow.
struct Moments {
  Eigen::Matrix<double, kMoments, kPairs> colours_by_place = Eigen::Matrix<double, kMoments, kPairs>::Zero();
  Eigen::Matrix<double, kTerms, 2> to_normal = Eigen::Matrix<double, kTerms, 2>::Zero();
  double weight = 0;

  void add(const Pixel& pixel, double nx, double ny);
  void add(const Moments& other, double factor);
  /// Of the terms with these numbers (ten to a colour).
  Eigen::MatrixXd gram(const std::vector<int>& terms) const;
};

}  // namespace photometric
}  // namespace palpate
