// Polynomials through the origin and values at known places.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// Weights of the values at `places` in the value at `place`: value over place is a polynomial through all of
/// them. One place or more, all different and not 0.
inline std::vector<double> weights_through_origin(std::span<const double> places, double place) {
  std::vector<double> weights;
  weights.reserve(places.size());
  for (size_t own = 0; own < places.size(); ++own) {
    double weight = place / places[own];
    for (size_t other = 0; other < places.size(); ++other)
      if (other != own) weight *= (place - places[other]) / (places[own] - places[other]);
    weights.push_back(weight);
  }
  return weights;
}

}  // namespace palpate
