#include "capture/run/scan_recording.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "capture/files/csv_line.h"
#include "capture/open_source.h"
#include "capture/synthetic/tissue.h"
#include "engine/base/text.h"
#include "engine/palpation/press_observation.h"
#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

double number(const fs::path& table, size_t line, const std::string& column, const std::string& cell) {
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value) ||
      std::abs(value) > 1000)
    throw Error(
        Failure::Input,
        "a place in mm in line " + std::to_string(line) + ", column " + column + " of " + table.string(),
        "'" + cell + "'", "x_mm and y_mm of the window's middle from the block's");
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
  std::ifstream in(table);
  if (!in)
    throw Error(Failure::Input, "a table of places", "nothing readable at '" + table.string() + "'",
                "--positions FILE.csv");
  std::string line;
  std::vector<std::string> names;
  std::vector<RecordedPress> all;
  for (size_t number_of = 1; std::getline(in, line); ++number_of) {
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    const std::vector<std::string> cells = csv_cells(line);
    if (names.empty()) {
      names = cells;
      for (const char* wanted : {"recording", "x_mm", "y_mm"})
        if (std::find(names.begin(), names.end(), wanted) == names.end())
          throw Error(Failure::Input, "columns recording, x_mm, y_mm in the first line of " + table.string(),
                      "'" + line + "'", "recording,x_mm,y_mm,gauge");
      continue;
    }
    const auto cell = [&](const char* name) -> std::string {
      const auto at = static_cast<size_t>(std::find(names.begin(), names.end(), name) - names.begin());
      return at < cells.size() ? cells[at] : "";
    };
    RecordedPress press;
    press.recording = there(table, cell("recording"));
    press.place_mm = {number(table, number_of, "x_mm", cell("x_mm")),
                      number(table, number_of, "y_mm", cell("y_mm"))};
    press.gauge = there(table, cell("gauge"));
    if (press.gauge.empty()) press.gauge = gauge;
    if (press.recording.empty())
      throw Error(Failure::Input,
                  "a recording in line " + std::to_string(number_of) + " of " + table.string(), "none",
                  "its path");
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
    throw Error(Failure::Input, "presses with a force", "none above 0 N", "the gauge of these recordings");
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
