#include "capture/files/tables/csv_table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "engine/base/readable.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr size_t kLongestLine_B = 1u << 20;
constexpr std::array kByteOrderMark{'\xef', '\xbb', '\xbf'};

bool blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string joined(const std::vector<std::string>& names) {
  std::string line;
  for (const std::string& name : names) {
    const std::string quoted = printable(name);
    line += (line.empty() ? "" : ",") + quoted.substr(1, quoted.size() - 2);
  }
  return line;
}

/// How many whole numbers stand before a cell of digits: as many decimal commas the line may have had.
size_t cut_numbers(const std::vector<std::string>& cells) {
  size_t count = 0;
  for (size_t i = 0; i + 1 < cells.size(); ++i)
    count += is_whole_number(cells[i]) && is_digits(cells[i + 1].substr(0, cells[i + 1].find_first_of("eE")));
  return count;
}

constexpr const char* kNoDecimalCommas = "decimal points, or semicolons between the cells";

}  // namespace

std::optional<double> csv_number(std::string cell, bool decimal_comma) {
  if (decimal_comma) std::replace(cell.begin(), cell.end(), ',', '.');
  if (!cell.empty() && cell.front() == '+') cell.erase(0, 1);
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::string lower(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

CsvTable::CsvTable(std::filesystem::path file, std::string wanted, CsvOptions options)
    : file_(std::move(file)), wanted_(std::move(wanted)), options_(options) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(file_, ignored)) stream_.open(file_, std::ios::binary);
  if (const std::string why = why_unreadable(file_); !why.empty() || !stream_.is_open())
    throw Error(Failure::Input, wanted_, file_.string() + ": " + (why.empty() ? "a read error" : why),
                "another path");
  if (!options_.header) return;
  if (!read_line())
    throw Error(Failure::Input, wanted_, "an empty file " + file_.string(), "a first line with the columns");
  header_line_ = line_;
  columns_ = cells_;
}

bool CsvTable::next() {
  if (read_line()) {
    if (separator_ == ',') cut_.add(cells_);
    return true;
  }
  if (cut_.all_cut())
    throw Error(Failure::Input, wanted_ + ", its numbers in one cell each",
                "every number cut in two by its decimal comma in " + file_.string(), kNoDecimalCommas);
  return false;
}

bool CsvTable::read_line() {
  while (true) {
    line_.clear();
    int c = 0;
    while ((c = stream_.rdbuf()->sbumpc()) != std::ifstream::traits_type::eof() && c != '\n') {
      if (line_.size() >= kLongestLine_B)
        throw Error(
            Failure::Input, wanted_,
            "a line of more than 1 MiB in " + file_.string() + ", line " + std::to_string(line_number_ + 1),
            "a text file with a line for each row");
      line_ += static_cast<char>(c);
    }
    if (c != '\n' && line_.empty()) return false;
    if (++line_number_ == 1 && line_.starts_with(std::string_view(kByteOrderMark.data(), 3)))
      line_.erase(0, 3);
    if (line_.ends_with('\r')) line_.pop_back();
    if (trimmed(line_).empty() || line_.front() == '#') continue;
    if (width_ == 0) choose_separator();
    cells_ = csv_cells(line_, separator_ != 0 ? std::string_view(&separator_, 1) : options_.separators);
    if (width_ == 0) width_ = cells_.size();
    check_width();
    return true;
  }
}

void CsvTable::check_width() {
  if (options_.width == CsvWidth::Any || cells_.size() == width_) return;
  if (options_.width == CsvWidth::Shorter && cells_.size() < width_) return;
  const bool more = cells_.size() > width_;
  const auto extra = cells_.begin() + static_cast<ptrdiff_t>(std::min(width_, cells_.size()));
  const bool points = std::any_of(cells_.begin(), cells_.end(), [](const std::string& c) {
    return c.find('.') != std::string::npos && csv_number(c, false);
  });
  // Separators at the line's end are nothing; between commas they may also stand for cells that decimal
  // commas pushed there.
  if (options_.width == CsvWidth::Shorter && (points || separator_ != ',') &&
      std::all_of(extra, cells_.end(), [](const std::string& c) { return c.empty(); })) {
    cells_.erase(extra, cells_.end());
    return;
  }
  const bool commas = more && separator_ == ',' && !points && cut_numbers(cells_) > 0;
  throw Error(Failure::Input,
              (options_.width == CsvWidth::Shorter ? "at most " : "") + std::to_string(width_) +
                  " cells in " + where(),
              std::to_string(cells_.size()) +
                  (commas ? ": decimal commas between cells that commas separate cut numbers in two" : ""),
              commas ? kNoDecimalCommas : "as many in each line as in the first");
}

bool CsvTable::seems_cut() const {
  if (separator_ != ',') return false;
  for (size_t i = 0; i + 1 < cells_.size(); ++i)
    if (is_whole_number(cells_[i]) && is_digits(cells_[i + 1]) && cells_[i + 1].size() > 1 &&
        cells_[i + 1].front() == '0')
      return true;
  return false;
}

void CsvTable::choose_separator() {
  if (!options_.separators.empty()) return;
  for (const char separator : {';', '\t', ','}) {
    separator_ = separator;
    if (line_.find(separator) != std::string::npos) return;
  }
}

std::optional<size_t> CsvTable::find(std::string_view name) const {
  const auto count = std::count(columns_.begin(), columns_.end(), name);
  if (count > 1)
    throw Error(Failure::Input, "one column " + printable(std::string(name)) + " in " + file_.string(),
                std::to_string(count), "a name of its own for each column");
  if (count == 0) return std::nullopt;
  return static_cast<size_t>(std::find(columns_.begin(), columns_.end(), name) - columns_.begin());
}

std::vector<size_t> CsvTable::require(const std::vector<std::string>& names) const {
  std::vector<size_t> indices;
  std::string missing;
  size_t count = 0;
  for (const std::string& name : names) {
    const std::optional<size_t> column = find(name);
    if (column) indices.push_back(*column);
    if (!column) missing += (count++ > 0 ? " and " : "") + printable(name);
  }
  if (count > 0)
    throw Error(Failure::Input,
                (count > 1 ? "columns " : "a column ") + missing + " in the first line of " + file_.string(),
                printable(header_line_), "a first line with " + joined(names));
  return indices;
}

const std::string& CsvTable::cell(size_t column) const {
  static const std::string kEmpty;
  return column < cells_.size() ? cells_[column] : kEmpty;
}

double CsvTable::number(size_t column, const char* remedy) const {
  const std::string& found = cell(column);
  const std::optional<double> value = csv_number(found, separator_ == ';' || separator_ == '\t');
  if (value) return *value;
  const std::string name =
      column < columns_.size() ? printable(columns_[column]) : std::to_string(column + 1);
  // Quotes kept it whole.
  const bool comma = separator_ == ',' && found.find(',') != std::string::npos && csv_number(found, true);
  throw Error(Failure::Input, "a finite number in column " + name + ", " + where(),
              found.empty() ? "none" : printable(found), comma ? kNoDecimalCommas : remedy);
}

std::optional<double> CsvTable::number_if_any(size_t column) const {
  const std::string& text = cell(column);
  if (text.empty() || lower(text) == "nan") return std::nullopt;
  return number(column);
}

std::string CsvTable::where() const {
  return "line " + std::to_string(line_number_) + " of " + file_.string();
}

std::vector<std::string> csv_cells(std::string_view line, std::string_view separators) {
  std::vector<std::string> cells(1);
  bool inside = false;
  size_t quoted = 0;  // of the cell, up to where blanks are text
  const auto end_cell = [&] {
    std::string& cell = cells.back();
    while (cell.size() > quoted && blank(cell.back())) cell.pop_back();
    quoted = 0;
  };
  for (size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    std::string& cell = cells.back();
    if (c == '"' && inside && i + 1 < line.size() && line[i + 1] == '"') {
      cell += line[++i];
    } else if (c == '"') {
      inside = !inside;
      quoted = cell.size();
    } else if (!inside && separators.find(c) != std::string_view::npos) {
      end_cell();
      cells.emplace_back();
    } else if (inside || !blank(c) || !cell.empty()) {
      cell += c;
    }
  }
  end_cell();
  return cells;
}

std::string csv_cell(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ') c = '?';
  const bool blanks = !text.empty() && (blank(text.front()) || blank(text.back()));
  if (!blanks && text.find_first_of(",;\"") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

ColumnHeader column_header(const std::string& cell) {
  ColumnHeader header{cell, "", ""};
  const size_t bracket = cell.find_first_of("[(");
  size_t split = bracket != std::string::npos ? bracket : cell.rfind('_');
  if (split == std::string::npos) split = cell.rfind(' ');
  header.name = lower(std::string(trimmed(std::string_view(cell).substr(0, split))));
  if (split != std::string::npos) {
    const size_t end = cell.find_last_not_of("]) ");
    header.unit = trimmed(std::string_view(cell).substr(split + 1, end - split));
  }
  return header;
}

std::string printable(std::string text) {
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  for (char& c : text)
    if (c < ' ' || c > '~') c = '?';
  return "'" + text + "'";
}

}  // namespace palpate
