// A profile as tables: for the terminal, for the report, and as CSV files.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "perf/profile/profile.h"

namespace palpate::perf {

/// Cells are ready to be read; units stand in the columns' names.
struct Table {
  std::string title;
  std::string note;  ///< what the columns mean; may be empty
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;
};

std::vector<Table> tables_of(const Profile& profile);
std::string to_text(const Table& table);

/// Name and content of each CSV file; every column that has a unit ends in it.
std::vector<std::pair<std::string, std::string>> csv_files(const Profile& profile);

/// Three significant digits, never in powers of ten between 0.001 and 99999: "12.3", "0.0123", "1.2e-08".
std::string figure(double value);
/// "1.5 GB", "12 kB".
std::string bytes_text(uint64_t bytes);
/// One CSV cell, quoted where it must be.
std::string csv_cell(const std::string& text);

}  // namespace palpate::perf
