#include "capture/log/log_table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <optional>

#include "capture/files/tables/csv_table.h"
#include "engine/base/json.h"
#include "engine/base/numbers.h"
#include "engine/base/readable.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kSetAnew_s = 1;  // a clock that goes back, or leaves the arrivals, by more than this was set

constexpr std::array kUnits = {"N",   "mN",   "kN",    "Nm",   "Nmm",   "mm",   "um",  "m",   "cm", "rad",
                               "deg", "mrad", "rad/s", "mm/s", "m/s",   "s",    "ms",  "us",  "ns", "Hz",
                               "Pa",  "kPa",  "MPa",   "V",    "mV",    "A",    "mA",  "C",   "K",  "g",
                               "kg",  "%",    "bar",   "rpm",  "deg/s", "m/s2", "mm2", "mm3", "W",  "gf"};

std::string known_unit(const std::string& name) {
  // "joints_rad.3" is one of several.
  const std::string stem = name.substr(0, name.find_last_not_of("0123456789") + 1);
  const bool one_of_several = stem.size() < name.size() && stem.ends_with('.');
  const std::string unit = column_header(one_of_several ? stem.substr(0, stem.size() - 1) : name).unit;
  return std::ranges::find(kUnits, unit) != kUnits.end() ? unit : std::string();
}

/// Rows without a time go, those that overtook others on their way return to their places, and where the
/// clock was set a stretch begins.
void order_rows(LogTable& table, const std::string& where) {
  table.stretches = {0};
  if (table.stamps == LogStamps::None) return;
  const auto& t = table.stamp_s;
  std::vector<size_t> order;
  for (size_t i = 0; i < table.rows(); ++i) {
    if (!std::isfinite(t[i])) continue;
    if (!order.empty()) {
      const size_t last = order.back();
      const double step_s = t[i] - t[last], came_s = table.arrived_s[i] - table.arrived_s[last];
      if (step_s < -kSetAnew_s && !std::isfinite(came_s))
        throw Error(Failure::Input, "times that rise in " + where,
                    text("%.6g s after %.6g s, row %zu", t[i], t[last], i + 1),
                    "one recording a file, in order");
      if (step_s < -kSetAnew_s || step_s - came_s > kSetAnew_s) table.stretches.push_back(order.size());
    }
    order.push_back(i);
  }
  if (order.empty())
    throw Error(Failure::Input, "times in column " + printable(table.time_column) + " of " + where,
                "no row with one", "a time in each row");
  if (order.size() < table.rows())
    table.notes.push_back(std::to_string(table.rows() - order.size()) + " rows without a time left out");
  for (size_t s = 0; s < table.stretches.size(); ++s) {
    const size_t end = s + 1 < table.stretches.size() ? table.stretches[s + 1] : order.size();
    std::stable_sort(order.begin() + static_cast<ptrdiff_t>(table.stretches[s]),
                     order.begin() + static_cast<ptrdiff_t>(end),
                     [&](size_t a, size_t b) { return t[a] < t[b]; });
  }
  pick_rows(table, order);
  const size_t again = table.stretches.size() - 1;
  if (again > 0)
    table.notes.push_back("the log's clock was set anew " + std::to_string(again) +
                          (again == 1 ? " time" : " times"));
}

using Leaf = std::pair<std::string, std::string>;

/// Leaves of nested objects and lists under their joined names.
void flatten(const json::Value& value, const std::string& name, std::vector<Leaf>& leaves) {
  const auto below = [&](const std::string& key) { return name.empty() ? key : name + "." + key; };
  if (value.is_object()) {
    for (size_t i = 0; i < value.size(); ++i) flatten(value.begin()[i], below(value.keys()[i]), leaves);
  } else if (value.is_array()) {
    for (size_t i = 0; i < value.size(); ++i) flatten(value.begin()[i], below(std::to_string(i)), leaves);
  } else if (value.is_boolean()) {
    leaves.emplace_back(name, value.boolean() ? "1" : "0");
  } else if (!value.is_null()) {
    leaves.emplace_back(name, value.is_string() ? value.text() : value.dump());
  }
}

}  // namespace

void pick_rows(LogTable& table, const std::vector<size_t>& rows) {
  const auto pick = [&](std::vector<double>& values) {
    std::vector<double> picked;
    picked.reserve(rows.size());
    for (const size_t row : rows) picked.push_back(values[row]);
    values = std::move(picked);
  };
  pick(table.arrived_s);
  if (!table.stamp_s.empty()) pick(table.stamp_s);
  for (LogColumn& column : table.columns) pick(column.values);
}

struct LogReader::Impl {
  std::string name, where;
  bool begun = false, json = false, decimal_comma = false;
  char separator = ',';
  size_t line_number = 0, rows = 0, refused = 0;
  std::string first_refusal;
  std::vector<std::string> header;
  std::vector<CellColumn> columns;      ///< in order of appearance; shorter where rows lack them at the end
  std::map<std::string, size_t> index;  ///< of JSON's
  std::vector<int64_t> arrived_ns;
  std::vector<std::string> notes;

  bool begin(std::string_view line);
  void add_csv(std::string_view line, int64_t at_ns);
  void add_json(std::string_view line, int64_t at_ns);
  void refuse(const std::string& why);
  void put(CellColumn& column, const std::string& cell) const;
  LogTable table();
  void take_columns(LogTable& table, const std::vector<size_t>& time_columns);
  [[noreturn]] void fail(const std::string& wanted, const std::string& found,
                         const std::string& remedy) const {
    throw Error(Failure::Input, wanted + " in " + where, found, remedy);
  }
};

/// False where the line is the names of the columns.
bool LogReader::Impl::begin(std::string_view line) {
  begun = true;
  json = line.front() == '{';
  if (json) return true;
  for (const char candidate : {';', '\t', ','}) {
    separator = candidate;
    if (line.find(candidate) != std::string_view::npos) break;
  }
  decimal_comma = separator != ',';
  header = csv_cells(line, std::string_view(&separator, 1));
  if (header.size() > kMostLogColumns)
    fail("at most " + std::to_string(kMostLogColumns) + " columns", std::to_string(header.size()),
         "leaving some out");
  const auto numbers = std::ranges::count_if(
      header, [&](const std::string& cell) { return csv_number(cell, decimal_comma).has_value(); });
  if (numbers != 0 && static_cast<size_t>(numbers) != header.size())
    fail("a first line with the names of the columns", printable(std::string(line)), "naming each of them");
  if (numbers != 0) {
    // Whoever began to listen late has missed the names.
    for (size_t i = 0; i < header.size(); ++i) header[i] = "column_" + std::to_string(i + 1);
    notes.push_back("the first line names no columns: they are called column_1 to column_" +
                    std::to_string(header.size()) + "; lines of JSON name theirs");
  }
  for (const std::string& one : header) columns.push_back({.name = one});
  return numbers != 0;
}

void LogReader::Impl::refuse(const std::string& why) {
  if (refused++ == 0) first_refusal = "line " + std::to_string(line_number) + ": " + why;
}

/// A cell of the row in hand, which is not counted yet.
void LogReader::Impl::put(CellColumn& column, const std::string& cell) const {
  column.values.resize(rows, kNaN);
  double value = kNaN;
  if (const std::optional<double> number = csv_number(cell, decimal_comma)) {
    value = *number;
    ++column.numbers;
  } else if (!cell.empty() && lower(cell) != "nan") {
    value = date_s(cell);
    ++(std::isfinite(value) ? column.dates : column.others);
  }
  column.values.push_back(value);
}

void LogReader::Impl::add_csv(std::string_view line, int64_t at_ns) {
  std::vector<std::string> cells = csv_cells(line, std::string_view(&separator, 1));
  while (cells.size() > header.size() && cells.back().empty()) cells.pop_back();
  if (cells == header) return;  // the names again, of a program that was started again
  if (cells.size() != header.size())
    return refuse(std::to_string(cells.size()) + " cells, " + std::to_string(header.size()) + " columns");
  for (size_t i = 0; i < cells.size(); ++i) put(columns[i], cells[i]);
  arrived_ns.push_back(at_ns);
  ++rows;
}

void LogReader::Impl::add_json(std::string_view line, int64_t at_ns) {
  std::vector<Leaf> leaves;
  try {
    const json::Value value = json::parse(line, {.unique_keys = true, .deepest = 16});
    if (!value.is_object()) return refuse("no object of JSON");
    flatten(value, {}, leaves);
  } catch (const json::Error& error) {
    return refuse(error.what());
  }
  if (columns.size() + leaves.size() > 2 * kMostLogColumns) return refuse("more columns than can be read");
  for (const auto& [key, cell] : leaves) {
    const auto [at, is_new] = index.try_emplace(key, columns.size());
    if (is_new) columns.push_back({.name = key});
    // "a.b" may be one key, and b within a.
    if (columns[at->second].values.size() <= rows) put(columns[at->second], cell);
  }
  arrived_ns.push_back(at_ns);
  ++rows;
}

/// Columns that hold numbers; what holds text alone is told.
void LogReader::Impl::take_columns(LogTable& table, const std::vector<size_t>& time_columns) {
  std::string without;
  size_t unread = 0, damaged = 0;
  for (size_t c = 0; c < columns.size(); ++c) {
    CellColumn& column = columns[c];
    if (std::ranges::find(time_columns, c) != time_columns.end()) continue;
    column.values.resize(rows, kNaN);
    if (column.numbers > 0) {
      table.columns.push_back({column.name, known_unit(column.name), std::move(column.values)});
      damaged += column.others;
    } else if (unread++ < 5) {
      without += (without.empty() ? "" : ", ") + printable(column.name);
    }
  }
  if (table.columns.empty())
    fail("a column of numbers", "none beside the time", "a log of poses, joints or forces");
  if (unread > 5) without += " and " + std::to_string(unread - 5) + " more";
  if (unread > 0) table.notes.push_back("columns without numbers are not read: " + without);
  if (damaged > 0)
    table.notes.push_back(std::to_string(damaged) + (damaged == 1 ? " cell" : " cells") +
                          " without a number left empty");
}

LogTable LogReader::Impl::table() {
  if (rows == 0)
    fail("lines of numbers",
         refused > 0        ? first_refusal
         : line_number == 0 ? "no line"
                            : "the names alone",
         "CSV with names in its first line, or an object of JSON a line");
  if (refused > rows)
    fail("lines that fit",
         std::to_string(refused) + " of " + std::to_string(rows + refused) + " that do not; " + first_refusal,
         "one kind of line in one log");
  LogTable table{.name = name, .notes = notes};
  if (refused > 0)
    table.notes.push_back(std::to_string(refused) + (refused == 1 ? " line" : " lines") + " left out; " +
                          first_refusal);
  for (const int64_t ns : arrived_ns)
    table.arrived_s.push_back(ns == 0 ? kNaN : 1e-9 * static_cast<double>(ns));
  for (CellColumn& column : columns) column.values.resize(rows, kNaN);
  StampColumns stamps = find_stamps(columns, table.arrived_s, where);
  table.stamps = stamps.kind;
  table.time_column = stamps.name;
  table.stamp_s = std::move(stamps.time_s);
  take_columns(table, stamps.columns);
  order_rows(table, where);
  return table;
}

LogReader::LogReader(std::string name, std::string where) : impl_(std::make_unique<Impl>()) {
  impl_->name = std::move(name);
  impl_->where = std::move(where);
}

LogReader::~LogReader() = default;

void LogReader::add(std::string_view line, int64_t arrived_ns) {
  Impl& m = *impl_;
  ++m.line_number;
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (m.line_number == 1 && line.starts_with(kByteOrderMark)) line.remove_prefix(kByteOrderMark.size());
  while (!line.empty() && (line.back() == '\r' || line.back() == '\n' || line.back() == ' '))
    line.remove_suffix(1);
  if (line.empty() || line.front() == '#') return;
  if (line.size() > kLongestLogLine_B) return m.refuse("longer than 64 KiB");
  if (!m.begun && !m.begin(line)) return;
  m.json ? m.add_json(line, arrived_ns) : m.add_csv(line, arrived_ns);
}

LogTable LogReader::take() {
  return impl_->table();
}

LogTable read_log(const std::filesystem::path& file, const std::string& name) {
  if (const std::string why = why_unreadable(file); !why.empty())
    throw Error(Failure::Input, "a log of CSV or JSON lines", file.string() + ": " + why, "another path");
  std::ifstream in(file, std::ios::binary);
  LogReader reader(name, file.string());
  const bool stamped = file.extension() == kLogLines;
  for (std::string line; std::getline(in, line);) {
    if (stamped && in.eof()) break;  // cut by a kill: the rest of the line is not there
    if (!stamped) {
      reader.add(line, 0);
      continue;
    }
    const size_t tab = line.find('\t');
    int64_t arrived_ns = 0;
    if (tab == std::string::npos ||
        std::from_chars(line.data(), line.data() + tab, arrived_ns).ptr != line.data() + tab)
      throw Error(Failure::Input, "a time and a tab before each line of " + file.string(), printable(line),
                  "the session's log as it was recorded");
    reader.add(std::string_view(line).substr(tab + 1), arrived_ns);
  }
  return reader.take();
}

}  // namespace palpate
