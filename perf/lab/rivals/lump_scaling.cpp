#include "perf/lab/rivals/lump_scaling.h"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <vector>

#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "perf/lab/dataset/file.h"
#include "perf/lab/dataset/journal.h"
#include "viz/report/gnuplot.h"
#include "viz/report/plot.h"

namespace palpate::perf {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kRepetitions = 3, kQuickCases = 40, kUsualCases = 6;
constexpr double kModelCases = 10000;
constexpr const char* kQuick = "--cells 24x24x12 --coarser-cells 0";

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct TimedRun {
  double wall_s = 0;   ///< of the whole command
  double press_s = 0;  ///< while cases were pressed
  double busy_s = 0;   ///< of all workers
};

/// One way to run the command, and what it took.
struct Way {
  const char* how;
  int workers;
  std::string start;  ///< before the program's name
  std::string more;
  std::vector<TimedRun> runs = {};

  double median(double TimedRun::*value) const {
    std::vector<double> values;
    for (const TimedRun& run : runs) values.push_back(run.*value);
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
  }
};

class Folder {
 public:
  Folder() : path(fs::temp_directory_path() / ("palpate-lumps-" + std::to_string(::getpid()))) {
    fs::create_directories(path);
  }
  ~Folder() {
    std::error_code error;
    fs::remove_all(path, error);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path path;
};

bool succeeds(const std::string& command) {
  const int status = std::system(command.c_str());  // NOLINT(cert-env33-c): mpirun is a program to start
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

TimedRun timed(const std::string& program, const Way& way, int cases, const fs::path& folder) {
  const std::string file = (folder / "set.h5").string(), said = (folder / "said.json").string();
  fs::remove(file);
  const auto start = Clock::now();
  if (!succeeds(way.start + " '" + program + "' dataset " + file + " --json --quiet --count " +
                std::to_string(cases) + " " + way.more + " > " + said + " 2> /dev/null"))
    throw Error(Failure::Input, "a data set of lumps",
                std::string("a run that failed: ") + way.start + " " + program, "the same by hand");
  TimedRun run;
  run.wall_s = since(start);
  std::ifstream in(said);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  const json::Value value = json::parse(bytes.str());
  run.press_s = value.at("wall_s").get<double>();
  run.busy_s = value.at("busy_s").get<double>();
  return run;
}

/// Serial time of the first process, for each case.
struct Serial {
  double keep_s = 0;   ///< received, unpacked, on the disk
  double write_s = 0;  ///< from the journal into the file
};

Serial serial_costs(const fs::path& folder) {
  const lump::Data data = lump::read_lump_file(folder / "set.h5");
  const auto n = static_cast<double>(data.samples.size());
  Serial serial;
  lump::Journal journal(folder / "again.part", data.sweep, data.program);
  auto start = Clock::now();
  for (const lump::Sample& sample : data.samples) journal.append(pack(data.sweep, sample));
  serial.keep_s = since(start) / n;
  start = Clock::now();
  write_lump_file(folder / "again.h5", data.sweep, data.program, data.first,
                  static_cast<uint32_t>(data.samples.size()),
                  [&](uint32_t number) { return journal.read(number); });
  serial.write_s = since(start) / n;
  journal.remove();
  return serial;
}

/// Wall time of many cases on workers with a core each. While they press, the first process keeps; at the end
/// some wait for the longest case, about twice the mean (blocks that are not solved as a quarter); then the
/// file is written.
double model_s(double case_s, const Serial& serial, double start_s, double workers) {
  const double pressing = kModelCases * std::max(case_s / workers, serial.keep_s);
  const double waiting = workers > 1 ? 2 * case_s : 0;
  return start_s + pressing + waiting + kModelCases * serial.write_s;
}

/// Columns of workers and cases a minute.
using Curve = std::vector<std::vector<double>>;

/// Runs all methods in turn, on 1 and 2 workers each. With `processes` also by processes.
std::vector<Way> run_ways(const std::string& program, bool processes, const fs::path& folder) {
  std::vector<Way> methods = {{"threads", 1, "", std::string(kQuick) + " --threads 1"},
                              {"threads", 2, "", std::string(kQuick) + " --threads 2"}};
  if (processes)
    for (const int n : {1, 2})
      methods.push_back(
          {"processes", n,
           "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun --oversubscribe -n " +
               std::to_string(n),
           kQuick});
  for (int i = 0; i < kRepetitions; ++i)
    for (Way& way : methods) way.runs.push_back(timed(program, way, kQuickCases, folder));
  return methods;
}

/// Words and rows of what was measured; its curves, of threads and of processes.
std::array<Curve, 2> tell_measured(const std::vector<Way>& methods, LumpScaling& result) {
  result.words +=
      text("%d cases of a quick sweep (%s), medians of %d runs:\n", kQuickCases, kQuick, kRepetitions);
  std::array<Curve, 2> measured;
  for (size_t w = 0; w < methods.size(); ++w) {
    const Way& way = methods[w];
    const double per_min = 60 * kQuickCases / way.median(&TimedRun::press_s);
    const double alone = 60 * kQuickCases / methods[w - w % 2].median(&TimedRun::press_s);
    const double start_s = way.median(&TimedRun::wall_s) - way.median(&TimedRun::press_s);
    result.csv += text("measured,quick,%s,%d,%d,%.4g,%.3f\n", way.how, way.workers, kQuickCases, per_min,
                       per_min / alone);
    result.words += text(
        "  %d %-10s %7.1f cases a minute, %.2f times one; start and end %.2f s; %.1f ms of a core a case\n",
        way.workers, way.how, per_min, per_min / alone, start_s,
        1e3 * way.median(&TimedRun::busy_s) / kQuickCases);
    Curve& columns = measured[w / 2];
    columns.resize(2);
    columns[0].push_back(way.workers);
    columns[1].push_back(per_min);
  }
  return measured;
}

/// Times of a sweep's cases, for the model of many workers.
struct SweepCosts {
  const char* name;
  double case_s;  ///< of a core
  Serial serial;
};

/// Words and rows of the model up to 4096 workers; its curve.
Curve tell_model(const SweepCosts& m, double start_s, LumpScaling& result) {
  Curve columns(2);
  const double one_s = model_s(m.case_s, m.serial, start_s, 1);
  for (double workers = 1; workers <= 4096; workers *= 2) {
    const double wall_s = model_s(m.case_s, m.serial, start_s, workers);
    columns[0].push_back(workers);
    columns[1].push_back(60 * kModelCases / wall_s);
    result.csv += text("model,%s,processes,%.0f,%.0f,%.4g,%.3f\n", m.name, workers, kModelCases,
                       columns[1].back(), one_s / wall_s);
  }
  const double fraction =
      (m.serial.keep_s + m.serial.write_s) / (m.case_s + m.serial.keep_s + m.serial.write_s);
  result.words += text(
      "%s sweep: %.3g s of a core a case; the first process alone: %.2f ms to keep it, %.2f ms to write "
      "it, a share of %.2g: "
      "the disk is the limit from %.0f workers on (model)\n",
      m.name, m.case_s, 1e3 * m.serial.keep_s, 1e3 * m.serial.write_s, fraction, m.case_s / m.serial.keep_s);
  return columns;
}

/// `curves`: of the models. `measured`: of threads and, unless empty, of processes.
Plot plot_of(const std::array<Curve, 2>& curves, const std::array<Curve, 2>& measured,
             const std::array<SweepCosts, 2>& models) {
  PlotPanel panel{"Data sets of lumps: measured on 1 and 2 cores, beyond that a model of 10000 cases",
                  "workers (a core each)", "cases a minute"};
  panel.log_x = panel.log_y = true;
  panel.x_range = {{0.8, 5000}};
  panel.key = "top left";
  for (size_t i = 0; i < models.size(); ++i) {
    const double per_min = 60 / models[i].case_s;
    panel.add(std::string("model, ") + models[i].name + " sweep", curves[i][0], curves[i][1], i);
    panel
        .add_line(std::string(models[i].name) + " without a serial part", {1, per_min},
                  {4096, 4096 * per_min})
        .colour = i;
  }
  constexpr const char* kWays[] = {"measured, quick sweep, threads", "measured, quick sweep, processes"};
  for (size_t i = 0; i < measured.size(); ++i) {
    if (measured[i].empty()) continue;
    PlotCurve& curve =
        panel.add(kWays[i], measured[i][0], measured[i][1], i ? 2 : 4, PlotCurve::Style::Points);
    curve.mark = i ? 4 : 7;
    curve.size = i ? 1.8 : 1.3;
  }
  return {.panels = {panel}, .width_px = 900, .height_px = 620};
}

}  // namespace

LumpScaling lump_scaling(const fs::path& program) {
  const Folder folder;
  const bool together = succeeds("mpirun --version > /dev/null 2>&1");
  const std::vector<Way> methods = run_ways(program.string(), together, folder.path);
  LumpScaling result;
  result.csv = "kind,sweep,how,workers,cases,cases_per_min,speed_up\n";
  const std::array<Curve, 2> measured = tell_measured(methods, result);

  const Serial serial = serial_costs(folder.path);
  const Way& widest = methods.back();
  const double start_s = std::max(0.0, widest.median(&TimedRun::wall_s) - widest.median(&TimedRun::press_s) -
                                           kQuickCases * serial.write_s);
  const double quick_s = widest.median(&TimedRun::busy_s) / kQuickCases;
  const Way usual{"threads", 2, "", "--threads 2"};
  const double usual_s = timed(program.string(), usual, kUsualCases, folder.path).busy_s / kUsualCases;
  const std::array<SweepCosts, 2> models = {
      {{"quick", quick_s, serial}, {"default", usual_s, serial_costs(folder.path)}}};
  const Plot plot = plot_of({tell_model(models[0], start_s, result), tell_model(models[1], start_s, result)},
                            measured, models);
  if (!together) result.words += "no mpirun here: processes are not measured\n";
  result.png = run_gnuplot(plot_script(plot, PlotKind::Png)).bytes;
  result.svg = run_gnuplot(plot_script(plot, PlotKind::Svg)).bytes;
  return result;
}

}  // namespace palpate::perf
