#include "viz/panels/numbers/quantity_rows.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "capture/files/measurements.h"
#include "viz/panels/numbers/quantity_words.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

using Groups = MeasuredColumns;
bool says_nothing(const QuantityValue& value) {
  const auto* word = std::get_if<std::string_view>(&value);
  const bool* flag = std::get_if<bool>(&value);
  const auto* count = std::get_if<uint64_t>(&value);
  const auto* number = std::get_if<double>(&value);
  return (word && (*word == "valid" || *word == "steady" || *word == "none")) || (flag && !*flag) ||
         (count && *count == 0) || (number && *number == 0);
}

/// The deepest point, or, where nothing touches, how uneven the surface is.
CardRows depth_rows(const Touch& t) {
  const SurfaceSummary& s = *t.surface;
  if (t.picture != PictureFault::None) return {{"deepest", "-"}};
  // Whatever the sensor: a gel that creeps back, or a pad's noise.
  if (!t.contact && s.validity != Validity::LightUnknown)
    return {{"deepest", "-"}, {"surface at rest", text("uneven by %.3f mm", s.depth_max_mm)}};
  const bool doubtful = s.validity != Validity::Valid && s.validity != Validity::NoContact &&
                        s.validity != Validity::NotCalibrated;
  if (!doubtful) return {{"deepest", depth_text(s)}};
  return {{"deepest", depth_text(s), force_verdict(s.validity).meaning}};
}

/// One system of coordinates: from the middle, x to the right, y downwards, as the axes of the surface have
/// it.
std::string centre_text(const Touch& t, const HudContent& content) {
  const FrameFormat& f = content.frame.format;
  const double pitch = content.sensor.pitch_mm_per_px;
  return text("%+.2f, %+.2f mm", (t.centroid_x_px - 0.5 * (f.width - 1)) * pitch,
              (t.centroid_y_px - 0.5 * (f.height - 1)) * pitch);
}

/// Where a row shows other words than its number, or in a colour.
void mark(std::string_view name, const Touch& t, const HudContent& content, const ViewState& state,
          std::string& words, Meaning& meaning) {
  if (name == "slip") {
    words = t.slip == Slip::NoContact ? "-" : slip_verdict(t.slip).words;
    meaning = slip_verdict(t.slip).meaning;
  } else if (name == "saturated_px" && saturation_matters(t)) {
    meaning = force_verdict(Validity::Saturated).meaning;
  } else if (name == "wrench_state") {
    meaning = force_verdict(t.traction->fz_N.validity).meaning;
  } else if (name == "light_state" && t.light->state == LightState::Unknown) {
    meaning = force_verdict(Validity::LightUnknown).meaning;
  } else if (name == "centroid_x_px" && has_scale(content.sensor) && !state.pixels && words != "-") {
    words = centre_text(t, content);
  }
}

/// The quantities of one label, as one row; nothing where it would say nothing.
std::optional<CardRow> quantity_row(std::vector<const MeasuredQuantity<Touch>*> parts, const Touch& t,
                                    const HudContent& content, const ViewState& state) {
  // Millimetres rather than pixels, where there are both.
  std::erase_if(parts,
                [last = std::string_view(parts.back()->unit)](const auto* q) { return q->unit != last; });
  const MeasuredQuantity<Touch>& first = *parts.front();
  std::string words;
  bool some = false;
  for (const MeasuredQuantity<Touch>* q : parts) {
    const bool there = !q->in_table || q->in_table(t);
    if (!there && (t.contacts.size() > 1 || first.row.only_if_some)) return {};  // each contact has its own
    const QuantityValue value = there ? q->value(t) : QuantityValue{};
    if (first.row.only_if_some && says_nothing(value)) return {};
    const std::string part = number_text(*q, value, parts.size() == 1);
    some |= part != "-";
    words += (words.empty() ? "" : ", ") + part;
  }
  CardRow row{first.row.label, some ? words + unit_text(first) : "-"};
  mark(first.name, t, content, state, row.words, row.meaning);
  return row;
}

/// False of shear that no force limits, and of slip that nothing shows: this sensor never has them.
bool can_have(const MeasuredQuantity<Touch>& q, const Sensor& sensor, bool skin) {
  const bool limited = sensor.shear && sensor.force;
  if (q.group == Groups::Shear) return limited;
  return q.group != Groups::Slipping || limited || skin;
}

}  // namespace

CardRows quantity_rows(const Touch& t, const HudContent& content, const ViewState& state, uint32_t groups) {
  MeasuredColumns columns = MeasuredColumns::of(content.sensor, Output::Force, content.separate);
  columns.groups &= Groups::kOfTouch;
  if (t.skin && !content.separate) columns.groups |= Groups::Slipping;
  // Other quantities are there where the touch has them; of a layer where something presses it.
  const auto is_there = [&](const MeasuredQuantity<Touch>& q, uint32_t group) {
    if (group & Groups::kOfTouch)
      return (group & columns.groups) != 0 && can_have(q, content.sensor, t.skin.has_value());
    if (group == Groups::Traction && !(t.traction && has_value(t.traction->fz_N))) return false;
    if (group == Groups::Depth && !content.has_surface) return false;
    if (group == Groups::Contacts) return t.regions.has_value();
    return !std::holds_alternative<std::monostate>(q.value(t));
  };
  std::vector<std::vector<const MeasuredQuantity<Touch>*>> rows;
  uint32_t group = 0;  // one without a column goes with the one before
  for (const MeasuredQuantity<Touch>& q : touch_quantities()) {
    if (q.group) group = q.group;
    if (!(group & groups) || !*q.row.label || !is_there(q, group)) continue;
    const auto same = std::ranges::find_if(
        rows, [&](const auto& row) { return std::string_view(row.front()->row.label) == q.row.label; });
    std::vector<const MeasuredQuantity<Touch>*> parts;
    if (same != rows.end()) {  // a row stands where its last part does
      parts = std::move(*same);
      rows.erase(same);
    }
    parts.push_back(&q);
    rows.push_back(std::move(parts));
  }
  CardRows all;
  for (const auto& parts : rows) {
    if (parts.front()->name == std::string_view("depth_max_mm"))
      std::ranges::move(depth_rows(t), std::back_inserter(all));
    else if (std::optional<CardRow> row = quantity_row(parts, t, content, state))
      all.push_back(std::move(*row));
  }
  return all;
}

}  // namespace palpate::viz
