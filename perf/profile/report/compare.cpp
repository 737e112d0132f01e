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

ComparedValue beside(double first, double value) {
  const double ratio = first > 0 ? value / first : 0;
  return {value, ratio, ratio, ratio};
}

ComparedValue beside(const Distribution& first, const Distribution& time) {
  ComparedValue value = beside(first.median_ms, time.median_ms);
  if (first.q75_ms > 0) value.ratio_low = time.q25_ms / first.q75_ms;
  if (first.q25_ms > 0) value.ratio_high = time.q75_ms / first.q25_ms;
  return value;
}

/// Keeps a figure that at least two machines have.
void add(ComparedFigure figure, MachineComparison& result) {
  const auto has = [](const ComparedValue& v) { return v.value.has_value(); };
  if (std::ranges::count_if(figure.values, has) > 1) result.figures.push_back(std::move(figure));
}

void compare_times(MachineComparison& result) {
  std::vector<std::vector<Timed>> times;
  for (const Profile& profile : result.profiles) times.push_back(times_of(profile));
  for (const Timed& first : times.front()) {
    if (first.time.median_ms <= 0) continue;
    ComparedFigure figure{first.key[0], first.key[1], first.key[2], "ms", {}};
    for (const std::vector<Timed>& machine : times) {
      const auto same = std::ranges::find(machine, first.key, &Timed::key);
      const bool there = same != machine.end() && same->time.median_ms > 0;
      figure.values.push_back(there ? beside(first.time, same->time) : ComparedValue{});
    }
    add(std::move(figure), result);
  }
}

/// Errors of the surface's solvers beside their times: on every machine the same, or one is wrong.
void compare_errors(MachineComparison& result) {
  for (const SolverFigure& first : result.profiles.front().solvers) {
    ComparedFigure figure{
        "error of " + first.solver, first.truth, size_text(first.width_px, first.height_px), "1", {}};
    for (const Profile& profile : result.profiles) {
      const auto same = std::ranges::find_if(profile.solvers, [&](const SolverFigure& s) {
        return s.solver == first.solver && s.truth == first.truth && s.width_px == first.width_px &&
               s.height_px == first.height_px;
      });
      figure.values.push_back(same == profile.solvers.end()
                                  ? ComparedValue{}
                                  : beside(first.relative_rms_error, same->relative_rms_error));
    }
    add(std::move(figure), result);
  }
}

/// A value that a profile leaves at 0 is not there.
ComparedValue rate_beside(double first, double value) {
  return value > 0 ? beside(first, value) : ComparedValue{};
}

void compare_rates(MachineComparison& result) {
  const Profile& a = result.profiles.front();
  ComparedFigure ceiling{"memory ceiling", "", "", "GB/s", {}};
  for (const Profile& profile : result.profiles)
    ceiling.values.push_back(rate_beside(a.ceiling.GB_per_s, profile.ceiling.GB_per_s));
  add(std::move(ceiling), result);
  for (const SizeFigure& first : a.sizes) {
    const std::string size = size_text(first.width_px, first.height_px);
    ComparedFigure rate{"throughput", first.reading, size, "frames/s", {}};
    ComparedFigure memory{"memory", first.reading, size, "MB", {}};
    for (const Profile& profile : result.profiles) {
      const auto same = std::ranges::find_if(profile.sizes, [&](const SizeFigure& s) {
        return s.reading == first.reading && s.width_px == first.width_px && s.height_px == first.height_px;
      });
      const bool there = same != profile.sizes.end();
      rate.values.push_back(there ? rate_beside(first.frames_per_s, same->frames_per_s) : ComparedValue{});
      memory.values.push_back(there ? rate_beside(1e-6 * static_cast<double>(first.memory_bytes),
                                                  1e-6 * static_cast<double>(same->memory_bytes))
                                    : ComparedValue{});
    }
    add(std::move(rate), result);
    add(std::move(memory), result);
  }
}

/// Growth of each stage with the pixels: exponents.
void compare_growth(MachineComparison& result) {
  for (const Growth& first : result.profiles.front().growth) {
    ComparedFigure figure{"growth of " + first.stage,
                          first.reading,
                          first.from_px > 0 ? "from " + std::to_string(first.from_px) + " px" : "all",
                          "1",
                          {}};
    for (const Profile& profile : result.profiles) {
      const auto same = std::ranges::find_if(profile.growth, [&](const Growth& g) {
        return g.stage == first.stage && g.reading == first.reading && g.from_px == first.from_px;
      });
      figure.values.push_back(same == profile.growth.end() ? ComparedValue{}
                                                           : beside(first.exponent, same->exponent));
    }
    add(std::move(figure), result);
  }
}

std::set<std::string> frames_of(const Profile& profile) {
  std::set<std::string> frames;
  for (const SizeFigure& s : profile.sizes)
    frames.insert(size_text(s.width_px, s.height_px) + " " + s.reading);
  return frames;
}

void note_differences(MachineComparison& result) {
  const Profile& a = result.profiles.front();
  const std::set<std::string> frames = frames_of(a);
  for (size_t i = 0; i < result.profiles.size(); ++i) {
    const Profile& b = result.profiles[i];
    const std::string name = letter_of(i);
    if (!b.complete) result.notes.push_back(name + " was ended before it was complete");
    if (i == 0) continue;
    const auto differ = [&](const char* what, const std::string& in_a, const std::string& in_b) {
      if (in_a != in_b)
        result.notes.push_back(std::string(what) + " differs: A " + in_a + ", " + name + " " + in_b);
    };
    differ("version of palpate", a.machine.palpate, b.machine.palpate);
    differ("driver", a.machine.driver, b.machine.driver);
    differ("compiler", a.machine.compiler, b.machine.compiler);
    differ("clock of the stages", a.ceiling.clock, b.ceiling.clock);
    const auto only = [&](const std::string& side, const std::set<std::string>& mine,
                          const std::set<std::string>& other) {
      std::string list;
      for (const std::string& frame : mine)
        if (!other.count(frame)) list += (list.empty() ? "" : ", ") + frame;
      if (!list.empty()) result.notes.push_back("only in " + side + ": " + list);
    };
    const std::set<std::string> others = frames_of(b);
    only("A, not in " + name, frames, others);
    only(name + ", not in A", others, frames);
  }
}

FrameRatio frame_ratio(const MachineComparison& comparison, size_t machine) {
  std::vector<double> logs;
  for (const ComparedFigure& f : comparison.figures)
    if (f.what == "frame" && f.values[machine].value) logs.push_back(std::log(f.values[machine].ratio));
  if (logs.empty()) return {};
  const auto n = static_cast<double>(logs.size());
  double mean = 0, variance = 0;
  for (const double l : logs) mean += l / n;
  for (const double l : logs) variance += (l - mean) * (l - mean) / std::max(n - 1, 1.0);
  return {std::exp(mean), std::exp(std::sqrt(variance / n))};
}

/// Devices by name; where two have one name also their CPUs, and then dates.
std::vector<std::string> names_of(const std::vector<Profile>& profiles) {
  std::vector<std::string> names;
  const auto several = [&](const auto& same) { return std::ranges::count_if(profiles, same) > 1; };
  for (const Profile& profile : profiles) {
    const Machine& m = profile.machine;
    std::string name = m.device;
    const auto named = [&](const Profile& p) { return p.machine.device == m.device; };
    const auto alike = [&](const Profile& p) { return named(p) && p.machine.cpu == m.cpu; };
    if (several(named)) name += ", " + m.cpu;
    if (several(alike)) name += ", " + m.date_utc;
    names.push_back(letter_of(names.size()) + ": " + name);
  }
  return names;
}

std::string optional_figure(const ComparedValue& value) {
  return value.value ? figure(*value.value) : "";
}

}  // namespace

std::string letter_of(size_t machine) {
  std::string letters;
  for (size_t n = machine + 1; n > 0; n = (n - 1) / 26)
    letters.insert(letters.begin(), static_cast<char>('A' + (n - 1) % 26));
  return letters;
}

MachineComparison compare_profiles(const std::vector<Profile>& profiles) {
  MachineComparison result{profiles, names_of(profiles), {}, {}, {}};
  note_differences(result);
  compare_times(result);
  compare_errors(result);
  compare_growth(result);
  compare_rates(result);
  for (size_t i = 0; i < profiles.size(); ++i) {
    result.frames.push_back(frame_ratio(result, i));
    if (i > 0 && !result.frames[i].ratio)
      result.notes.insert(result.notes.begin(),
                          "A and " + letter_of(i) + " have no size and reading in common");
  }
  return result;
}

std::vector<Table> tables_of(const MachineComparison& comparison) {
  Table machines{"Machines", "", {"", "device", "driver", "CPU", "system", "palpate", "date"}, {}};
  for (size_t i = 0; i < comparison.profiles.size(); ++i) {
    const Machine& m = comparison.profiles[i].machine;
    const std::string cpu = m.cpu.empty() ? "" : m.cpu + ", " + std::to_string(m.cpu_threads) + " threads";
    machines.rows.push_back({letter_of(i), m.device, m.driver, cpu, m.system, m.palpate, m.date_utc});
  }
  Table figures{
      "Side by side",
      "Ratios to machine A, with the range that the quartiles of both sides give them. Of times, "
      "errors and memory less than 1 is better, of rates more than 1. An empty cell was not measured.",
      {"what", "reading or truth", "size", "unit", "A"},
      {}};
  for (size_t i = 1; i < comparison.profiles.size(); ++i)
    for (const char* column : {"", " / A", " / A, from", " / A, to"})
      figures.columns.push_back(letter_of(i) + column);
  for (const ComparedFigure& f : comparison.figures) {
    std::vector<std::string> row{f.what, f.reading, f.size, f.unit, optional_figure(f.values.front())};
    for (size_t i = 1; i < f.values.size(); ++i) {
      const ComparedValue& v = f.values[i];
      row.push_back(optional_figure(v));
      for (const double ratio : {v.ratio, v.ratio_low, v.ratio_high})
        row.push_back(v.value ? figure(ratio) : "");
    }
    figures.rows.push_back(std::move(row));
  }
  return {machines, figures};
}

std::string to_csv(const MachineComparison& comparison) {
  std::ostringstream out;
  out.precision(6);
  out << "what,reading_or_truth,size_px,unit,machine,value,ratio_to_a,ratio_low,ratio_high\n";
  for (const ComparedFigure& f : comparison.figures)
    for (size_t i = 0; i < f.values.size(); ++i) {
      const ComparedValue& v = f.values[i];
      if (!v.value) continue;
      out << csv_cell(f.what) << ',' << csv_cell(f.reading) << ',' << f.size << ',' << f.unit << ','
          << csv_cell(comparison.names[i]) << ',' << *v.value << ',' << v.ratio << ',' << v.ratio_low << ','
          << v.ratio_high << '\n';
    }
  return out.str();
}

json::Value to_json(const MachineComparison& comparison) {
  json::Value machines = json::Value::array();
  for (size_t i = 0; i < comparison.profiles.size(); ++i) {
    json::Value one = {{"name", comparison.names[i]}, {"frame_ratio_spread", comparison.frames[i].spread}};
    one["frame_ratio"] = comparison.frames[i].ratio ? json::Value(*comparison.frames[i].ratio) : nullptr;
    machines.push_back(one);
  }
  json::Value figures = json::Value::array();
  for (const ComparedFigure& f : comparison.figures) {
    json::Value values = json::Value::array();
    for (const ComparedValue& v : f.values)
      values.push_back(v.value ? json::Value{{"value", *v.value},
                                             {"ratio", v.ratio},
                                             {"ratio_low", v.ratio_low},
                                             {"ratio_high", v.ratio_high}}
                               : json::Value(nullptr));
    json::Value figure = {
        {"what", f.what}, {"reading_or_truth", f.reading}, {"size_px", f.size}, {"unit", f.unit}};
    figure["values"] = values;
    figures.push_back(figure);
  }
  json::Value value = {{"notes", comparison.notes}, {"complete", true}};
  value["machines"] = machines;
  value["figures"] = figures;
  return value;
}

std::string frame_sentence(const MachineComparison& comparison, size_t machine) {
  const FrameRatio& f = comparison.frames[machine];
  return "a frame takes " + figure(*f.ratio) + " times as long on " + comparison.names[machine] +
         " as on A (geometric mean over sizes and readings, standard error a factor of " + figure(f.spread) +
         ")";
}

std::string describe(const MachineComparison& comparison) {
  std::string text;
  for (const Table& table : tables_of(comparison)) text += to_text(table) + "\n";
  for (const std::string& note : comparison.notes) text += "note: " + note + "\n";
  for (size_t i = 1; i < comparison.frames.size(); ++i)
    if (comparison.frames[i].ratio) text += frame_sentence(comparison, i) + "\n";
  return text;
}

}  // namespace palpate::perf
