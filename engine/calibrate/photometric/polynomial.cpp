#include "engine/calibrate/photometric/polynomial.h"

#include <algorithm>

namespace palpate {
namespace photometric {
namespace {

// Exponents of X and Y of a term of place.
struct Exponents {
  int across, down;
};

Exponents exponents_of(int term) {
  int degree = 0;
  while (places_of(degree) <= term) ++degree;
  const int down = term - places_of(degree - 1);
  return {degree - down, down};
}

int term_of(Exponents e) {
  return places_of(e.across + e.down - 1) + e.down;
}

int pair_of(int a, int b) {
  const int first = std::min(a, b), second = std::max(a, b);
  return first * kColours - first * (first - 1) / 2 + second - first;
}

}  // namespace

void Moments::add(const Pixel& pixel, double nx, double ny) {
  const auto colours = colour_terms(pixel.change);
  Eigen::Matrix<double, kMoments, 1> places;
  place_terms(pixel.across, pixel.down, kMoments, places.data());
  int pair = 0;
  for (int a = 0; a < kColours; ++a)
    for (int b = a; b < kColours; ++b)
      colours_by_place.col(pair++) +=
          colours[static_cast<size_t>(a)] * colours[static_cast<size_t>(b)] * places;
  for (int c = 0; c < kColours; ++c) {
    to_normal.block<kPlaces, 1>(c * kPlaces, 0) +=
        nx * colours[static_cast<size_t>(c)] * places.head<kPlaces>();
    to_normal.block<kPlaces, 1>(c * kPlaces, 1) +=
        ny * colours[static_cast<size_t>(c)] * places.head<kPlaces>();
  }
  weight += 1;
}

void Moments::add(const Moments& other, double factor) {
  colours_by_place += factor * other.colours_by_place;
  to_normal += factor * other.to_normal;
  weight += factor * other.weight;
}

Eigen::MatrixXd Moments::gram(const std::vector<int>& terms) const {
  const auto n = static_cast<Eigen::Index>(terms.size());
  Eigen::MatrixXd g(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) {
      const int a = terms[static_cast<size_t>(i)], b = terms[static_cast<size_t>(j)];
      const Exponents ea = exponents_of(a % kPlaces), eb = exponents_of(b % kPlaces);
      g(i, j) = g(j, i) = colours_by_place(term_of({ea.across + eb.across, ea.down + eb.down}),
                                           pair_of(a / kPlaces, b / kPlaces));
    }
  return g;
}

}  // namespace photometric

}  // namespace palpate
