// Reader of CSV tables, from this program or another: line by line, with quotes, byte order mark, remarks,
// units in the header, and error lines that name file, line and column.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/files/tables/cut_numbers.h"

namespace palpate {

/// How many cells a line may have.
enum class CsvWidth : uint8_t {
  Equal,    ///< as many as the first line
  Shorter,  ///< that many or fewer
  Any,
};

struct CsvOptions {
  std::string_view separators =
      {};              ///< between cells; empty: semicolon, tab or comma, the first the table has
  bool header = true;  ///< the first line names the columns
  CsvWidth width = CsvWidth::Equal;
};

/// A table that is open for reading. Empty lines and lines that begin with # are left out. Where the
/// separator is a semicolon or a tab, decimal commas are understood; between commas they would cut numbers in
/// two, and lines with more cells than the first are refused. All errors are Error(Failure::Input).
class CsvTable {
 public:
  /// Opens the file and reads its header. `wanted` ("a table of points") begins the error lines. Throws on a
  /// file that cannot be read or, where a header is expected, has no line.
  CsvTable(std::filesystem::path file, std::string wanted, CsvOptions options = {});

  /// Reads the next line; false at the end. Throws on a line with a number of cells that `width` does not
  /// allow, with a hint where decimal commas made it so, and on one of more than 1 MiB. Empty cells at a
  /// line's end may be too many where no decimal comma can have made them. Throws at the end where decimal
  /// commas have surely cut every number (CutNumbers).
  bool next();

  const std::filesystem::path& file() const { return file_; }
  /// Names of the columns; empty without a header.
  const std::vector<std::string>& columns() const { return columns_; }
  /// The header's line as it stands.
  const std::string& header_line() const { return header_line_; }
  /// Index of a column; none where the table lacks it. Throws where two have the name.
  std::optional<size_t> find(std::string_view name) const;
  /// Indices of columns that must all be there. Throws, with the header found, where one is not.
  std::vector<size_t> require(const std::vector<std::string>& names) const;

  /// Cells of the line that was read last.
  const std::vector<std::string>& cells() const { return cells_; }
  /// One of them; empty where the line ends before it.
  const std::string& cell(size_t column) const;
  /// One of them as a finite number. Throws, with line and column, where it is none; `remedy` ends the line.
  double number(size_t column, const char* remedy = "correcting or removing that line") const;
  /// The same, or none where the cell is empty or "nan".
  std::optional<double> number_if_any(size_t column) const;

  /// The line that was read last has a whole number before digits with a leading zero ("3,05"), which commas
  /// between cells make of a number with a decimal comma.
  bool seems_cut() const;

  /// "line 3 of FILE", for error lines.
  std::string where() const;

 private:
  bool read_line();
  void choose_separator();
  void check_width();

  std::filesystem::path file_;
  std::string wanted_;
  CsvOptions options_;
  std::ifstream stream_;
  char separator_ = 0;  // the chosen one
  size_t line_number_ = 0;
  size_t width_ = 0;  // cells of the first line
  std::string line_, header_line_;
  std::vector<std::string> columns_, cells_;
  CutNumbers cut_;
};

/// Cells of one line: cut at any of `separators`, without the blanks around them and the quotes ("" within
/// quotes is one quote, and separators and blanks there are text). One cell at least.
std::vector<std::string> csv_cells(std::string_view line, std::string_view separators = ",");

/// A cell as a finite number; none where it is no such.
std::optional<double> csv_number(std::string cell, bool decimal_comma = false);

/// `text` as one cell, in quotes where it needs them; control characters become '?'.
std::string csv_cell(std::string text);

/// A column's name and unit: "force_mN", "Force [mN]", "force (mN)" and "force mN" are force and mN.
struct ColumnHeader {
  std::string text;  ///< as it stands
  std::string name;  ///< in small letters; the whole text where it has no unit
  std::string unit;  ///< empty: none
};
ColumnHeader column_header(const std::string& cell);

/// In small letters: A to Z alone are changed.
std::string lower(std::string text);

/// In quotes, shortened, and with question marks for what cannot be printed.
std::string printable(std::string text);

}  // namespace palpate
