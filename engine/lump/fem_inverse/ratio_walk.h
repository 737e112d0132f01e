// From the best lump along lumps that are the best of their ratios, led by the emulator.
#pragma once

#include "engine/lump/fem_inverse/search.h"

namespace palpate::lump {

/// Walks by the emulator to where it expects the end, asks the elements there, and goes on from what they
/// say. Intermediate places are asked on the grid that is searched alone, an end on all grids.
class DirectSearch::RatioWalk {
 public:
  /// Keeps the search and `best`; the rest as ratio_end().
  RatioWalk(DirectSearch& search, const State& best, double direction, double allowed, double step);

  RatioEnd end();

 private:
  struct Place {
    State state;
    double risen = 0;  ///< the root of what chi2 rose by
  };
  /// The best lump of the state's ratio.
  Place relaxed(State state) const;
  /// By the emulator from where the elements were asked last, to where it expects the end.
  std::optional<State> expected_end(Place here);
  /// The same lump, or the best of its ratio, with the elements asked. None where they have no answer.
  std::optional<Place> ask(State at);
  bool lower(const State& state) const;
  /// The lump between two places where chi2 has risen by what is allowed.
  Case::Lump crossing(const Place& from, const Place& to) const;
  /// The lump so many times as far from the best one.
  Case::Lump on_line(const State& through, double times) const;

  DirectSearch& search_;
  const State& best_;
  double direction_, wanted_, step_, least_;
};

}  // namespace palpate::lump
