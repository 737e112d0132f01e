// A table as our programs write it: a line of names, a comma between cells, no quotes.
#pragma once

#include <string>
#include <vector>

namespace palpate {

struct Table {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;

  explicit Table(const std::string& text);

  /// A failure of the test, and not a crash, where there is no such column.
  const std::string& at(size_t row, const std::string& column) const;
  double number(size_t row, const std::string& column) const;
  std::vector<double> numbers(const std::string& column) const;
  void expect_whole() const;
};

}  // namespace palpate
