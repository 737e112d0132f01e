#include "perf/lab/judge/judged_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "capture/files/tables/csv_table.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr size_t kMostWords = 20;
constexpr const char* kColumns =
    "columns truth,value,low,high or NAME_truth,NAME,NAME_low,NAME_high, verdict, wrong and conditions";

struct QuantityColumns {
  size_t truth = 0, value = 0;
  std::optional<size_t> low, high;
};

/// Meaning of each column of a table.
struct Columns {
  std::vector<std::string> names;
  std::vector<QuantityColumns> quantities;
  std::optional<size_t> verdict, wrong, group;
  std::vector<size_t> conditions;
};

void find_quantity(const CsvTable& table, const std::string& name, const std::string& value,
                   const std::string& prefix, Columns& columns) {
  QuantityColumns q;
  q.truth = table.require({prefix + "truth"}).front();
  q.value = table.require({value}).front();
  q.low = table.find(prefix + "low");
  q.high = table.find(prefix + "high");
  if (q.low.has_value() != q.high.has_value())
    throw Error(Failure::Input,
                "both columns " + printable(prefix + "low") + " and " + printable(prefix + "high"),
                "one of them", kColumns);
  columns.names.push_back(name);
  columns.quantities.push_back(q);
}

Columns columns_of(const CsvTable& table, const JudgedTableOptions& options) {
  Columns columns;
  const std::vector<std::string>& all = table.columns();
  const std::string ending = "_truth";
  if (table.find("truth")) find_quantity(table, "value", "value", "", columns);
  for (const std::string& column : all)
    if (column.size() > ending.size() && column.ends_with(ending)) {
      const std::string name = column.substr(0, column.size() - ending.size());
      find_quantity(table, name, name, name + "_", columns);
    }
  columns.verdict = table.find("verdict");
  columns.wrong = table.find("wrong");
  columns.group = table.find("group");
  if (columns.quantities.empty() && !columns.verdict)
    throw Error(Failure::Input, "columns of the truth or of what was reported in the first line of the table",
                printable(table.header_line()), kColumns);
  std::set<size_t> taken;
  for (const QuantityColumns& q : columns.quantities) {
    taken.insert({q.truth, q.value});
    if (q.low) taken.insert({*q.low, *q.high});
  }
  for (const std::optional<size_t>& one : {columns.verdict, columns.wrong, columns.group})
    if (one) taken.insert(*one);
  for (const std::string& name : options.by) {
    const std::optional<size_t> column = table.find(name);
    if (!column)
      throw Error(Failure::Usage, "a column of the table", "'" + name + "'" + did_you_mean(name, all),
                  "--by with names of " + printable(table.header_line()));
    // An estimate is judged by cells of its truth: cells of the estimate would gather its errors.
    const auto estimated = std::ranges::find(columns.quantities, *column, &QuantityColumns::value);
    const bool has_truth = estimated != columns.quantities.end();
    columns.conditions.push_back(has_truth ? table.find("true_" + name).value_or(estimated->truth) : *column);
  }
  if (options.by.empty())
    for (size_t i = 0; i < all.size(); ++i)
      if (!taken.contains(i)) columns.conditions.push_back(i);
  if (columns.conditions.empty())
    throw Error(Failure::Input, "a column that varies from case to case (a condition)",
                printable(table.header_line()), kColumns);
  return columns;
}

double number_or_nan(const CsvTable& table, size_t column) {
  return table.number_if_any(column).value_or(kNaN);
}

judge::JudgedValue value_of(const CsvTable& table, const QuantityColumns& q) {
  judge::JudgedValue v{number_or_nan(table, q.truth), number_or_nan(table, q.value), kNaN, kNaN};
  if (!q.low) return v;
  v.low = number_or_nan(table, *q.low);
  v.high = number_or_nan(table, *q.high);
  if (v.low > v.high)
    throw Error(Failure::Input, "an interval with low at most high, " + table.where(),
                text("%g to %g", v.low, v.high), "correcting or removing that line");
  return v;
}

size_t group_of(const CsvTable& table, size_t column) {
  const double number = table.number(column);
  if (!(number >= 0 && number < 1e15 && number == std::floor(number)))
    throw Error(Failure::Input, "a whole number of a group, " + table.where(), text("%g", number),
                "correcting or removing that line");
  return static_cast<size_t>(number);
}

/// Numbers as they are where all of a column are, else words by their place in the order of first mention.
judge::Condition take_condition(const std::string& name, const std::vector<std::string>& cells,
                                const std::vector<double>& numbers, size_t place, judge::Cases& cases) {
  judge::Condition condition{name, {}};
  bool words = false;
  for (size_t i = 0; i < cells.size(); ++i)
    words = words || (std::isnan(numbers[i]) && !cells[i].empty() && cells[i] != "nan");
  std::map<std::string, size_t> places;
  for (size_t i = 0; i < cells.size(); ++i) {
    double& value = cases.cases[i].conditions[place];
    value = numbers[i];
    if (!words) continue;
    value = kNaN;
    if (cells[i].empty()) continue;
    const auto [at, added] = places.emplace(cells[i], places.size());
    if (added) condition.labels.push_back(cells[i]);
    value = static_cast<double>(at->second);
    if (condition.labels.size() > kMostWords)
      throw Error(Failure::Input,
                  text("at most %zu different words in column ", kMostWords) + printable(name), "more",
                  "--by with other columns");
  }
  return condition;
}

}  // namespace

judge::Cases read_judged_table(const std::filesystem::path& file, const JudgedTableOptions& options) {
  CsvTable table(file, "a table of judged cases");
  const Columns columns = columns_of(table, options);
  judge::Cases cases;
  for (const std::string& name : columns.names) cases.quantities.push_back({name, options.promise});
  if (columns.wrong) cases.wrong_means = "as column 'wrong' says";
  std::vector<std::vector<std::string>> cells(columns.conditions.size());
  std::vector<std::vector<double>> numbers(columns.conditions.size());
  size_t reported = 0;
  std::string verdict;
  while (table.next()) {
    judge::JudgedCase one;
    one.conditions.resize(columns.conditions.size());
    for (const QuantityColumns& q : columns.quantities) one.values.push_back(value_of(table, q));
    if (columns.verdict) {
      verdict = table.cell(*columns.verdict);
      one.reported =
          std::find(options.reported.begin(), options.reported.end(), verdict) != options.reported.end();
    }
    reported += one.reported;
    one.wrong = columns.wrong && table.number(*columns.wrong) != 0;
    if (columns.group) one.group = group_of(table, *columns.group);
    for (size_t c = 0; c < columns.conditions.size(); ++c) {
      const std::string& cell = table.cell(columns.conditions[c]);
      cells[c].push_back(cell);
      double number = kNaN;
      try {
        number = number_or_nan(table, columns.conditions[c]);
      } catch (const Error&) {
        // A word.
      }
      numbers[c].push_back(number);
    }
    cases.cases.push_back(std::move(one));
  }
  if (cases.cases.empty())
    throw Error(Failure::Input, "judged cases in " + file.string(), "none", "a line for each case");
  if (reported == 0)
    throw Error(Failure::Input, "a verdict in " + file.string() + " that counts as reported",
                printable(verdict), "--reported with the word that does");
  for (size_t c = 0; c < columns.conditions.size(); ++c)
    cases.conditions.push_back(
        take_condition(options.by.empty() ? table.columns()[columns.conditions[c]] : options.by[c], cells[c],
                       numbers[c], c, cases));
  return cases;
}

}  // namespace palpate
