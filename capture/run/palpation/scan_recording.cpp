#include "capture/run/palpation/scan_recording.h"

#include <algorithm>
#include <cmath>

#include "capture/files/tables/csv_table.h"
#include "capture/open_source.h"
#include "capture/synthetic/tissue.h"
#include "engine/base/text.h"
#include "engine/palpation/press_observation.h"
#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

double place_mm(const CsvTable& table, size_t column) {
  constexpr const char* kRemedy = "x_mm and y_mm of the window's middle from the block's";
  const double value = table.number(column, kRemedy);
  if (std::abs(value) > 1000)
    throw Error(Failure::Input,
                "a place within 1000 mm in column " + table.columns()[column] + ", " + table.where(),
                "'" + table.cell(column) + "'", kRemedy);
  return value;
}

std::string there(const fs::path& table, const std::string& path) {
  if (path.empty() || is_tissue(path) || path == "truth" || fs::exists(path)) return path;
  const fs::path beside = table.parent_path() / path;
  return fs::exists(beside) ? beside.string() : path;
}

double highest(const PressTimeline& t) {
  double most = 0;
  for (const double force_N : t.force_N) most = std::max(most, force_N);
  return most;
}

lump::ScanPress press_of(const PressTimeline& t, const RecordedPress& press,
                         const std::vector<double>& forces_N, const RecordedOptions& options) {
  std::vector<std::vector<size_t>> frames;
  for (const double force_N : forces_N) {
    frames.push_back(frames_near(t.force_N, force_N, forces_N.back()));
    if (frames.back().empty())
      throw Error(Failure::Input,
                  text("a frame within %.2g N of %.3g N", kLoadWidth * forces_N.back(), force_N) + " in '" +
                      press.recording + "'",
                  "none while it loads", "slower presses, or other --loads");
  }
  const PressureNodes nodes(t.input.sensor, t.background, options.pitch_mm);
  std::vector<LoadSums> loads(forces_N.size());
  const std::unique_ptr<Source> source = open_source(t.input.input, t.input.sensor);
  Frame frame;
  for (size_t i = 0; source->next(frame); ++i)
    for (size_t k = 0; k < frames.size(); ++k) {
      if (std::find(frames[k].begin(), frames[k].end(), i) == frames[k].end()) continue;
      loads[k].nodes.add(nodes.read(frame));
      loads[k].force_N += t.force_N[i] / static_cast<double>(frames[k].size());
    }
  lump::ScanPress out;
  out.name = fs::path(press.recording).filename().string();
  if (is_tissue(press.recording))
    out.name = text("window at %g, %g mm", press.place_mm[0], press.place_mm[1]);
  out.observation = press_observation(nodes, loads, {options.block_mm, options.young_Pa, press.place_mm});
  return out;
}

}  // namespace

std::vector<RecordedPress> read_places(const fs::path& table, const std::vector<std::string>& recordings,
                                       const std::string& gauge) {
  CsvTable rows(table, "a table of places, columns recording,x_mm,y_mm", {.width = CsvWidth::Shorter});
  const std::vector<size_t> columns = rows.require({"recording", "x_mm", "y_mm"});
  const std::optional<size_t> gauge_column = rows.find("gauge");
  std::vector<RecordedPress> all;
  while (rows.next()) {
    RecordedPress press;
    press.recording = there(table, rows.cell(columns[0]));
    press.place_mm = {place_mm(rows, columns[1]), place_mm(rows, columns[2])};
    if (gauge_column) press.gauge = there(table, rows.cell(*gauge_column));
    if (press.gauge.empty()) press.gauge = gauge;
    if (press.recording.empty())
      throw Error(Failure::Input, "a recording in " + rows.where(), "none", "its path");
    all.push_back(std::move(press));
  }
  if (all.empty())
    throw Error(Failure::Input, "places in " + table.string(), "none", "a line for each recording");
  if (recordings.empty()) return all;
  std::vector<RecordedPress> chosen;
  for (const std::string& recording : recordings) {
    const auto row = std::find_if(all.begin(), all.end(), [&](const RecordedPress& p) {
      return p.recording == recording || fs::path(p.recording).filename() == fs::path(recording).filename();
    });
    if (row == all.end())
      throw Error(Failure::Input, "the place of '" + recording + "'", "no line for it in " + table.string(),
                  "a line recording,x_mm,y_mm");
    chosen.push_back(*row);
    chosen.back().recording = recording;
  }
  return chosen;
}

std::vector<lump::ScanPress> read_presses(const std::vector<RecordedPress>& presses,
                                          const RecordedOptions& options, std::vector<std::string>& notes,
                                          const RunWatch& watch) {
  std::vector<PressTimeline> timelines;
  std::vector<double> most;
  {
    const RunWatch::Progress progress = watch.begin("reading presses", presses.size());
    for (const RecordedPress& press : presses) {
      timelines.push_back(measure_press(options.seed, press, options.sensor, notes, watch));
      most.push_back(highest(timelines.back()));
      if (watch.stopped()) return {};
      progress(timelines.size());
    }
  }
  // One press that ended early does not lower all others: stitching leaves it out and says so.
  std::vector<double> sorted = most;
  std::sort(sorted.begin(), sorted.end());
  const double usual_N = sorted[sorted.size() / 2];
  double common_N = usual_N;
  for (const double force_N : most)
    if (force_N > 0.9 * usual_N) common_N = std::min(common_N, force_N);
  const double top_N = options.force_N > 0 ? options.force_N : 0.995 * common_N;
  if (!(top_N > 0))
    throw Error(Failure::Input, "presses with a force", "none above 0 N",
                "the gauge table of these recordings");
  std::vector<lump::ScanPress> out;
  const RunWatch::Progress progress = watch.begin("averaging frames", presses.size());
  for (size_t p = 0; p < presses.size(); ++p) {
    const double own_N = std::min(top_N, 0.995 * most[p]);
    out.push_back(press_of(timelines[p], presses[p], even_loads(own_N, options.loads), options));
    progress(p + 1);
  }
  return out;
}

}  // namespace palpate
