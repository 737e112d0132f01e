// A table of numbers with times of its own, such as a robot's log, on its way into a file for others.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace palpate {

struct NumberColumn {
  std::string name;
  std::string unit;                ///< empty: none
  std::span<const double> values;  ///< of each row; NaN: none
};

struct NumberTable {
  std::string name;                ///< small letters, digits and underscores
  std::string origin;              ///< for people: how its times became those of the frames
  std::span<const double> time_s;  ///< of each row, since the recording began, rising
  std::vector<NumberColumn> columns;
};

}  // namespace palpate
