#include "perf/profile/report/tables.h"
#include "engine/base/text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

namespace palpate::perf {
namespace {

std::string count_text(uint64_t n) {
  return std::to_string(n);
}

std::string percent(double fraction) {
  return figure(100 * fraction);
}

/// Characters, not bytes, of UTF-8.
size_t width_of(const std::string& text) {
  return static_cast<size_t>(std::count_if(text.begin(), text.end(),
                                           [](char c) { return (static_cast<uint8_t>(c) & 0xC0) != 0x80; }));
}

Table frames_table(const Profile& profile) {
  Table table{
      "Whole frame",
      "Pipeline::process from pixels to Touch and height map, a tenth of the frame touched, one frame at a "
      "time, host clock; frames/s "
      "with three in flight; CPU: the process, all threads.",
      {"reading", "size", "frames", "min ms", "median ms", "p95 ms", "p99 ms", "max ms", "CPU ms", "frames/s",
       "memory", "set up ms"},
      {}};
  for (const SizeFigure& s : profile.sizes) {
    const Distribution& d = s.latency;
    table.rows.push_back({s.reading, size_text(s.width_px, s.height_px), count_text(d.samples),
                          figure(d.min_ms), figure(d.median_ms), figure(d.p95_ms), figure(d.p99_ms),
                          figure(d.max_ms), figure(s.cpu_ms), figure(s.frames_per_s),
                          bytes_text(s.memory_bytes), figure(s.setup_ms)});
  }
  return table;
}

Table stages_table(const Profile& profile) {
  Table table{"Stages",
              "Median of each stage by the " + profile.ceiling.clock +
                  " clock, bytes that its kernels and copies are given (each buffer once a dispatch), and "
                  "the rate against the "
                  "measured ceiling of " +
                  figure(profile.ceiling.GB_per_s) + " GB/s. More than 100 %: a cache held the data.",
              {"reading", "size", "stage", "median ms", "q25 ms", "q75 ms", "dispatches", "read", "written",
               "GB/s", "% of ceiling"},
              {}};
  for (const SizeFigure& size : profile.sizes) {
    for (const StageFigure& s : size.stages) {
      table.rows.push_back({size.reading, size_text(size.width_px, size.height_px), s.stage,
                            figure(s.time.median_ms), figure(s.time.q25_ms), figure(s.time.q75_ms),
                            count_text(s.dispatches), bytes_text(s.read_bytes), bytes_text(s.written_bytes),
                            figure(s.GB_per_s), percent(s.ceiling_fraction)});
    }
  }
  return table;
}

Table growth_table(const Profile& profile) {
  Table table{"Growth",
              "time = constant x pixels^exponent, least squares on logarithms; 1 is proportional to the "
              "pixels. Small frames are "
              "ruled by fixed costs, so large ones are fitted apart.",
              {"reading", "stage", "frames", "sizes", "exponent", "standard error"},
              {}};
  for (const Growth& g : profile.growth) {
    const std::string exponent = palpate::text("%.3f", g.exponent);
    const std::string error = palpate::text("%.3f", g.exponent_standard_error);
    table.rows.push_back({g.reading, g.stage, g.from_px ? ">= " + count_text(g.from_px) + " px" : "all",
                          count_text(g.sizes), exponent, g.sizes > 2 ? error : "-"});
  }
  return table;
}

Table solvers_table(const Profile& profile) {
  Table table{"Surface: error against run time",
              "Relative RMS error of the heights (about their means) and relative error of their "
              "peak-to-valley, against surfaces "
              "known exactly; time from gradients in place to heights in place. * marks the front: nothing "
              "else is both faster and "
              "better.",
              {"size", "truth", "solver", "where", "RMS error", "peak-to-valley error", "median ms", "q25 ms",
               "q75 ms", "CPU ms", "front"},
              {}};
  for (const SolverFigure& s : profile.solvers) {
    table.rows.push_back({size_text(s.width_px, s.height_px), s.truth, s.solver, s.where,
                          figure(s.relative_rms_error), figure(s.peak_to_valley_error),
                          figure(s.time.median_ms), figure(s.time.q25_ms), figure(s.time.q75_ms),
                          figure(s.cpu_ms), s.on_front ? "*" : ""});
  }
  return table;
}

Table outputs_table(const Profile& profile) {
  Table table{"What leaving out saves",
              "Pipeline::process with some outputs left out, in turn with the full frame of the same "
              "reading; ratio of CPU times "
              "with its quartiles.",
              {"reading", "size", "outputs", "median ms", "CPU ms", "CPU ratio", "q25", "q75", "memory"},
              {}};
  for (const OutputFigure& o : profile.outputs) {
    table.rows.push_back({o.reading, size_text(o.width_px, o.height_px), o.outputs, figure(o.time.median_ms),
                          figure(o.cpu_ms), figure(o.cpu_ratio), figure(o.cpu_ratio_q25),
                          figure(o.cpu_ratio_q75), bytes_text(o.memory_bytes)});
  }
  return table;
}

Table ceiling_table(const Profile& profile) {
  Table table{"Memory ceiling",
              "Bytes read plus bytes written a second by work that does nothing else; the largest buffer is "
              "what stages are held "
              "against.",
              {"buffer", "copy GB/s", "kernel GB/s"},
              {}};
  for (const CeilingPoint& p : profile.ceiling.points)
    table.rows.push_back({bytes_text(p.buffer_bytes), figure(p.copy_GB_per_s), figure(p.stream_GB_per_s)});
  return table;
}

Table live_table(const Profile& profile) {
  Table table{
      "Live: age of measurement and picture",
      "A simulated camera sets the pace; capture, engine and drawing run in threads of their own and the "
      "newest frame wins. From a frame's delivery to its measurement, and to its picture, drawn "
      "off-screen and read back. Half, 95 % and 99 % of the frames lie below.",
      {"reading", "size", "camera/s", "frames", "not measured", "not drawn", "measured 50 % ms", "95 % ms",
       "99 % ms", "drawn 50 % ms", "95 % ms", "99 % ms"},
      {}};
  for (const LiveFigure& l : profile.live)
    table.rows.push_back(
        {l.reading, size_text(l.width_px, l.height_px), figure(l.rate_Hz), std::to_string(l.frames),
         std::to_string(l.dropped_before_engine), std::to_string(l.dropped_before_display),
         figure(l.to_measured.median_ms), figure(l.to_measured.p95_ms), figure(l.to_measured.p99_ms),
         figure(l.to_picture.median_ms), figure(l.to_picture.p95_ms), figure(l.to_picture.p99_ms)});
  return table;
}

Table photon_table(const Profile& profile) {
  Table table{"From photon to picture: ages and rates",
              "The same with a session recorded meanwhile; frames/s: every frame measured as fast as it "
              "goes, without "
              "drawing and recording. Waiting: the mean age of a picture less the work on it.",
              {"scene", "size", "camera/s", "frames", "not measured", "not drawn", "measured 50 % ms",
               "99 % ms", "drawn 50 % ms", "99 % ms", "waiting ms", "frames/s"},
              {}};
  for (const PhotonFigure& p : profile.photon)
    table.rows.push_back({p.scene, size_text(p.width_px, p.height_px), figure(p.rate_Hz),
                          std::to_string(p.frames), std::to_string(p.dropped_before_engine),
                          std::to_string(p.dropped_before_display), figure(p.to_measured.median_ms),
                          figure(p.to_measured.p99_ms), figure(p.to_picture.median_ms),
                          figure(p.to_picture.p99_ms), figure(p.waits_ms), figure(p.frames_per_s)});
  return table;
}

Table rates_table(const Profile& profile) {
  Table table{
      "Fast cameras: every frame to numbers",
      "Frames from memory at the camera's pace, nothing drawn or recorded; then every frame as fast as "
      "it goes. Half, 95 % and 99 % of the frames are measured within.",
      {"scene", "size", "camera/s", "frames", "not measured", "measured 50 % ms", "95 % ms", "99 % ms",
       "frames/s"},
      {}};
  for (const RateFigure& r : profile.rates)
    table.rows.push_back({r.scene, size_text(r.width_px, r.height_px), figure(r.rate_Hz),
                          std::to_string(r.frames), std::to_string(r.dropped_before_engine),
                          figure(r.to_measured.median_ms), figure(r.to_measured.p95_ms),
                          figure(r.to_measured.p99_ms), figure(r.frames_per_s)});
  return table;
}

Table threads_table(const Profile& profile) {
  Table table{
      "From photon to picture: the work of each thread",
      "Spans of a trace, each without those within it. Device: the engine waits for it; a driver that "
      "computes "
      "on the processor does so in threads of its own. ms a frame: mean over the frames that came to the "
      "thread; busy: share of the run.",
      {"scene", "thread", "step", "part", "times", "median ms", "q25 ms", "q75 ms", "p95 ms", "ms a frame",
       "busy %"},
      {}};
  for (const PhotonFigure& p : profile.photon)
    for (const ThreadPart& t : p.parts)
      table.rows.push_back({p.scene, t.thread, t.step, t.part, count_text(t.time.samples),
                            figure(t.time.median_ms), figure(t.time.q25_ms), figure(t.time.q75_ms),
                            figure(t.time.p95_ms), figure(t.ms_per_turn), percent(t.busy)});
  return table;
}

Table skipped_table(const Profile& profile) {
  Table table{"Not measured", "", {"what", "why"}, {}};
  for (const Skipped& s : profile.skipped) table.rows.push_back({s.what, s.why});
  return table;
}

/// One line, ended when the row goes.
class CsvRow {
 public:
  explicit CsvRow(std::ostringstream& out) : out_(out) {}
  ~CsvRow() { out_ << '\n'; }
  CsvRow(const CsvRow&) = delete;
  CsvRow& operator=(const CsvRow&) = delete;
  CsvRow& operator<<(const std::string& text) {
    out_ << comma_ << csv_cell(text);
    comma_ = ",";
    return *this;
  }
  CsvRow& operator<<(double value) {
    const std::string line = palpate::text("%.6g", value);
    return *this << std::string(line);
  }
  CsvRow& operator<<(uint64_t value) { return *this << std::to_string(value); }
  CsvRow& operator<<(uint32_t value) { return *this << std::to_string(value); }
  CsvRow& operator<<(const Distribution& d) {
    return *this << d.samples << d.min_ms << d.q25_ms << d.median_ms << d.q75_ms << d.p95_ms << d.p99_ms
                 << d.max_ms;
  }

 private:
  std::ostringstream& out_;
  const char* comma_ = "";
};

constexpr const char* kTimes = "samples,min_ms,q25_ms,median_ms,q75_ms,p95_ms,p99_ms,max_ms";

}  // namespace

std::string figure(double value) {
  std::string line;
  const double size = std::abs(value);
  if (value == 0) return "0";
  if (size >= 1e-3 && size < 1e5) {
    const int decimals = std::clamp(2 - static_cast<int>(std::floor(std::log10(size))), 0, 5);
    line = palpate::text("%.*f", decimals, value);
  } else {
    line = palpate::text("%.1e", value);
  }
  return line;
}

std::string bytes_text(uint64_t bytes) {
  constexpr const char* kUnits[] = {"B", "kB", "MB", "GB", "TB"};
  auto value = static_cast<double>(bytes);
  size_t unit = 0;
  for (; value >= 999.5 && unit + 1 < std::size(kUnits); ++unit) value /= 1000;
  return (unit == 0 ? std::to_string(bytes) : figure(value)) + " " + kUnits[unit];
}

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::vector<Table> tables_of(const Profile& profile) {
  std::vector<Table> tables{frames_table(profile),  stages_table(profile),  growth_table(profile),
                            solvers_table(profile), outputs_table(profile), live_table(profile),
                            rates_table(profile),   photon_table(profile),  threads_table(profile),
                            ceiling_table(profile), skipped_table(profile)};
  std::erase_if(tables, [](const Table& t) { return t.rows.empty(); });
  return tables;
}

std::string to_text(const Table& table) {
  std::vector<size_t> widths;
  for (const std::string& column : table.columns) widths.push_back(width_of(column));
  for (const auto& row : table.rows)
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i]));
  std::string text = table.title + "\n";
  const auto add = [&](const std::vector<std::string>& cells) {
    std::string line;
    for (size_t i = 0; i < cells.size(); ++i) {
      const std::string gap(widths[i] - width_of(cells[i]), ' ');
      const bool number = !table.rows.empty() && !table.rows.front()[i].empty() &&
                          table.rows.front()[i].find_first_of("0123456789") == 0;
      line += "  " + (number ? gap + cells[i] : cells[i] + gap);
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  };
  add(table.columns);
  for (const auto& row : table.rows) add(row);
  return text;
}

std::vector<std::pair<std::string, std::string>> csv_files(const Profile& profile) {
  std::ostringstream frames, histograms, stages, growth, solvers, outputs, live, rates, threads, ceiling;
  frames << "reading,width_px,height_px," << kTimes << ",cpu_ms,frames_per_s,memory_bytes,setup_ms\n";
  histograms << "reading,width_px,height_px,from_ms,to_ms,frames\n";
  stages << "reading,width_px,height_px,stage," << kTimes
         << ",clock,dispatches,read_bytes,written_bytes,rate_GB_per_s,ceiling_fraction\n";
  for (const SizeFigure& s : profile.sizes) {
    CsvRow(frames) << s.reading << s.width_px << s.height_px << s.latency << s.cpu_ms << s.frames_per_s
                   << s.memory_bytes << s.setup_ms;
    for (size_t i = 0; i < s.histogram.counts.size(); ++i) {
      CsvRow(histograms) << s.reading << s.width_px << s.height_px << s.histogram.edges_ms[i]
                         << s.histogram.edges_ms[i + 1] << s.histogram.counts[i];
    }
    for (const StageFigure& t : s.stages) {
      CsvRow(stages) << s.reading << s.width_px << s.height_px << t.stage << t.time << profile.ceiling.clock
                     << t.dispatches << t.read_bytes << t.written_bytes << t.GB_per_s << t.ceiling_fraction;
    }
  }
  growth << "reading,stage,from_px,sizes,exponent,exponent_standard_error\n";
  for (const Growth& g : profile.growth)
    CsvRow(growth) << g.reading << g.stage << g.from_px << g.sizes << g.exponent << g.exponent_standard_error;
  solvers << "width_px,height_px,truth,solver,where,relative_rms_error,peak_to_valley_error," << kTimes
          << ",cpu_ms,on_front\n";
  for (const SolverFigure& s : profile.solvers) {
    CsvRow(solvers) << s.width_px << s.height_px << s.truth << s.solver << s.where << s.relative_rms_error
                    << s.peak_to_valley_error << s.time << s.cpu_ms << uint32_t{s.on_front};
  }
  outputs << "reading,width_px,height_px,outputs,touched_fraction," << kTimes
          << ",cpu_ms,cpu_ratio,cpu_ratio_q25,cpu_ratio_q75,memory_bytes\n";
  for (const OutputFigure& o : profile.outputs) {
    CsvRow(outputs) << o.reading << o.width_px << o.height_px << o.outputs << o.touched_fraction << o.time
                    << o.cpu_ms << o.cpu_ratio << o.cpu_ratio_q25 << o.cpu_ratio_q75 << o.memory_bytes;
  }
  live << "reading,width_px,height_px,rate_Hz,frames,dropped_before_engine,dropped_before_display,until,"
       << kTimes << "\n";
  for (const LiveFigure& l : profile.live) {
    for (const auto& [until, times] : {std::pair{"measured", l.to_measured}, {"drawn", l.to_picture}})
      CsvRow(live) << l.reading << l.width_px << l.height_px << l.rate_Hz << l.frames
                   << l.dropped_before_engine << l.dropped_before_display << std::string(until) << times;
  }
  rates << "scene,width_px,height_px,rate_Hz,frames,dropped_before_engine," << kTimes << ",frames_per_s\n";
  for (const RateFigure& r : profile.rates)
    CsvRow(rates) << r.scene << r.width_px << r.height_px << r.rate_Hz << r.frames << r.dropped_before_engine
                  << r.to_measured << r.frames_per_s;
  threads << "scene,width_px,height_px,rate_Hz,thread,step,part," << kTimes << ",ms_per_turn,busy\n";
  for (const PhotonFigure& p : profile.photon)
    for (const ThreadPart& t : p.parts)
      CsvRow(threads) << p.scene << p.width_px << p.height_px << p.rate_Hz << t.thread << t.step << t.part
                      << t.time << t.ms_per_turn << t.busy;
  ceiling << "buffer_bytes,copy_GB_per_s,kernel_GB_per_s\n";
  for (const CeilingPoint& p : profile.ceiling.points)
    CsvRow(ceiling) << p.buffer_bytes << p.copy_GB_per_s << p.stream_GB_per_s;
  return {{"frames.csv", frames.str()},  {"latency.csv", histograms.str()}, {"stages.csv", stages.str()},
          {"growth.csv", growth.str()},  {"solvers.csv", solvers.str()},    {"outputs.csv", outputs.str()},
          {"live.csv", live.str()},      {"rates.csv", rates.str()},        {"threads.csv", threads.str()},
          {"ceiling.csv", ceiling.str()}};
}

}  // namespace palpate::perf
