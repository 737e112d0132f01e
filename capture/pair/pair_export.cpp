#include "capture/pair/pair_export.h"

#include <cmath>
#include <string>
#include <vector>

#include "capture/files/tables/csv_table.h"
#include "capture/pair/pair_clock.h"
#include "capture/pair/pair_files.h"
#include "engine/base/clock.h"
#include "engine/base/json.h"
#include "engine/base/numbers.h"

namespace palpate {
namespace {

struct Column {
  std::string name, unit, text;
  bool words = false;
  size_t at = 0;  ///< in the table
};

std::vector<Column> columns_of(CsvTable& table) {
  std::vector<Column> columns;
  const auto add = [&](const std::string& name, const char* unit, const std::string& text, bool words) {
    columns.push_back({name, unit, text, words, table.require({name})[0]});
  };
  for (const MeasuredQuantity<GripFrame>& q : grip_quantities()) {
    add(q.name, q.unit, q.sentence, q.kind == QuantityKind::Word);
    if (q.kind != QuantityKind::Estimated) continue;
    add(error_name(q), q.unit, std::string("Standard error of ") + q.name + ".", false);
    if (q.state) add(q.state, "", std::string("State of ") + q.name + ": valid, or why not.", true);
  }
  return columns;
}

/// The file's datasets or topic, row by row.
class Rows {
 public:
  Rows(FilesForOthers& files, std::vector<Column> columns) : files_(files), columns_(std::move(columns)) {
    if (files_.episode)
      for (const Column& c : columns_)
        datasets_.push_back(files_.episode->writer().add(
            {"/pair/" + c.name, c.words ? Hdf5Type::Text : Hdf5Type::F64, {}, c.unit, c.text}));
    if (!files_.mcap) return;
    json::Value properties{{"stamp", {{"type", "object"}}}};
    for (const Column& c : columns_)
      properties[c.name] = {{"type", c.words ? "string" : "number"}, {"description", c.text}};
    const json::Value schema{{"title", "palpate.Pair"}, {"type", "object"}, {"properties", properties}};
    channel_ = files_.mcap->add_channel({.kind = TopicKind::Events,
                                         .name = "/pair",
                                         .encoding = "json",
                                         .schema_name = "palpate.Pair",
                                         .schema_encoding = "jsonschema",
                                         .schema = schema.dump()});
  }
  void add(const CsvTable& table) {
    json::Value line;
    for (size_t i = 0; i < columns_.size(); ++i) {
      const Column& c = columns_[i];
      const std::string& word = table.cell(c.at);
      const double number = c.words ? kNaN : table.number_if_any(c.at).value_or(kNaN);
      if (files_.episode && c.words) files_.episode->writer().append_text(datasets_[i], word);
      if (files_.episode && !c.words) files_.episode->writer().append(datasets_[i], &number);
      if (!word.empty()) line[c.name] = c.words ? json::Value(word) : json::Value(number);
    }
    if (files_.mcap) write(line);
    ++row_;
  }

 private:
  void write(json::Value& line) {
    const int64_t stamp = files_.zero_ns + std::llround(1e9 * line.at("time_s").number());
    line["stamp"] = {{"sec", stamp / 1'000'000'000}, {"nanosec", stamp % 1'000'000'000}};
    const std::string text = line.dump();
    const std::vector<uint8_t> message(text.begin(), text.end());
    files_.mcap->writer().write(channel_, row_, stamp, message);
    files_.mcap->writer().end_chunk_if_due(monotonic_ns());
  }

  FilesForOthers& files_;
  std::vector<Column> columns_;
  std::vector<size_t> datasets_;
  uint16_t channel_ = 0;
  uint32_t row_ = 0;
};

}  // namespace

std::vector<std::string> add_pair_rows(const std::filesystem::path& folder, FilesForOthers& files) {
  CsvTable table(folder / kPairRows, "the rows of two fingers", {.separators = ",", .width = CsvWidth::Any});
  Rows rows(files, columns_of(table));
  while (table.next())
    if (table.cells().size() == table.columns().size()) rows.add(table);  // a kill may cut the last one
  std::vector<std::string> lines;
  for (const AlignedLog& log : session_logs(folder, lines, [](const std::filesystem::path& from) {
         return pair_clock(from, from / kPairRows);
       })) {
    add_log(log, files, files.zero_ns);
    lines.push_back(describe(log));
  }
  return lines;
}

}  // namespace palpate
