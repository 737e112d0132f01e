#include "engine/sensor/polynomial_normal.h"

namespace palpate {
namespace photometric {

std::array<double, kColours> colour_terms(const std::array<double, 3>& change) {
  const auto [r, g, b] = change;
  return {r, g, b, r * r, r * g, r * b, g * g, g * b, b * b};
}

void place_terms(double across, double down, int count, double* terms) {
  terms[0] = 1;
  // Each degree is the one before times X, and its last term times Y.
  for (int degree = 1; places_of(degree) <= count; ++degree) {
    const int from = places_of(degree - 2), at = places_of(degree - 1);
    for (int k = 0; k < degree; ++k) terms[at + k] = terms[from + k] * across;
    terms[at + degree] = terms[at - 1] * down;
  }
}

}  // namespace photometric

std::array<double, 2> polynomial_normal(const PhotometricCalibration& calibration,
                                        const std::array<double, 3>& change, double across, double down) {
  const auto colours = photometric::colour_terms(change);
  std::array<double, photometric::kPlaces> places;
  const size_t terms = calibration.wx.front().size();
  photometric::place_terms(across, down, static_cast<int>(terms), places.data());
  std::array<double, 2> normal{};
  for (size_t c = 0; c < calibration.wx.size(); ++c)
    for (size_t p = 0; p < terms; ++p) {
      normal[0] += calibration.wx[c][p] * colours[c] * places[p];
      normal[1] += calibration.wy[c][p] * colours[c] * places[p];
    }
  return normal;
}

}  // namespace palpate
