// Values at rising times: the usual step between them, gaps, and what lies between two.
#pragma once

#include <cstddef>
#include <span>

namespace palpate {

/// The middle one of the steps from each time to the next; 0 for fewer than two times.
double usual_step(std::span<const double> time_s);

/// The longest step that is no gap: five usual ones, and 20 ms.
double longest_step(std::span<const double> time_s);

/// A place in a series: the part `share` of the way from `from` to `to`.
struct SeriesPlace {
  size_t from = 0, to = 0;  ///< the same one at its very time
  double share = 0;

  /// Straight between the two.
  double of(std::span<const double> values) const {
    return from == to ? values[to] : values[from] + share * (values[to] - values[from]);
  }
};

/// Where `at_s` lies, which must not be before the first time or behind the last. Times rise.
SeriesPlace place_in(std::span<const double> time_s, double at_s);

}  // namespace palpate
