#include "capture/run/touch_table.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/files/csv_table.h"
#include "palpate/pipeline.h"

namespace palpate {
namespace {

constexpr int kForcePlaces = 4, kLengthPlaces = 4, kTimePlaces = 6;

/// Header or row: the cells whose columns are there.
class Line {
 public:
  explicit Line(MeasuredColumns columns) : columns_(columns) {}
  void cell(uint32_t groups, const std::string& text) {
    if ((columns_.groups & groups) != groups) return;
    line_ += (first_ ? "" : ",") + text;
    first_ = false;
  }
  const std::string& text() const { return line_; }

 private:
  MeasuredColumns columns_;
  std::string line_;
  bool first_ = true;
};

std::string value_text(double value, double error, int places) {
  return with_places(value, error > 0 ? deserved_places(error) : places);
}

std::string error_text(double error) {
  return error > 0 && std::isfinite(error) ? with_places(error, deserved_places(error)) : "";
}

using Columns = MeasuredColumns;

std::string header(MeasuredColumns columns) {
  Line line(columns);
  line.cell(Columns::Frame, "touch,first_frame,last_frame,frames");
  line.cell(Columns::Time, "from_s,to_s");
  line.cell(Columns::Frame, "peak_frame");
  line.cell(Columns::Source, "source");
  line.cell(Columns::Force, "largest_force_N,force_sd_N,force_state");
  line.cell(Columns::Depth, "largest_depth_mm");
  line.cell(Columns::DepthError, "depth_sd_mm");
  line.cell(Columns::Depth, "depth_state");
  line.cell(Columns::Touching, "largest_area_px");
  line.cell(Columns::Millimetres, "largest_area_mm2");
  line.cell(Columns::Contacts, "most_contacts");
  line.cell(Columns::Slipping, "slip_frames");
  line.cell(Columns::Touching, "saturated_frames");
  return line.text();
}

std::string row(const TouchSpan& span, size_t number, MeasuredColumns columns) {
  Line line(columns);
  line.cell(Columns::Frame, std::to_string(number) + "," + std::to_string(span.first_frame) + "," +
                                std::to_string(span.last_frame) + "," + std::to_string(span.frames));
  line.cell(Columns::Time, with_places(span.from_s, kTimePlaces) + "," + with_places(span.to_s, kTimePlaces));
  line.cell(Columns::Frame, std::to_string(span.peak_frame));
  line.cell(Columns::Source, csv_cell(span.peak_source));
  const Estimate force = span.force_N.value_or(Estimate{});
  line.cell(Columns::Force, span.force_N
                                ? value_text(force.value, force.standard_error, kForcePlaces) + "," +
                                      error_text(force.standard_error) + "," + to_string(force.validity)
                                : ",,");
  const SurfaceSummary surface = span.surface.value_or(SurfaceSummary{});
  line.cell(Columns::Depth,
            span.surface ? value_text(surface.depth_max_mm, surface.depth_sd_mm, kLengthPlaces) : "");
  line.cell(Columns::DepthError, error_text(surface.depth_sd_mm));
  line.cell(Columns::Depth, span.surface ? to_string(surface.validity) : "");
  line.cell(Columns::Touching, std::to_string(span.largest_area_px));
  line.cell(Columns::Millimetres, with_places(span.largest_area_mm2, kLengthPlaces));
  line.cell(Columns::Contacts, std::to_string(span.most_contacts));
  line.cell(Columns::Slipping, std::to_string(span.slip_frames));
  line.cell(Columns::Touching, std::to_string(span.saturated_frames));
  return line.text();
}

}  // namespace

void TouchTable::add(const Touch& touch, const std::string& source) {
  if (!touch.contact) {
    touching_ = false;
    return;
  }
  const double time_s = 1e-9 * static_cast<double>(touch.time_ns);
  if (!touching_) {
    spans_.push_back({.first_frame = touch.sequence, .from_s = time_s});
    peak_ = -std::numeric_limits<double>::infinity();
  }
  touching_ = true;
  TouchSpan& span = spans_.back();
  span.last_frame = touch.sequence;
  span.to_s = time_s;
  ++span.frames;
  const double peak = has_value(touch.force_N) ? touch.force_N.value
                      : touch.surface          ? touch.surface->depth_max_mm
                                               : static_cast<double>(touch.area_px);
  if (peak > peak_) {
    peak_ = peak;
    span.peak_frame = touch.sequence;
    span.peak_source = source;
    if (has_value(touch.force_N)) span.force_N = touch.force_N;
  }
  if (touch.surface && (!span.surface || touch.surface->depth_max_mm > span.surface->depth_max_mm))
    span.surface = touch.surface;
  span.largest_area_px = std::max(span.largest_area_px, touch.area_px);
  span.largest_area_mm2 = std::max(span.largest_area_mm2, touch.area_mm2);
  span.most_contacts = std::max<uint64_t>(span.most_contacts, touch.contacts.size());
  span.slip_frames += touch.slip == Slip::Slip;
  span.saturated_frames += touch.saturated_px > 0;
}

std::string TouchTable::csv(MeasuredColumns columns) const {
  std::string text = header(columns) + "\n";
  for (size_t i = 0; i < spans_.size(); ++i) text += row(spans_[i], i + 1, columns) + "\n";
  return text;
}

}  // namespace palpate
