#include "capture/run/process/touch_table.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/files/tables/csv_table.h"
#include "capture/run/largest.h"
#include "palpate/pipeline.h"

namespace palpate {
namespace {

std::string value_text(double value, double error, int places) {
  return with_places(value, error > 0 ? deserved_places(error) : places);
}

std::string error_text(double error) {
  return error > 0 && std::isfinite(error) ? with_places(error, deserved_places(error)) : "";
}

using Columns = MeasuredColumns;

/// Cells that are there or not together.
struct Cells {
  uint32_t group;
  std::string names;
  std::string values;
};

/// All that a row can have, in the columns' order.
std::vector<Cells> cells_of(const TouchSpan& span, size_t number) {
  const Estimate force = span.force_N.value_or(Estimate{});
  const std::string force_text = span.force_N
                                     ? value_text(force.value, force.standard_error, kForcePlaces) + "," +
                                           error_text(force.standard_error) + "," + to_string(force.validity)
                                     : ",,";
  const SurfaceSummary surface = span.surface.value_or(SurfaceSummary{});
  const LargestNames force_names = largest_names("force_N"), depth_names = largest_names("depth_max_mm");
  return {{Columns::Frame, "touch,first_frame,last_frame,frames",
           std::to_string(number) + "," + std::to_string(span.first_frame) + "," +
               std::to_string(span.last_frame) + "," + std::to_string(span.frames)},
          {Columns::Time, "from_s,to_s",
           with_places(span.from_s, kTimePlaces) + "," + with_places(span.to_s, kTimePlaces)},
          {Columns::Frame, "peak_frame", std::to_string(span.peak_frame)},
          {Columns::Source, "source", csv_cell(span.peak_source)},
          {Columns::Force, "largest_" + force_names.value + "," + force_names.error + "," + force_names.state,
           force_text},
          {Columns::Depth, "largest_" + depth_names.value,
           span.surface ? value_text(surface.depth_max_mm, surface.depth_sd_mm, kLengthPlaces) : ""},
          {Columns::DepthError, depth_names.error, error_text(surface.depth_sd_mm)},
          {Columns::Depth, depth_names.state, span.surface ? to_string(surface.validity) : ""},
          {Columns::Touching, "largest_area_px", std::to_string(span.largest_area_px)},
          {Columns::Millimetres, "largest_area_mm2", with_places(span.largest_area_mm2, kLengthPlaces)},
          {Columns::Contacts, "most_contacts", std::to_string(span.most_contacts)},
          {Columns::Slipping, "slip_frames", std::to_string(span.slip_frames)},
          {Columns::Touching, "saturated_frames", std::to_string(span.saturated_frames)}};
}

}  // namespace

void TouchTable::add(const Touch& touch, const std::string& source) {
  if (touch.picture != PictureFault::None) return;  // a touch goes on across it
  if (!touch.contact) {
    touching_ = false;
    return;
  }
  const double time_s = 1e-9 * static_cast<double>(touch.time_ns);
  if (!touching_ || separate_) {
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
  const auto line = [columns](const std::vector<Cells>& cells, const auto& text_of) {
    std::string joined;
    for (const Cells& one : cells)
      if (columns.groups & one.group) joined += (joined.empty() ? "" : ",") + std::string(text_of(one));
    return joined + "\n";
  };
  std::string text = line(cells_of({}, 0), [](const Cells& one) { return one.names; });
  for (size_t i = 0; i < spans_.size(); ++i)
    text += line(cells_of(spans_[i], i + 1), [](const Cells& one) { return one.values; });
  return text;
}

}  // namespace palpate
