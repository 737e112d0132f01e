#include "perf/profile/report/compare.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <sstream>

#include "engine/base/json.h"

namespace palpate::perf {
namespace {

/// Key that matches figures of two profiles.
using Key = std::array<std::string, 3>;  // what, reading or truth, size

struct Timed {
  Key key;
  Distribution time;
};

std::vector<Timed> times_of(const Profile& profile) {
  std::vector<Timed> times;
  for (const SizeFigure& s : profile.sizes) {
    const std::string size = size_text(s.width_px, s.height_px);
    times.push_back({{"frame", s.reading, size}, s.latency});
    for (const StageFigure& stage : s.stages)
      times.push_back({{"stage " + stage.stage, s.reading, size}, stage.time});
  }
  for (const SolverFigure& s : profile.solvers)
    times.push_back({{"solver " + s.solver, s.truth, size_text(s.width_px, s.height_px)}, s.time});
  for (const OutputFigure& o : profile.outputs)
    times.push_back({{"outputs: " + o.outputs, o.reading, size_text(o.width_px, o.height_px)}, o.time});
  return times;
}

ComparedFigure compared(const Key& key, const std::string& unit, double a, double b) {
  const double ratio = a > 0 ? b / a : 0;
  return {key[0], key[1], key[2], unit, a, b, ratio, ratio, ratio};
}

void compare_times(const Profile& a, const Profile& b, MachineComparison& result) {
  const std::vector<Timed> theirs = times_of(b);
  for (const Timed& ours : times_of(a)) {
    const auto other =
        std::find_if(theirs.begin(), theirs.end(), [&](const Timed& t) { return t.key == ours.key; });
    if (other == theirs.end() || ours.time.median_ms <= 0 || other->time.median_ms <= 0) continue;
    ComparedFigure figure = compared(ours.key, "ms", ours.time.median_ms, other->time.median_ms);
    if (ours.time.q75_ms > 0) figure.ratio_low = other->time.q25_ms / ours.time.q75_ms;
    if (ours.time.q25_ms > 0) figure.ratio_high = other->time.q75_ms / ours.time.q25_ms;
    result.figures.push_back(std::move(figure));
  }
}

void compare_rates(const Profile& a, const Profile& b, MachineComparison& result) {
  result.figures.push_back(
      compared({"memory ceiling", "", ""}, "GB/s", a.ceiling.GB_per_s, b.ceiling.GB_per_s));
  for (const SizeFigure& ours : a.sizes) {
    for (const SizeFigure& theirs : b.sizes) {
      if (ours.reading != theirs.reading || ours.width_px != theirs.width_px ||
          ours.height_px != theirs.height_px)
        continue;
      const std::string size = size_text(ours.width_px, ours.height_px);
      result.figures.push_back(
          compared({"throughput", ours.reading, size}, "frames/s", ours.frames_per_s, theirs.frames_per_s));
      result.figures.push_back(compared({"memory", ours.reading, size}, "MB",
                                        static_cast<double>(ours.memory_bytes) * 1e-6,
                                        static_cast<double>(theirs.memory_bytes) * 1e-6));
    }
  }
}

std::set<std::string> frames_of(const Profile& profile) {
  std::set<std::string> frames;
  for (const SizeFigure& s : profile.sizes)
    frames.insert(size_text(s.width_px, s.height_px) + " " + s.reading);
  return frames;
}

void note_differences(const Profile& a, const Profile& b, std::vector<std::string>& notes) {
  const auto differ = [&](const char* what, const std::string& in_a, const std::string& in_b) {
    if (in_a != in_b) notes.push_back(std::string(what) + " differs: A " + in_a + ", B " + in_b);
  };
  differ("version of palpate", a.machine.palpate, b.machine.palpate);
  differ("driver", a.machine.driver, b.machine.driver);
  differ("compiler", a.machine.compiler, b.machine.compiler);
  differ("clock of the stages", a.ceiling.clock, b.ceiling.clock);
  if (!a.complete) notes.emplace_back("A was ended before it was complete");
  if (!b.complete) notes.emplace_back("B was ended before it was complete");
  const auto only = [&](const char* side, const std::set<std::string>& mine,
                        const std::set<std::string>& other) {
    std::string list;
    for (const std::string& frame : mine)
      if (!other.count(frame)) list += (list.empty() ? "" : ", ") + frame;
    if (!list.empty()) notes.push_back(std::string("only in ") + side + ": " + list);
  };
  only("A", frames_of(a), frames_of(b));
  only("B", frames_of(b), frames_of(a));
}

void summarise_frames(MachineComparison& result) {
  std::vector<double> logs;
  for (const ComparedFigure& f : result.figures)
    if (f.what == "frame") logs.push_back(std::log(f.ratio));
  if (logs.empty()) return;
  const auto n = static_cast<double>(logs.size());
  double mean = 0, variance = 0;
  for (const double l : logs) mean += l / n;
  for (const double l : logs) variance += (l - mean) * (l - mean) / std::max(n - 1, 1.0);
  result.frame_ratio = std::exp(mean);
  result.frame_ratio_spread = std::exp(std::sqrt(variance / n));
}

}  // namespace

MachineComparison compare_profiles(const Profile& a, const Profile& b) {
  MachineComparison result{a, b, a.machine.device, b.machine.device, {}, {}, std::nullopt, 1};
  if (result.name_a == result.name_b) {
    result.name_a += ", " + a.machine.cpu;
    result.name_b += ", " + b.machine.cpu;
  }
  if (result.name_a == result.name_b) {
    result.name_a = "A: " + result.name_a + ", " + a.machine.date_utc;
    result.name_b = "B: " + result.name_b + ", " + b.machine.date_utc;
  }
  note_differences(a, b, result.notes);
  compare_times(a, b, result);
  compare_rates(a, b, result);
  summarise_frames(result);
  if (!result.frame_ratio)
    result.notes.insert(result.notes.begin(), "the two have no size and reading in common");
  return result;
}

std::vector<Table> tables_of(const MachineComparison& comparison) {
  const Machine &a = comparison.a.machine, &b = comparison.b.machine;
  Table machines{"Machines",
                 "",
                 {"", "A", "B"},
                 {{"device", a.device, b.device},
                  {"driver", a.driver, b.driver},
                  {"CPU", a.cpu + ", " + std::to_string(a.cpu_threads) + " threads",
                   b.cpu + ", " + std::to_string(b.cpu_threads) + " threads"},
                  {"system", a.system, b.system},
                  {"palpate", a.palpate, b.palpate},
                  {"date", a.date_utc, b.date_utc}}};
  Table figures{"Side by side",
                "B / A with the range that the quartiles of both sides give it. Of times and memory less "
                "than 1 says that B needs less; "
                "of rates more than 1 says that B does more.",
                {"what", "reading or truth", "size", "unit", "A", "B", "B / A", "from", "to"},
                {}};
  for (const ComparedFigure& f : comparison.figures)
    figures.rows.push_back({f.what, f.reading, f.size, f.unit, figure(f.a), figure(f.b), figure(f.ratio),
                            figure(f.ratio_low), figure(f.ratio_high)});
  return {machines, figures};
}

std::string to_csv(const MachineComparison& comparison) {
  std::ostringstream out;
  out.precision(6);
  out << "what,reading_or_truth,size_px,unit,a,b,ratio,ratio_low,ratio_high\n";
  for (const ComparedFigure& f : comparison.figures) {
    out << csv_cell(f.what) << ',' << csv_cell(f.reading) << ',' << f.size << ',' << f.unit << ',' << f.a
        << ',' << f.b << ',' << f.ratio << ',' << f.ratio_low << ',' << f.ratio_high << '\n';
  }
  return out.str();
}

std::string to_json(const MachineComparison& comparison) {
  json::Value figures = json::Value::array();
  for (const ComparedFigure& f : comparison.figures) {
    figures.push_back({{"what", f.what},
                       {"reading_or_truth", f.reading},
                       {"size_px", f.size},
                       {"unit", f.unit},
                       {"a", f.a},
                       {"b", f.b},
                       {"ratio", f.ratio},
                       {"ratio_low", f.ratio_low},
                       {"ratio_high", f.ratio_high}});
  }
  json::Value value = {{"a", comparison.name_a}, {"b", comparison.name_b}, {"notes", comparison.notes}};
  value["frame_ratio"] = comparison.frame_ratio ? json::Value(*comparison.frame_ratio) : nullptr;
  value["frame_ratio_spread"] = comparison.frame_ratio_spread;
  value["figures"] = figures;
  value["complete"] = true;
  return value.dump(1, json::Utf8::Replace);
}

std::string describe(const MachineComparison& comparison) {
  std::string text;
  for (const Table& table : tables_of(comparison)) text += to_text(table) + "\n";
  for (const std::string& note : comparison.notes) text += "note: " + note + "\n";
  if (comparison.frame_ratio) {
    text += "a frame takes " + figure(*comparison.frame_ratio) +
            " times as long on B as on A (geometric mean over sizes and readings, " +
            "standard error a factor of " + figure(comparison.frame_ratio_spread) + ")\n";
  }
  return text;
}

}  // namespace palpate::perf
