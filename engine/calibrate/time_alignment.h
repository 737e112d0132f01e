// Two clocks that saw the same presses: by how much one is off, from the shapes of what both recorded.
#pragma once

#include <span>
#include <string>
#include <utility>

namespace palpate {

struct TimeAlignment {
  double offset_s = 0;     ///< add to the second clock's times to get the first's
  double sd_s = 0;         ///< its standard error
  double correlation = 0;  ///< of the two at that offset, -1 to 1
  double rival = 0;        ///< at the next best offset that is a peak of its own; -1: there is none
  double rival_s = 0;      ///< where that lies
  double opposite = 0;     ///< the lowest correlation at any offset, 0 where none is negative
  double opposite_s = 0;   ///< where that lies
};

/// The offset at which `second` (values at rising times on its own clock, straight between) goes best with
/// `first`, both of the same sign: the largest correlation among all offsets that leave 60 % of the shorter
/// record in common, refined below a sample by a parabola. `breaks`: pairs of times of the second clock
/// between which nothing is known. `recording` names the first in errors. Throws Error(Failure::Input) where
/// either does not vary; how good the offset is does not matter.
TimeAlignment find_in_time(std::span<const double> first_time_s, std::span<const double> first,
                           std::span<const double> second_time_s, std::span<const double> second,
                           std::span<const std::pair<double, double>> breaks = {},
                           const std::string& recording = "the recording");

/// Throws Error(Failure::Input) where the correlation is below 0.8, where the second's opposite goes much
/// better with the first, and where another offset explains nearly as much.
void check_alignment(const TimeAlignment& found, const std::string& recording = "the recording");

/// Both.
TimeAlignment align_in_time(std::span<const double> first_time_s, std::span<const double> first,
                            std::span<const double> second_time_s, std::span<const double> second,
                            std::span<const std::pair<double, double>> breaks = {});

}  // namespace palpate
