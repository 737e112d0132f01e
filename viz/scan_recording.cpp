#include "viz/scan_recording.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <sstream>

#include "capture/gauge.h"
#include "capture/synthetic_tissue.h"
#include "engine/error.h"
#include "engine/solve/time_alignment.h"
#include "engine/stages/elastic.h"
#include "viz/input.h"
#include "viz/pressure_map.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kNear = 0.04;      // of the highest force: frames that belong to a load
constexpr size_t kMostFrames = 12;  // averaged for one load
constexpr double kMostLimited = 0.02, kWholeCell = 0.9;

std::string text(const char* format, double a, double b = 0) {
  char line[120];
  std::snprintf(line, sizeof line, format, a, b);
  return line;
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) {
    const size_t first = cell.find_first_not_of(" \t\r\""), last = cell.find_last_not_of(" \t\r\"");
    cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
  }
  return cells;
}

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

/// A press, measured: the window's mean light and the gauge over time, and where the frames of it are.
struct Timeline {
  MeasuredInput input;
  std::vector<double> time_s, light, force_N;
  std::vector<uint64_t> sequence;
  Frame background;
};

const Sensor& check_sensor(const Sensor& sensor, const std::string& recording) {
  if (!viz::reads_pressure(sensor) || !(sensor.pitch_mm_per_px > 0))
    throw Error(
        Failure::Sensor,
        "a sensor that reads pressure (surface.reading elastic) with a scale, for '" + recording + "'",
        "'" + sensor.name + "'", "--sensor FILE of a calibrated sensor");
  return sensor;
}

void take_gauge(const RecordedPress& press, Timeline& t, std::vector<std::string>& notes) {
  if (press.gauge == "truth") {
    const std::string made_of = t.input.session ? t.input.session->input : t.input.input;
    if (!is_tissue(made_of))
      throw Error(Failure::Input, "a gauge's table for '" + press.recording + "'",
                  "'truth', which only recordings of the synthetic block know", "--gauge FILE.csv");
    const TissueOptions options = parse_tissue(made_of);
    const TissueSensor source(options);
    for (const uint64_t sequence : t.sequence) t.force_N.push_back(source.block_force_N(sequence));
    return;
  }
  const Gauge gauge = read_gauge(press.gauge, GaugeColumns::Normal);
  double offset_s = 0;
  if (!gauge.by_frame()) {
    std::vector<std::pair<double, double>> breaks;
    for (const GaugeGap& gap : gauge.gaps) breaks.emplace_back(gap.from_s, gap.to_s);
    const TimeAlignment a = align_in_time(t.time_s, t.light, gauge.time_s, gauge.force_N, breaks);
    offset_s = a.offset_s;
    notes.push_back(press.recording + ": gauge's clock " + text("%+.4f s +- %.2g s", a.offset_s, a.sd_s));
  }
  for (size_t i = 0; i < t.time_s.size(); ++i)
    t.force_N.push_back((gauge.by_frame() ? gauge_at_frame(gauge, gauge.force_N, t.sequence[i])
                                          : gauge_at(gauge, gauge.force_N, t.time_s[i] - offset_s))
                            .value_or(kNaN));
}

double mean_light(const Frame& frame, const Frame& background) {
  double sum = 0;
  const FrameFormat& f = frame.format;
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x)
      sum += static_cast<double>(frame.at(0, x, y)) - static_cast<double>(background.at(0, x, y));
  return sum / (static_cast<double>(f.width) * f.height);
}

Timeline measure(const Common& common, const RecordedPress& press, const RecordedOptions& options,
                 std::vector<std::string>& notes) {
  if (press.gauge.empty())
    throw Error(Failure::Usage, "a gauge's table for '" + press.recording + "'", "none",
                "--gauge FILE, or a column gauge in the table of places");
  Timeline t;
  t.input = find_input(common, press.recording, options.sensor, {});
  check_sensor(t.input.sensor, press.recording);
  const std::unique_ptr<Source> source = open_source(t.input.input, t.input.sensor);
  source->watch(interrupted);
  t.background = load_background(t.input.input, t.input.sensor, *source);
  Frame frame;
  while (!interrupted() && source->next(frame)) {
    t.time_s.push_back(static_cast<double>(frame.time_ns) * 1e-9);
    t.sequence.push_back(frame.sequence);
    t.light.push_back(mean_light(frame, t.background));
  }
  if (t.time_s.empty())
    throw Error(Failure::Input, "frames in '" + press.recording + "'", "none", "another recording");
  if (const std::string warning = source->warning(); !warning.empty())
    notes.push_back(press.recording + ": " + warning);
  take_gauge(press, t, notes);
  return t;
}

double highest(const Timeline& t, size_t* where = nullptr) {
  double most = 0;
  for (size_t i = 0; i < t.force_N.size(); ++i)
    if (t.force_N[i] > most) {
      most = t.force_N[i];
      if (where) *where = i;
    }
  return most;
}

/// Frames while the press loads, the nearest to a force first.
std::vector<size_t> frames_near(const Timeline& t, double force_N, double highest_N) {
  size_t last = 0;
  highest(t, &last);
  // The hold at the highest force belongs to it.
  while (last + 1 < t.force_N.size() && t.force_N[last + 1] > (1 - kNear) * highest_N) ++last;
  std::vector<size_t> near;
  for (size_t i = 0; i <= last; ++i)
    if (std::abs(t.force_N[i] - force_N) <= kNear * highest_N) near.push_back(i);
  std::stable_sort(near.begin(), near.end(), [&](size_t a, size_t b) {
    return std::abs(t.force_N[a] - force_N) < std::abs(t.force_N[b] - force_N);
  });
  if (near.size() > kMostFrames) near.resize(kMostFrames);
  return near;
}

/// Sums of some frames.
struct Stack {
  std::vector<double> gray;
  std::vector<uint16_t> limited;
  double force_N = 0;
  size_t count = 0;
};

/// Means of pressure around nodes of the window.
ForwardMap to_nodes(const Stack& stack, const Timeline& t, double pitch_mm, double& noise_Pa,
                    double& limited_share) {
  const Sensor& sensor = t.input.sensor;
  const FrameFormat& f = t.background.format;
  const double pixel_mm = sensor.pitch_mm_per_px;
  const auto count = [&](uint32_t px) {
    return 2 * static_cast<uint32_t>(std::floor(px * pixel_mm / (2 * pitch_mm))) + 1;
  };
  ForwardMap map{count(f.width), count(f.height), {pitch_mm, pitch_mm}, {}};
  struct Node {
    double sum = 0, limited = 0, pixels = 0;
  };
  std::vector<Node> nodes(size_t{map.width} * map.height);
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x) {
      const long i = std::lround((x - (f.width - 1) / 2.0) * pixel_mm / pitch_mm + (map.width - 1) / 2.0),
                 j = std::lround((y - (f.height - 1) / 2.0) * pixel_mm / pitch_mm + (map.height - 1) / 2.0);
      if (i < 0 || j < 0 || i >= long{map.width} || j >= long{map.height}) continue;
      Node& node = nodes[static_cast<size_t>(j) * map.width + static_cast<size_t>(i)];
      const size_t pixel = size_t{y} * f.width + x;
      const double frames = static_cast<double>(stack.count);
      double gray = stack.gray[pixel] / frames - static_cast<double>(t.background.at(0, x, y));
      if (sensor.signal == Signal::Darker) gray = -gray;
      const ElasticCalibration& pad = sensor.elastic;
      const double pressure_MPa =
          pad.limit_gray > 0
              ? -pad.limit_gray / pad.gray_per_MPa *
                    std::log(1 - std::min(gray, Elastic::largest_readable_gray(pad)) / pad.limit_gray)
              : gray / pad.gray_per_MPa;
      node.sum += 1e6 * pressure_MPa;
      node.limited += static_cast<double>(stack.limited[pixel]) / frames;
      node.pixels += 1;
    }
  const double whole = pitch_mm * pitch_mm / (pixel_mm * pixel_mm);
  double peak_Pa = 0;
  size_t limited = 0, seen = 0;
  for (const Node& node : nodes) {
    const bool covered = node.pixels >= kWholeCell * whole;
    const bool good = covered && node.limited <= kMostLimited * node.pixels;
    limited += covered && !good;
    seen += covered;
    const double value = good ? node.sum / node.pixels : kNaN;
    if (good) peak_Pa = std::max(peak_Pa, value);
    map.values.push_back(static_cast<float>(value));
  }
  limited_share = seen > 0 ? static_cast<double>(limited) / static_cast<double>(seen) : 1;
  // What the calibration leaves, and rounding to gray levels that averaging does not take away.
  noise_Pa = std::hypot((sensor.elastic.relative_sd > 0 ? sensor.elastic.relative_sd : 0.01) * peak_Pa,
                        0.3e6 / sensor.elastic.gray_per_MPa);
  return map;
}

ScanPress press_of(const Timeline& t, const RecordedPress& press, const std::vector<double>& forces_N,
                   const RecordedOptions& options) {
  std::vector<std::vector<size_t>> frames;
  for (const double force_N : forces_N) {
    frames.push_back(frames_near(t, force_N, forces_N.back()));
    if (frames.back().empty())
      throw Error(Failure::Input,
                  text("a frame within %.2g N of %.3g N", kNear * forces_N.back(), force_N) + " in '" +
                      press.recording + "'",
                  "none while it loads", "slower presses, or other --loads");
  }
  std::vector<Stack> stacks(forces_N.size());
  const std::unique_ptr<Source> source = open_source(t.input.input, t.input.sensor);
  Frame frame;
  for (size_t i = 0; source->next(frame); ++i)
    for (size_t k = 0; k < frames.size(); ++k) {
      if (std::find(frames[k].begin(), frames[k].end(), i) == frames[k].end()) continue;
      Stack& stack = stacks[k];
      const FrameFormat& f = frame.format;
      stack.gray.resize(size_t{f.width} * f.height);
      stack.limited.resize(stack.gray.size());
      for (uint32_t y = 0; y < f.height; ++y)
        for (uint32_t x = 0; x < f.width; ++x) {
          const uint32_t gray = frame.at(0, x, y);
          stack.gray[size_t{y} * f.width + x] += gray;
          if (gray >= t.input.sensor.saturation_gray) ++stack.limited[size_t{y} * f.width + x];
        }
      stack.force_N += t.force_N[i];
      ++stack.count;
    }
  ScanPress out;
  out.name = fs::path(press.recording).filename().string();
  if (is_tissue(press.recording))
    out.name = text("window at %g, %g mm", press.place_mm[0], press.place_mm[1]);
  LumpReading& r = out.reading;
  r.block_mm = options.block_mm;
  r.young_Pa = options.young_Pa;
  r.window_mm = press.place_mm;
  for (const Stack& stack : stacks) {
    r.pressure_Pa.push_back(to_nodes(stack, t, options.pitch_mm, r.noise_Pa, r.saturated_share));
    r.force_N.push_back(stack.force_N / static_cast<double>(stack.count));
  }
  // The plate goes on beside the block.
  for (ForwardMap& map : r.pressure_Pa)
    for (uint32_t j = 0; j < map.height; ++j)
      for (uint32_t i = 0; i < map.width; ++i) {
        const double x = press.place_mm[0] + (i - (map.width - 1) / 2.0) * options.pitch_mm,
                     y = press.place_mm[1] + (j - (map.height - 1) / 2.0) * options.pitch_mm;
        if (std::abs(x) + options.pitch_mm / 2 > options.block_mm[0] / 2 ||
            std::abs(y) + options.pitch_mm / 2 > options.block_mm[1] / 2)
          map.values[size_t{j} * map.width + i] = static_cast<float>(kNaN);
      }
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
    const std::vector<std::string> cells = cells_of(line);
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

std::vector<ScanPress> read_presses(const Common& common, const std::vector<RecordedPress>& presses,
                                    const RecordedOptions& options, std::vector<std::string>& notes) {
  std::vector<Timeline> timelines;
  std::vector<double> most;
  {
    ProgressBar bar(common, "reading presses", presses.size());
    for (const RecordedPress& press : presses) {
      timelines.push_back(measure(common, press, options, notes));
      most.push_back(highest(timelines.back()));
      if (interrupted()) return {};
      bar.update(timelines.size());
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
  std::vector<ScanPress> out;
  ProgressBar bar(common, "averaging frames", presses.size());
  for (size_t p = 0; p < presses.size(); ++p) {
    const double own_N = std::min(top_N, 0.995 * most[p]);
    std::vector<double> forces_N;
    for (uint32_t k = 1; k <= options.loads; ++k) forces_N.push_back(own_N * k / options.loads);
    out.push_back(press_of(timelines[p], presses[p], forces_N, options));
    bar.update(p + 1);
  }
  return out;
}

}  // namespace palpate
