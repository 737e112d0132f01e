// Decimal commas in a table whose cells are separated by commas, where its header has as many columns as they
// make.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// Looks at the lines of a table one by one. Every number is cut in two where, behind a first whole cell or
/// none, two or more pairs of cells follow: a whole number without leading zeros, and digits, in each line as
/// many, that begin with 0 in some lines, take many values and are no count. Padded numbers of loggers
/// (states, channels, times of a day, counts) lack one of these.
class CutNumbers {
 public:
  void add(const std::vector<std::string>& cells);
  bool all_cut() const;

 private:
  struct Digits {
    size_t count = 0;
    bool from_zero = false, rise = true, fall = true;
    std::string last;
    std::vector<std::string> values;  ///< different ones, up to kManyValues
  };
  bool fits(const std::vector<std::string>& cells) const;

  static constexpr size_t kManyValues = 8;
  size_t cells_ = 0;  ///< of each line; 0: no line yet
  bool possible_ = true;
  std::vector<Digits> pairs_;
};

/// A whole number, with or without a sign.
bool is_whole_number(std::string_view text);
/// Digits alone, one or more.
bool is_digits(std::string_view text);

}  // namespace palpate
