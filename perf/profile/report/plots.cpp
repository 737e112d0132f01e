#include "perf/profile/report/plots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>

#include "engine/base/text.h"
#include "perf/profile/report/answers.h"
#include "perf/profile/report/tables.h"
#include "viz/report/gnuplot.h"

namespace palpate::perf {
namespace {

constexpr uint32_t kWidth = 900, kHeight = 520;
// Told apart by eyes that see colours differently too (Okabe and Ito), and by their marks.
constexpr std::array<const char*, 10> kColors = {"#000000", "#0072b2", "#e69f00", "#009e73", "#cc79a7",
                                                 "#d55e00", "#56b4e9", "#7a5195", "#882255", "#999933"};
constexpr std::array<int, 10> kMarks = {7, 5, 9, 11, 13, 4, 6, 8, 10, 12};

std::string number(double value) {
  const std::string line = palpate::text("%.6g", value);
  return line;
}

std::string style(size_t i) {
  return " lw 2 ps 1.1 pt " + std::to_string(kMarks[i % kMarks.size()]) + " lc rgb '" +
         kColors[i % kColors.size()] + "'";
}

/// A label of an axis, which gnuplot reads as a number's format.
std::string gnuplot_tick(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '%' ? std::string("%%") : std::string(1, c);
  return gnuplot_quoted(escaped);
}

/// Tics of a logarithmic axis: 10⁻⁸, 10⁻⁷, ...
std::string powers_of_ten(double low, double high) {
  constexpr const char* kDigits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string tics;
  for (int e = static_cast<int>(std::ceil(std::log10(low))); e <= std::floor(std::log10(high)); ++e) {
    std::string raised = e < 0 ? "⁻" : "";
    for (const char c : std::to_string(std::abs(e))) raised += kDigits[c - '0'];
    tics += (tics.empty() ? "'10" : ", '10") + raised + "' 1e" + std::to_string(e);
  }
  return tics;
}

/// A named block of inline data.
std::string block(const std::string& name, const std::string& lines) {
  return "$" + name + " << EOD\n" + lines + "EOD\n";
}

/// x: pixels on a logarithmic axis, marked with the sizes that were measured.
std::string size_axis(const std::vector<SizeFigure>& sizes) {
  std::map<uint64_t, std::string> marks;
  for (const SizeFigure& s : sizes)
    marks[s.pixels()] = std::to_string(s.width_px) + "x" + std::to_string(s.height_px);
  std::string text = "set logscale x\nset xtics rotate by 40 right (";
  bool first = true;
  for (const auto& [pixels, mark] : marks) {
    text += (first ? "" : ", ") + gnuplot_quoted(mark) + " " + std::to_string(pixels);
    first = false;
  }
  const double low = static_cast<double>(marks.begin()->first),
               high = static_cast<double>(marks.rbegin()->first);
  return text + ")\nset xrange [" + number(low / 1.5) + ":" + number(high * 1.5) +
         "]\nset xlabel 'frame (logarithmic in pixels), px' offset 0,-2\nset bmargin 8\n";
}

const char* kFrameOfPlot =
    "set grid lc rgb '#dddddd' lt 1 lw 0.6\nset border lc rgb '#666666'\nset tics textcolor rgb "
    "'#222222'\nset key outside right "
    "top noenhanced samplen 2\n";

/// One line for each stage over the sizes; `value` is 0 where there is nothing to draw.
std::string stage_lines(const Profile& profile, const std::string& reading, bool with_frame,
                        const std::function<double(const StageFigure&)>& value, std::string& blocks) {
  std::vector<std::string> stages;
  std::map<std::string, std::string> lines;
  for (const SizeFigure& s : profile.sizes) {
    if (s.reading != reading) continue;
    const std::string x = std::to_string(s.pixels()) + " ";
    if (with_frame) lines["frame"] += x + number(s.latency.median_ms) + "\n";
    for (const StageFigure& stage : s.stages) {
      if (std::find(stages.begin(), stages.end(), stage.stage) == stages.end()) stages.push_back(stage.stage);
      if (value(stage) > 0) lines[stage.stage] += x + number(value(stage)) + "\n";
    }
  }
  if (with_frame) stages.insert(stages.begin(), "frame");
  std::string plot;
  for (size_t i = 0; i < stages.size(); ++i) {
    blocks += block("s" + std::to_string(i), lines[stages[i]]);
    const size_t look = with_frame ? i : i + 1;
    plot += std::string(i ? ", " : "plot ") + "$s" + std::to_string(i) + " using 1:2 with linespoints" +
            style(look) + " title " + gnuplot_quoted(stages[i] == "frame" ? "whole frame (host)" : stages[i]);
  }
  return plot;
}

Plot stage_times(const Profile& profile, const std::string& reading) {
  std::string blocks;
  const std::string lines = stage_lines(
      profile, reading, true, [](const StageFigure& s) { return s.time.median_ms; }, blocks);
  return {"stages-" + reading,
          "Median time of the whole frame (host clock) and of each stage (" + profile.ceiling.clock +
              " clock), reading " + reading + ". A line of slope 1 grows with the pixels.",
          kWidth, kHeight,
          blocks + kFrameOfPlot + size_axis(profile.sizes) +
              "set logscale y\nset format y '%g'\nset ylabel 'time, ms'\nset title " +
              gnuplot_quoted(slowest_stage(profile, reading)) + "\n" + lines + "\n"};
}

Plot bandwidths(const Profile& profile, const std::string& reading) {
  std::string blocks;
  const std::string lines = stage_lines(
      profile, reading, false, [](const StageFigure& s) { return s.GB_per_s; }, blocks);
  return {
      "bandwidth-" + reading,
      "Bytes read and written by each stage over its time, reading " + reading +
          ". The dashed line is what copying large buffers reaches; small frames may pass it inside a cache.",
      kWidth, kHeight,
      blocks + kFrameOfPlot + size_axis(profile.sizes) +
          "set logscale y\nset format y '%g'\nset ylabel 'bandwidth, GB/s'\nset title " +
          gnuplot_quoted(best_bandwidth(profile, reading)) + "\n" + lines + ", " +
          number(profile.ceiling.GB_per_s) +
          " with lines lw 2 dt 2 lc rgb '#d55e00' title 'measured ceiling'\n"};
}

Plot latencies(const Profile& profile, const std::string& reading) {
  std::string blocks, plot;
  size_t i = 0;
  for (const SizeFigure& s : profile.sizes) {
    if (s.reading != reading || s.latency.samples == 0) continue;
    std::string lines;
    const Histogram& h = s.histogram;
    for (size_t b = 0; b < h.counts.size(); ++b) {
      const double share = 100.0 * static_cast<double>(h.counts[b]) / static_cast<double>(s.latency.samples);
      lines += number(h.edges_ms[b]) + " " + number(share) + "\n";
    }
    lines += number(h.edges_ms.back()) + " 0\n";
    blocks += block("h" + std::to_string(i), lines);
    plot += std::string(i ? ", " : "plot ") + "$h" + std::to_string(i) +
            " using 1:2 with fillsteps fs transparent solid 0.25 lc rgb '" + kColors[i % kColors.size()] +
            "' notitle, $h" + std::to_string(i) + " using 1:2 with steps lw 1.5 lc rgb '" +
            kColors[i % kColors.size()] + "' title " +
            gnuplot_quoted(size_text(s.width_px, s.height_px) + ", " + std::to_string(s.latency.samples) +
                           " frames");
    ++i;
  }
  return {"latency-" + reading,
          "Distribution of the time of single frames (Pipeline::process, host clock, no timers), reading " +
              reading + ". Bins grow by a constant factor.",
          kWidth, kHeight,
          blocks + kFrameOfPlot +
              "set logscale x\nset format x '%g'\nset xlabel 'time of a frame, ms'\nset ylabel 'share of the "
              "frames, %'\nset yrange "
              "[0:*]\nset title " +
              gnuplot_quoted(usual_latency(profile, reading)) + "\n" + plot + "\n"};
}

Plot throughput(const Profile& profile) {
  std::string blocks, plot =
                          "plot 30 with lines lw 1 dt 3 lc rgb '#888888' title '30 frames/s', 200 with lines "
                          "lw 1 dt 2 lc rgb '#888888' title '200 frames/s'";
  const std::vector<std::string> readings = readings_of(profile);
  for (size_t i = 0; i < readings.size(); ++i) {
    std::string lines;
    for (const SizeFigure& s : profile.sizes)
      if (s.reading == readings[i]) lines += std::to_string(s.pixels()) + " " + number(s.frames_per_s) + "\n";
    blocks += block("r" + std::to_string(i), lines);
    plot += ", $r" + std::to_string(i) + " using 1:2 with linespoints" + style(i + 1) + " title " +
            gnuplot_quoted(readings[i]);
  }
  return {"throughput", "Frames a second with three frames in flight, every tile touched.", kWidth, kHeight,
          blocks + kFrameOfPlot + size_axis(profile.sizes) +
              "set logscale y\nset format y '%g'\nset ylabel 'frames/s'\nset title " +
              gnuplot_quoted(headline(profile)) + " font ',9'\n" + plot + "\n"};
}

/// One panel for each truth; points are solvers, the line is the front.
Plot pareto(const Profile& profile, uint32_t width_px, uint32_t height_px) {
  constexpr double kLeast = 1e-9;  // what a logarithmic axis can still show
  std::vector<std::string> truths, solvers;
  const auto add = [](std::vector<std::string>& list, const std::string& name) {
    if (std::find(list.begin(), list.end(), name) == list.end()) list.push_back(name);
  };
  double low_ms = INFINITY, high_ms = 0, low = INFINITY, high = 0;
  for (const SolverFigure& s : profile.solvers) {
    if (s.width_px != width_px || s.height_px != height_px) continue;
    add(truths, s.truth);
    add(solvers, s.solver);
    low_ms = std::min(low_ms, s.time.median_ms);
    high_ms = std::max(high_ms, s.time.median_ms);
    low = std::min(low, std::max(s.relative_rms_error, kLeast));
    high = std::max(high, s.relative_rms_error);
  }
  std::string script =
      "set grid lc rgb '#dddddd' lt 1 lw 0.6\nset border lc rgb '#666666'\nset logscale xy\nset format x "
      "'%g'\nset ytics (" +
      powers_of_ten(low / 3, high * 3) + ")\nunset key\nset xrange [" + number(low_ms / 1.6) + ":" +
      number(high_ms * 1.6) + "]\nset yrange [" + number(low / 3) + ":" + number(high * 3) +
      "]\nset lmargin 10\nset rmargin 2\nset bmargin 3.5\n";
  std::string panels;
  for (size_t t = 0; t < truths.size(); ++t) {
    std::vector<std::pair<double, double>> front;
    std::string plot;
    for (size_t i = 0; i < solvers.size(); ++i) {
      for (const SolverFigure& s : profile.solvers) {
        if (s.width_px != width_px || s.height_px != height_px || s.truth != truths[t] ||
            s.solver != solvers[i])
          continue;
        const double error = std::max(s.relative_rms_error, kLeast);
        if (s.on_front) front.emplace_back(s.time.median_ms, error);
        const std::string data = "p" + std::to_string(t) + "_" + std::to_string(i);
        script += block(data, number(s.time.median_ms) + " " + number(error) + " " + number(s.time.q25_ms) +
                                  " " + number(s.time.q75_ms) + "\n");
        plot += ", $" + data + " using 1:2:3:4 with xerrorbars" + style(i + 1) + " notitle";
      }
    }
    std::sort(front.begin(), front.end());
    std::string line;
    for (const auto& [ms, error] : front) line += number(ms) + " " + number(error) + "\n";
    script += block("f" + std::to_string(t), line);
    panels += "set title " + gnuplot_quoted(truths[t]) +
              "\nset xlabel 'time of a solve, ms'\nset ylabel 'relative RMS error'\nplot $f" +
              std::to_string(t) + " using 1:2 with steps lw 1.2 dt 2 lc rgb '#888888'" + plot + "\n";
  }
  std::string legend = "plot 1/0 with lines lw 1.2 dt 2 lc rgb '#888888' title 'front'";
  for (size_t i = 0; i < solvers.size(); ++i)
    legend += ", 1/0 with points" + style(i + 1) + " title " + gnuplot_quoted(solvers[i]);
  panels +=
      "unset xlabel\nunset ylabel\nunset title\nunset tics\nunset border\nunset grid\nset key inside left "
      "center Left reverse noenhanced spacing 1.3 samplen 2\n" +
      legend + "\n";
  const std::string size = size_text(width_px, height_px);
  return {"error-against-time-" + std::to_string(width_px) + "x" + std::to_string(height_px),
          "Every way to solve for the surface at " + size +
              ": relative RMS error over median time (bars: quartiles), for five surfaces that are known "
              "exactly. Lower left is "
              "better.",
          kWidth + 200, 700,
          script + "set multiplot layout 2,3 title " +
              gnuplot_quoted("Surface: error against run time, " + size) + "\n" + panels +
              "unset multiplot\n"};
}

/// Bars of CPU time and memory side by side.
Plot output_costs(const Profile& profile, const std::string& reading) {
  std::string lines, labels;
  size_t n = 0;
  double most_ms = 0, most_MB = 0;
  std::string size;
  for (const OutputFigure& o : profile.outputs) {
    if (o.reading != reading) continue;
    const double MB = static_cast<double>(o.memory_bytes) * 1e-6;
    lines += std::to_string(n) + " " + number(o.cpu_ms) + " " + number(MB) + " " + figure(o.cpu_ms) + " " +
             figure(MB) + "\n";
    labels += (n ? ", " : "") + gnuplot_tick(o.outputs) + " " + std::to_string(n);
    most_ms = std::max(most_ms, o.cpu_ms);
    most_MB = std::max(most_MB, MB);
    size = size_text(o.width_px, o.height_px);
    ++n;
  }
  const auto panel = [&](const std::string& margins, const std::string& label, double most, int column,
                         size_t color) {
    return margins + "set xrange [0:" + number(1.25 * std::max(most, 1e-6)) + "]\nset xlabel '" + label +
           "'\nplot $bars using (0):1:(0):" + std::to_string(column) +
           ":($1-0.32):($1+0.32) with boxxyerror fs solid 0.75 noborder lc rgb '" + kColors[color] +
           "' notitle, $bars using " + std::to_string(column) + ":1:" + std::to_string(column + 2) +
           " with labels left offset 0.6,0 notitle\n";
  };
  const std::string rows = "set yrange [" + number(static_cast<double>(n) - 0.4) + ":-0.6]\n";
  return {"outputs-" + reading,
          "CPU time of the process in one frame, and memory held on the device, when outputs are left out; "
          "reading " +
              reading + ", " + size + ".",
          kWidth + 100, static_cast<uint32_t>(130 + 44 * n),
          block("bars", lines) +
              "set grid x lc rgb '#dddddd' lt 1 lw 0.6\nset border 3 lc rgb '#666666'\nset tics nomirror\n" +
              rows + "set multiplot title " +
              gnuplot_quoted("Cost of outputs, reading " + reading + ", " + size) +
              "\nset tmargin at screen 0.88\nset bmargin at screen 0.2\nset ytics (" + labels + ")\n" +
              panel("set lmargin at screen 0.35\nset rmargin at screen 0.65\n", "CPU time of a frame, ms",
                    most_ms, 2, 1) +
              "unset ytics\n" +
              panel("set lmargin at screen 0.69\nset rmargin at screen 0.98\n", "memory, MB", most_MB, 3, 2) +
              "unset multiplot\n"};
}

Plot ceiling(const Profile& profile) {
  std::string lines;
  for (const CeilingPoint& p : profile.ceiling.points)
    lines += number(static_cast<double>(p.buffer_bytes) * 1e-6) + " " + number(p.copy_GB_per_s) + " " +
             number(p.stream_GB_per_s) + "\n";
  return {"ceiling",
          "Bytes read plus bytes written a second by work that does nothing else, over the size of its "
          "buffers. Small buffers stay "
          "in caches; the largest gives the ceiling.",
          kWidth, 420,
          block("c", lines) + kFrameOfPlot +
              "set logscale x\nset format x '%g'\nset xlabel 'buffer, MB'\nset ylabel 'bandwidth, GB/s'\nset "
              "yrange [0:*]\nset title "
              "'Memory ceiling'\nplot $c using 1:2 with linespoints" +
              style(1) + " title 'copy', $c using 1:3 with linespoints" + style(2) + " title 'kernel'\n"};
}

}  // namespace

std::vector<Plot> plots_of(const Profile& profile) {
  std::vector<Plot> plots;
  const std::vector<std::string> readings = readings_of(profile);
  plots.reserve(4 * readings.size());
  for (const std::string& reading : readings) plots.push_back(stage_times(profile, reading));
  for (const std::string& reading : readings) plots.push_back(latencies(profile, reading));
  if (!readings.empty()) plots.push_back(throughput(profile));
  for (const std::string& reading : readings) plots.push_back(bandwidths(profile, reading));
  if (!profile.ceiling.points.empty()) plots.push_back(ceiling(profile));
  std::vector<std::pair<uint32_t, uint32_t>> sizes;
  for (const SolverFigure& s : profile.solvers) {
    const std::pair size{s.width_px, s.height_px};
    if (std::find(sizes.begin(), sizes.end(), size) == sizes.end()) sizes.push_back(size);
  }
  for (const auto& [width, height] : sizes) plots.push_back(pareto(profile, width, height));
  std::vector<std::string> costed;
  for (const OutputFigure& o : profile.outputs) {
    if (std::find(costed.begin(), costed.end(), o.reading) != costed.end()) continue;
    costed.push_back(o.reading);
    plots.push_back(output_costs(profile, o.reading));
  }
  return plots;
}

namespace {

/// Median time of a frame over the pixels; each machine a line.
Plot compared_frames(const std::vector<Profile>& profiles, const std::vector<std::string>& names,
                     const std::string& reading) {
  std::string blocks, plot;
  std::vector<SizeFigure> all;
  for (size_t i = 0; i < profiles.size(); ++i) {
    std::string lines;
    for (const SizeFigure& s : profiles[i].sizes) {
      if (s.reading != reading) continue;
      all.push_back(s);
      lines += std::to_string(s.pixels()) + " " + number(s.latency.median_ms) + " " +
               number(s.latency.q25_ms) + " " + number(s.latency.q75_ms) + "\n";
    }
    if (lines.empty()) continue;
    const std::string m = "$m" + std::to_string(i);
    blocks += block("m" + std::to_string(i), lines);
    plot += (plot.empty() ? "plot " : ", ") + m + " using 1:2 with lines lw 1 lc rgb '" +
            kColors[(i + 1) % kColors.size()] + "' notitle, " + m + " using 1:2:3:4 with yerrorbars" +
            style(i + 1) + " title " + gnuplot_quoted(names[i]);
  }
  std::string script = std::move(blocks);
  script.append(kFrameOfPlot).append("set key below center\n").append(size_axis(all));
  script.append("set bmargin " + std::to_string(9 + profiles.size() / 2) +
                "\nset logscale y\nset format y '%g'\nset ylabel 'time of a frame, ms'\n");
  script.append("set title 'Time of a frame, reading ")
      .append(reading)
      .append("'\n")
      .append(plot)
      .append("\n");
  return {"compare-" + reading, "Median time of a frame (bars: quartiles), reading " + reading + ".", kWidth,
          kHeight + static_cast<uint32_t>(10 * profiles.size()), std::move(script)};
}

/// Error of every solver over its time on one truth of one size; each machine a colour.
Plot compared_errors(const std::vector<Profile>& profiles, const std::vector<std::string>& names,
                     const SolverFigure& first) {
  std::string blocks, plot;
  for (size_t i = 0; i < profiles.size(); ++i) {
    std::string lines;
    for (const SolverFigure& s : profiles[i].solvers)
      if (s.truth == first.truth && s.width_px == first.width_px && s.height_px == first.height_px)
        lines += number(s.time.median_ms) + " " + number(s.relative_rms_error) + " " + number(s.time.q25_ms) +
                 " " + number(s.time.q75_ms) + " \"" + s.solver + "\"\n";
    if (lines.empty()) continue;
    const std::string e = "$e" + std::to_string(i);
    blocks += block("e" + std::to_string(i), lines);
    plot += (plot.empty() ? "plot " : ", ") + e + " using 1:2:3:4 with xerrorbars" + style(i + 1) +
            " title " + gnuplot_quoted(names[i]) + ", " + e +
            " using 1:2:5 with labels left offset 0.8,0.4 font ',8' notitle";
  }
  const std::string size = size_text(first.width_px, first.height_px);
  std::string script = std::move(blocks);
  script.append(kFrameOfPlot)
      .append("set key below center\nset offsets graph 0.02, graph 0.2, graph 0.06, graph 0.02\n")
      .append("set bmargin " + std::to_string(5 + profiles.size() / 2) + "\nset logscale xy\n")
      .append("set format '%g'\nset xlabel 'time of a solve, ms'\nset ylabel 'relative RMS error'\n")
      .append("set title " + gnuplot_quoted("Error against run time, " + first.truth + ", " + size) + "\n")
      .append(plot)
      .append("\n");
  return {"compare-error-" + std::to_string(first.width_px) + "x" + std::to_string(first.height_px),
          "Relative RMS error of every surface solver over its median time (bars: quartiles) on the truth " +
              first.truth + ", " + size + ". Lower left is better.",
          kWidth, kHeight + static_cast<uint32_t>(10 * profiles.size()), std::move(script)};
}

}  // namespace

std::vector<Plot> comparison_plots(const std::vector<Profile>& profiles,
                                   const std::vector<std::string>& names) {
  std::vector<Plot> plots;
  for (const std::string& reading : readings_of(profiles.front())) {
    const bool shared = std::any_of(profiles.begin() + 1, profiles.end(), [&](const Profile& profile) {
      const std::vector<std::string> others = readings_of(profile);
      return std::find(others.begin(), others.end(), reading) != others.end();
    });
    if (shared) plots.push_back(compared_frames(profiles, names, reading));
  }
  std::vector<std::string> drawn;
  for (const SolverFigure& s : profiles.front().solvers) {
    const std::string size = size_text(s.width_px, s.height_px);
    if (std::find(drawn.begin(), drawn.end(), size) != drawn.end()) continue;
    drawn.push_back(size);
    plots.push_back(compared_errors(profiles, names, s));
  }
  return plots;
}

std::string full_script(const Plot& plot, PlotKind kind) {
  std::string head = plot_terminal(kind, plot.width_px, plot.height_px);
  std::string look = kind == PlotKind::Pdf ? "" : " background rgb '#ffffff'";
  if (kind == PlotKind::Svg) {  // many stand in one page
    std::string name = plot.name;
    std::replace(name.begin(), name.end(), '-', '_');
    look += " name '" + name + "'";
  }
  return head.insert(head.size() - 1, look) + plot.script;
}

}  // namespace palpate::perf
