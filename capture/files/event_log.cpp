#include "capture/files/event_log.h"

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>

#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "capture/files/tables/csv_table.h"
#include "engine/base/readable.h"
#include "palpate/error.h"

namespace palpate::viz {
namespace {

constexpr const char* kName = "events.csv";
constexpr const char* kHeader = "frame,time_s,event,text";

std::string quoted(const std::string& text) {
  const bool padded = !text.empty() && (text.front() == ' ' || text.back() == ' ');
  if (!padded && text.find_first_of(",\"\n\r\t") == std::string::npos) return text;
  std::string cell = "\"";
  for (const char c : text) {
    if (c == '\n' || c == '\r') {
      cell += ' ';  // one row a line
    } else {
      cell += c == '"' ? "\"\"" : std::string(1, c);
    }
  }
  return cell + "\"";
}

/// False where the whole cell is no number of that kind.
template <typename Number>
bool read_number(const std::string& cell, Number& number) {
  const char* const end = cell.data() + cell.size();
  const auto read = std::from_chars(cell.data(), end, number);
  return read.ec == std::errc() && read.ptr == end;
}

}  // namespace

std::string label_of(const Event& event) {
  return event.kind == "mark" ? event.text : event.kind;
}

void append_event(const std::filesystem::path& folder, const Event& event) {
  make_output_folder(folder);
  const std::filesystem::path file = folder / kName;
  std::error_code code;
  const bool is_new = !std::filesystem::exists(file, code);
  std::ofstream out(file, std::ios::app | std::ios::binary);
  if (is_new) out << kHeader << '\n';
  out << event.frame << ',' << shortest(event.time_s) << ',' << quoted(event.kind) << ','
      << quoted(event.text) << '\n';
  out.close();
  if (!out)
    throw Error(Failure::Output, "to write '" + file.string() + "'", system_words(errno),
                "a writable folder with room");
}

std::vector<Event> read_events(const std::filesystem::path& folder) {
  std::vector<Event> events;
  std::error_code ignored;
  if (!std::filesystem::exists(folder / kName, ignored)) return events;
  // The header is one of the lines that are no event: a file whose writer was killed may lack it.
  CsvTable table(folder / kName, "a table of events",
                 {.separators = ",", .header = false, .width = CsvWidth::Any});
  while (table.next()) {
    const std::vector<std::string>& cells = table.cells();
    if (cells.size() < 4) continue;
    uint64_t frame = 0;
    double time_s = 0;
    if (!read_number(cells[0], frame) || !read_number(cells[1], time_s) || !std::isfinite(time_s)) continue;
    events.push_back({frame, time_s, cells[2], cells[3]});
  }
  return events;
}

}  // namespace palpate::viz
