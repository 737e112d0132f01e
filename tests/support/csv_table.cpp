#include "tests/support/csv_table.h"

#include <gtest/gtest.h>

#include <sstream>

namespace palpate {

Table::Table(const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  while (std::getline(lines, line)) {
    std::vector<std::string> cells(1);
    for (const char c : line) {
      if (c == ',') {
        cells.emplace_back();
      } else {
        cells.back() += c;
      }
    }
    if (columns.empty()) {
      columns = cells;
    } else {
      rows.push_back(cells);
    }
  }
}

const std::string& Table::at(size_t row, const std::string& column) const {
  static const std::string none = "no such column";
  for (size_t i = 0; i < columns.size(); ++i) {
    if (columns[i] == column) return rows.at(row).at(i);
  }
  ADD_FAILURE() << none << ": " << column;
  return none;
}

double Table::number(size_t row, const std::string& column) const {
  return std::stod(at(row, column));
}

std::vector<double> Table::numbers(const std::string& column) const {
  std::vector<double> found;
  for (size_t row = 0; row < rows.size(); ++row) found.push_back(number(row, column));
  return found;
}

void Table::expect_whole() const {
  for (const auto& row : rows) EXPECT_EQ(row.size(), columns.size());
}

}  // namespace palpate
