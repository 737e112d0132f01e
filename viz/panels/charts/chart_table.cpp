#include "viz/panels/charts/chart_table.h"

#include <cmath>
#include <functional>
#include <vector>

#include "capture/files/measurements.h"
#include "capture/files/tables/csv_table.h"

namespace palpate::viz {
namespace {

struct Column {
  std::string name;
  std::function<std::string(const Sample&)> cell;
};

std::string number(double value) {
  return std::isfinite(value) ? shortest(value) : "";
}

/// A quantity with its error and, where `state` is a name, its state.
template <typename Find>
void add_estimate(std::vector<Column>& columns, const std::string& name, const std::string& error,
                  const std::string& state, Find find) {
  columns.push_back(
      {name, [find](const Sample& s) { return has_value(find(s)) ? number(find(s).value) : ""; }});
  columns.push_back(
      {error, [find](const Sample& s) { return has_value(find(s)) ? number(find(s).standard_error) : ""; }});
  if (!state.empty())
    columns.push_back({state, [find](const Sample& s) { return csv_cell(to_string(find(s).validity)); }});
}

std::vector<Column> columns_of(const History& history, const Sensor& sensor) {
  std::vector<Column> columns;
  columns.push_back(
      {history.timeline().timed ? "time_s" : "frame", [](const Sample& s) { return number(s.time); }});
  if (sensor.force)
    add_estimate(columns, "force_N", "force_sd_N", "force_state", [](const Sample& s) { return s.force_N; });
  if (sensor.layer)
    add_estimate(columns, "wrench_fz_N", "wrench_fz_sd_N", "wrench_state",
                 [](const Sample& s) { return s.layer_N.value_or(Estimate{}); });
  if (sensor.shear) {
    add_estimate(columns, "shear_x_N", "shear_x_sd_N", "", [](const Sample& s) { return s.shear_x_N; });
    add_estimate(columns, "shear_y_N", "shear_y_sd_N", "shear_state",
                 [](const Sample& s) { return s.shear_y_N; });
    columns.push_back({"slip", [](const Sample& s) { return std::string(to_string(s.slip)); }});
  }
  if (sensor.reading != SurfaceReading::None) {
    columns.push_back(
        {"depth_max_mm", [](const Sample& s) { return s.has_depth ? number(s.depth_mm) : ""; }});
    columns.push_back({"depth_sd_mm", [](const Sample& s) {
                         return s.has_depth && s.depth_sd_mm > 0 ? number(s.depth_sd_mm) : "";
                       }});
  }
  columns.push_back({"gray_sum", [](const Sample& s) { return number(s.gray_sum); }});
  return columns;
}

}  // namespace

std::string chart_table(const History& history, const TimeSpan& span, const Sensor& sensor) {
  const std::vector<Column> columns = columns_of(history, sensor);
  std::string table;
  for (const Column& column : columns) table += column.name + ",";
  table += "event\n";
  const auto within = [&span](double time) { return time >= span.end - span.length && time <= span.end; };
  const std::deque<Sample>& samples = history.samples();
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!within(samples[i].time)) continue;
    for (const Column& column : columns) table += column.cell(samples[i]) + ",";
    // What was marked from this sample until the next.
    std::string marked;
    for (const EventMark& event : history.events())
      if (event.time >= samples[i].time && (i + 1 == samples.size() || event.time < samples[i + 1].time))
        marked += (marked.empty() ? "" : "; ") + event.label;
    table += csv_cell(marked) + "\n";
  }
  return table;
}

}  // namespace palpate::viz
