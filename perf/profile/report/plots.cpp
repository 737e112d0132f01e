#include "perf/profile/report/plots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "engine/base/text.h"
#include "perf/profile/photon.h"
#include "perf/profile/report/answers.h"
#include "perf/profile/report/tables.h"

namespace palpate::perf {
namespace {

using Style = PlotCurve::Style;

// More solvers and stages than colours: they have marks of their own too.
constexpr std::array<int, 10> kMarks = {7, 5, 9, 11, 13, 4, 6, 8, 10, 12};

/// The i-th of many curves.
PlotCurve& add(PlotPanel& panel, size_t i, const std::string& title, Style style = Style::LinesAndPoints) {
  PlotCurve& curve = panel.add(title, {}, {}, i == 0 ? kPlotBlack : i - 1, style);
  curve.mark = kMarks[i % kMarks.size()];
  curve.size = 1.1;
  return curve;
}

/// Over the pixels on a logarithmic axis, marked with the sizes that were measured.
PlotPanel over_sizes(const std::string& title, const char* y_label, const std::vector<SizeFigure>& sizes) {
  std::map<uint64_t, std::string> marks;
  for (const SizeFigure& s : sizes)
    marks[s.pixels()] = std::to_string(s.width_px) + "x" + std::to_string(s.height_px);
  PlotPanel panel{title, "frame (logarithmic in pixels), px", y_label};
  for (const auto& [pixels, mark] : marks) panel.x_tics.emplace_back(mark, static_cast<double>(pixels));
  panel.log_x = panel.log_y = true;
  panel.key = "outside right top";
  panel.x_range = {{panel.x_tics.front().second / 1.5, panel.x_tics.back().second * 1.5}};
  return panel;
}

/// One line for each stage over the sizes; `value` is 0 where there is nothing to draw.
void add_stages(PlotPanel& panel, const Profile& profile, const std::string& reading, bool with_frame,
                const std::function<double(const StageFigure&)>& value) {
  std::vector<std::string> stages;
  std::map<std::string, std::vector<std::array<double, 2>>> points;
  for (const SizeFigure& s : profile.sizes) {
    if (s.reading != reading) continue;
    const auto x = static_cast<double>(s.pixels());
    if (with_frame) points["frame"].push_back({x, s.latency.median_ms});
    for (const StageFigure& stage : s.stages) {
      if (std::find(stages.begin(), stages.end(), stage.stage) == stages.end()) stages.push_back(stage.stage);
      if (value(stage) > 0) points[stage.stage].push_back({x, value(stage)});
    }
  }
  if (with_frame) stages.insert(stages.begin(), "frame");
  for (size_t i = 0; i < stages.size(); ++i) {
    PlotCurve& curve =
        add(panel, with_frame ? i : i + 1, stages[i] == "frame" ? "whole frame (host)" : stages[i]);
    for (const auto& [x, y] : points[stages[i]]) curve.add(x, y);
  }
}

NamedPlot stage_times(const Profile& profile, const std::string& reading) {
  PlotPanel panel = over_sizes(slowest_stage(profile, reading), "time, ms", profile.sizes);
  add_stages(panel, profile, reading, true, [](const StageFigure& s) { return s.time.median_ms; });
  return {"stages-" + reading,
          "Median time of the whole frame (host clock) and of each stage (" + profile.ceiling.clock +
              " clock), reading " + reading + ". A line of slope 1 grows with the pixels.",
          {.panels = {panel}, .width_px = 900}};
}

NamedPlot bandwidths(const Profile& profile, const std::string& reading) {
  PlotPanel panel = over_sizes(best_bandwidth(profile, reading), "bandwidth, GB/s", profile.sizes);
  add_stages(panel, profile, reading, false, [](const StageFigure& s) { return s.GB_per_s; });
  const double ceiling = profile.ceiling.GB_per_s;
  panel.add_line("measured ceiling", {panel.x_range->first, ceiling}, {panel.x_range->second, ceiling})
      .width = 2;
  return {
      "bandwidth-" + reading,
      "Bytes read and written by each stage over its time, reading " + reading +
          ". The dashed line is what copying large buffers reaches; small frames may pass it inside a cache.",
      {.panels = {panel}, .width_px = 900}};
}

NamedPlot latencies(const Profile& profile, const std::string& reading) {
  PlotPanel panel{usual_latency(profile, reading), "time of a frame, ms", "share of the frames, %"};
  panel.log_x = true;
  panel.key = "outside right top";
  panel.y_range = {{0, kPlotAuto}};
  for (const SizeFigure& s : profile.sizes) {
    if (s.reading != reading || s.latency.samples == 0) continue;
    PlotCurve& curve =
        panel.add(size_text(s.width_px, s.height_px) + ", " + std::to_string(s.latency.samples) + " frames",
                  {}, {}, panel.curves.size(), Style::FilledSteps);
    const Histogram& h = s.histogram;
    for (size_t b = 0; b < h.counts.size(); ++b)
      curve.add(h.edges_ms[b],
                100.0 * static_cast<double>(h.counts[b]) / static_cast<double>(s.latency.samples));
    curve.add(h.edges_ms.back(), 0);
  }
  return {"latency-" + reading,
          "Distribution of the time of single frames (Pipeline::process, host clock, no timers), reading " +
              reading + ". Bins grow by a constant factor.",
          {.panels = {panel}, .width_px = 900}};
}

NamedPlot throughput(const Profile& profile, const std::vector<std::string>& readings) {
  PlotPanel panel = over_sizes(headline(profile), "frames/s", profile.sizes);
  for (const double rate : {30.0, 200.0})
    panel.add_line(palpate::text("%g frames/s", rate), {panel.x_range->first, rate},
                   {panel.x_range->second, rate});
  for (size_t i = 0; i < readings.size(); ++i) {
    PlotCurve& curve = add(panel, i + 1, readings[i]);
    for (const SizeFigure& s : profile.sizes)
      if (s.reading == readings[i]) curve.add(static_cast<double>(s.pixels()), s.frames_per_s);
  }
  return {"throughput",
          "Frames a second with three frames in flight, a tenth of each touched.",
          {.panels = {panel}, .width_px = 900}};
}

/// One panel for each truth; points are solvers, the line is the front.
NamedPlot pareto(const Profile& profile, uint32_t width_px, uint32_t height_px) {
  constexpr double kLeast = 1e-9;  // what a logarithmic axis can still show
  std::vector<std::string> truths, solvers;
  const auto add_name = [](std::vector<std::string>& list, const std::string& name) {
    if (std::find(list.begin(), list.end(), name) == list.end()) list.push_back(name);
  };
  std::vector<const SolverFigure*> figures;
  double low_ms = INFINITY, high_ms = 0, low = INFINITY, high = 0;
  for (const SolverFigure& s : profile.solvers) {
    if (s.width_px != width_px || s.height_px != height_px) continue;
    figures.push_back(&s);
    add_name(truths, s.truth);
    add_name(solvers, s.solver);
    low_ms = std::min(low_ms, s.time.median_ms);
    high_ms = std::max(high_ms, s.time.median_ms);
    low = std::min(low, std::max(s.relative_rms_error, kLeast));
    high = std::max(high, s.relative_rms_error);
  }
  const std::string size = size_text(width_px, height_px);
  Plot plot{"Surface: error against run time, " + size, {}, 3, 1100, 700};
  for (const std::string& truth : truths) {
    PlotPanel panel{truth, "time of a solve, ms", "relative RMS error"};
    panel.log_x = panel.log_y = true;
    panel.x_range = {{low_ms / 1.6, high_ms * 1.6}};
    panel.y_range = {{low / 3, high * 3}};
    std::map<double, double> front;
    panel.curves.resize(1);
    for (size_t i = 0; i < solvers.size(); ++i)
      for (const SolverFigure* s : figures) {
        if (s->truth != truth || s->solver != solvers[i]) continue;
        const double error = std::max(s->relative_rms_error, kLeast);
        if (s->on_front) front[s->time.median_ms] = error;
        PlotCurve& point = add(panel, i + 1, "", Style::Points);
        point.add(s->time.median_ms, error, s->time.q25_ms, s->time.q75_ms);
        point.across = true;
      }
    PlotCurve& line = panel.curves.front();
    line = {.style = Style::Steps, .colour = kPlotGray, .dashed = true, .width = 1.2};
    for (const auto& [ms, error] : front) line.add(ms, error);
    plot.panels.push_back(std::move(panel));
  }
  PlotPanel legend{.key = "left center Left reverse", .bare = true};
  legend.add_line("front", {-2, 0}, {-1, 0});
  for (size_t i = 0; i < solvers.size(); ++i) add(legend, i + 1, solvers[i], Style::Points).add(-1, 0);
  plot.panels.push_back(std::move(legend));
  return {"error-against-time-" + std::to_string(width_px) + "x" + std::to_string(height_px),
          "Every way to solve for the surface at " + size +
              ": relative RMS error over median time (bars: quartiles), for five surfaces that are known "
              "exactly. Lower left is better.",
          std::move(plot)};
}

/// Bars of CPU time and memory side by side.
NamedPlot output_costs(const Profile& profile, const std::string& reading) {
  PlotPanel time{"", "CPU time of a frame, ms", ""}, memory{"", "memory, MB", ""};
  std::string size;
  for (PlotPanel* panel : {&time, &memory}) {
    panel->x_range = {{0, 1e-6}};
    PlotCurve bars{.style = Style::Rows, .colour = panel == &time ? 0u : 1u, .width = 0.64},
        words{.style = Style::Words, .colour = kPlotBlack};
    for (const OutputFigure& o : profile.outputs) {
      if (o.reading != reading) continue;
      const double cost = panel == &time ? o.cpu_ms : static_cast<double>(o.memory_bytes) * 1e-6;
      const auto row = static_cast<double>(panel->y_tics.size());
      bars.add(cost, row);
      words.add(cost, row);
      words.words.push_back(figure(cost));
      panel->y_tics.emplace_back(panel == &time ? o.outputs : "", row);
      panel->x_range->second = std::max(panel->x_range->second, 1.25 * cost);
      size = size_text(o.width_px, o.height_px);
    }
    panel->curves = {bars, words};
    panel->y_range = {{-0.6, static_cast<double>(panel->y_tics.size()) - 0.4}};
    panel->down = true;
  }
  const int rows = static_cast<int>(time.y_tics.size());
  return {"outputs-" + reading,
          "CPU time of the process in one frame, and memory held on the device, when outputs are left out; "
          "reading " +
              reading + ", " + size + ".",
          {"Cost of outputs, reading " + reading + ", " + size, {time, memory}, 2, 1200, 130 + 44 * rows}};
}

NamedPlot ceiling(const Profile& profile) {
  PlotPanel panel{"Memory ceiling", "buffer, MB", "bandwidth, GB/s"};
  panel.log_x = true;
  panel.key = "outside right top";
  panel.y_range = {{0, kPlotAuto}};
  PlotCurve copy = add(panel, 1, "copy"), kernel = add(panel, 2, "kernel");
  for (const CeilingPoint& p : profile.ceiling.points) {
    copy.add(static_cast<double>(p.buffer_bytes) * 1e-6, p.copy_GB_per_s);
    kernel.add(static_cast<double>(p.buffer_bytes) * 1e-6, p.stream_GB_per_s);
  }
  panel.curves = {copy, kernel};
  return {"ceiling",
          "Bytes read plus bytes written a second by work that does nothing else, over the size of its "
          "buffers. Small buffers stay in caches; the largest gives the ceiling.",
          {.panels = {panel}, .width_px = 900, .height_px = 420}};
}

/// A panel a scene, a row a thread: the steps of a frame one behind the other; and those of a picture's age.
NamedPlot photon(const Profile& profile) {
  constexpr double kWide = 0.6;
  constexpr std::array<size_t, std::size(kPhotonSteps)> kColours = {0, 1, 2, 3, 5, 6, 7};  // 4 is gray too
  const char* const age = "picture";
  Plot plot{"From photon to picture", {}, 1, 900, 60};
  for (const PhotonFigure& p : profile.photon) {
    PlotPanel panel{
        palpate::text("%s, %s, %g frames/s: a picture is %.3g ms old", p.scene.c_str(),
                      size_text(p.width_px, p.height_px).c_str(), p.rate_Hz, p.to_picture.median_ms),
        "ms of a frame", ""};
    std::vector<std::string> rows{age};
    std::map<std::string, double> ends{{age, p.waits_ms}};
    std::vector<PlotCurve> bars{
        {.title = "waiting", .style = Style::Rows, .colour = kPlotGray, .width = kWide}};
    bars.front().add(p.waits_ms, 0);
    for (size_t i = 0; i < std::size(kPhotonSteps); ++i) {
      PlotCurve bar{.title = kPhotonSteps[i], .style = Style::Rows, .colour = kColours[i], .width = kWide};
      std::map<std::string, bool> touched;
      for (const ThreadPart& t : p.parts) {
        if (t.step != kPhotonSteps[i]) continue;
        if (std::ranges::find(rows, t.thread) == rows.end()) rows.push_back(t.thread);
        const bool seen = t.thread == "engine" || t.thread == "drawing";
        for (const std::string& row :
             seen ? std::vector{t.thread, std::string(age)} : std::vector{t.thread}) {
          ends[row] += t.ms_per_turn;
          touched[row] = true;
        }
      }
      for (const auto& [row, any] : touched)
        bar.add(ends[row], static_cast<double>(std::ranges::find(rows, row) - rows.begin()));
      bars.push_back(std::move(bar));
    }
    // Each from 0 to its end: the last ones first, so that those before them lie over them.
    panel.curves.assign(bars.rbegin(), bars.rend());
    for (size_t i = 0; i < rows.size(); ++i) panel.y_tics.emplace_back(rows[i], static_cast<double>(i));
    panel.y_range = {{-0.6, static_cast<double>(rows.size()) - 0.4}};
    panel.x_range = {{0, kPlotAuto}};
    panel.down = true;
    panel.key = "outside right top invert";
    plot.height_px += 290;
    plot.panels.push_back(std::move(panel));
  }
  return {
      "photon-to-picture",
      "Where the time of a frame goes, thread by thread, and the mean age of a picture, while a session is "
      "recorded. Device: what the engine waits for it.",
      std::move(plot)};
}

}  // namespace

bool has_curves(const std::vector<SizeFigure>& sizes, const std::string& reading) {
  constexpr size_t kFewest = 3;  // two points make a straight line of anything
  std::set<uint64_t> different;
  for (const SizeFigure& s : sizes)
    if (s.reading == reading) different.insert(s.pixels());
  return different.size() >= kFewest;
}

std::vector<NamedPlot> plots_of(const Profile& profile) {
  std::vector<NamedPlot> plots;
  const std::vector<std::string> readings = readings_of(profile);
  std::vector<std::string> curved;
  for (const std::string& reading : readings)
    if (has_curves(profile.sizes, reading)) curved.push_back(reading);
  plots.reserve(4 * readings.size());
  for (const std::string& reading : curved) plots.push_back(stage_times(profile, reading));
  for (const std::string& reading : readings) plots.push_back(latencies(profile, reading));
  if (!curved.empty()) plots.push_back(throughput(profile, curved));
  if (!profile.photon.empty()) plots.push_back(photon(profile));
  for (const std::string& reading : curved) plots.push_back(bandwidths(profile, reading));
  if (profile.ceiling.points.size() > 2) plots.push_back(ceiling(profile));
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
NamedPlot compared_frames(const std::vector<Profile>& profiles, const std::vector<std::string>& names,
                          const std::string& reading) {
  std::vector<SizeFigure> all;
  for (const Profile& profile : profiles)
    for (const SizeFigure& s : profile.sizes)
      if (s.reading == reading) all.push_back(s);
  PlotPanel panel = over_sizes("Time of a frame, reading " + reading, "time of a frame, ms", all);
  panel.key = "outside top center horizontal";
  for (size_t i = 0; i < profiles.size(); ++i) {
    PlotCurve curve = add(panel, i + 1, names[i]);
    panel.curves.pop_back();
    for (const SizeFigure& s : profiles[i].sizes) {
      if (s.reading != reading) continue;
      curve.add(static_cast<double>(s.pixels()), s.latency.median_ms, s.latency.q25_ms, s.latency.q75_ms);
    }
    panel.curves.push_back(std::move(curve));
  }
  return {"compare-" + reading,
          "Median time of a frame (bars: quartiles), reading " + reading + ".",
          {.panels = {panel}, .width_px = 900, .height_px = 520 + 10 * static_cast<int>(profiles.size())}};
}

/// Error of every solver over its time on one truth of one size; each machine a colour.
NamedPlot compared_errors(const std::vector<Profile>& profiles, const std::vector<std::string>& names,
                          const SolverFigure& first) {
  const std::string size = size_text(first.width_px, first.height_px);
  PlotPanel panel{"Error against run time, " + first.truth + ", " + size, "time of a solve, ms",
                  "relative RMS error"};
  panel.log_x = panel.log_y = true;
  panel.key = "outside top center horizontal";
  panel.room_above = 0.06;
  panel.room_right = 0.2;
  for (size_t i = 0; i < profiles.size(); ++i) {
    PlotCurve points = add(panel, i + 1, names[i], Style::Points);
    panel.curves.pop_back();
    points.across = true;
    for (const SolverFigure& s : profiles[i].solvers) {
      if (s.truth != first.truth || s.width_px != first.width_px || s.height_px != first.height_px) continue;
      points.add(s.time.median_ms, s.relative_rms_error, s.time.q25_ms, s.time.q75_ms);
      points.words.push_back(s.solver);
    }
    PlotCurve words{.x = points.x, .y = points.y, .style = Style::Words, .colour = kPlotBlack};
    words.words = std::exchange(points.words, {});
    panel.curves.insert(panel.curves.end(), {points, words});
  }
  return {"compare-error-" + std::to_string(first.width_px) + "x" + std::to_string(first.height_px),
          "Relative RMS error of every surface solver over its median time (bars: quartiles) on the truth " +
              first.truth + ", " + size + ". Lower left is better.",
          {.panels = {panel}, .width_px = 900, .height_px = 520 + 10 * static_cast<int>(profiles.size())}};
}

}  // namespace

std::vector<NamedPlot> comparison_plots(const std::vector<Profile>& profiles,
                                        const std::vector<std::string>& names) {
  std::vector<NamedPlot> plots;
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

}  // namespace palpate::perf
