// Least squares of the normals that a polynomial in colours and place reads.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "engine/sensor/polynomial_normal.h"

namespace palpate {

namespace photometric {

/// The place's monomials up to twice the degree: those of products of two terms.
inline constexpr int kMoments = (2 * kDegree + 1) * (2 * kDegree + 2) / 2;
/// Products of two colour terms, and each once.
inline constexpr int kPairs = kColours * (kColours + 1) / 2;

/// A pixel's change of colour (units of full scale) and its place.
struct Pixel {
  std::array<double, 3> change{};
  double across = 0, down = 0;
};

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
