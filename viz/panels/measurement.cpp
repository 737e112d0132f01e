#include "viz/panels/measurement.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "capture/files/measurements.h"
#include "viz/panels/charts/charts.h"
#include "viz/panels/press.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

/// A label, and what it is.
struct Row {
  const char* label;
  std::string words;
  Meaning meaning = Meaning::Plain;
};
using Rows = std::vector<Row>;

/// As close to each other as the room needs, and in smaller letters where even so they do not fit.
void draw_rows(const Rows& rows) {
  if (rows.empty()) return;
  constexpr float kSmallest = 0.8f;  // of the letters; what then has no room is scrolled to
  const ImVec2 padding = ImGui::GetStyle().CellPadding;
  const float room = ImGui::GetContentRegionAvail().y / static_cast<float>(rows.size());
  if (room < ImGui::GetTextLineHeight())
    ImGui::SetWindowFontScale(std::max(room / ImGui::GetTextLineHeight(), kSmallest));
  const float spare = std::floor((room - ImGui::GetTextLineHeight()) / 2);
  ImGui::PushStyleVar(ImGuiStyleVar_CellPadding, {padding.x, std::clamp(spare, 0.0f, padding.y)});
  if (ImGui::BeginTable("values", 2, ImGuiTableFlags_SizingStretchProp)) {
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, 0.36f);
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, 0.64f);
    for (const Row& row : rows) {
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      ImGui::TextDisabled("%s", row.label);
      ImGui::TableNextColumn();
      const float slack = ImGui::GetContentRegionAvail().x - ImGui::CalcTextSize(row.words.c_str()).x;
      if (slack > 0) ImGui::SetCursorPosX(ImGui::GetCursorPosX() + slack);
      // In a narrow panel nothing is cut off.
      wrapped_text(row.words, tint(theme().of(row.meaning)));
    }
    ImGui::EndTable();
  }
  ImGui::PopStyleVar();
  ImGui::SetWindowFontScale(1);
}

std::string percentiles_text(const Percentiles& p) {
  if (p.count == 0) return "-";
  return text("%.1f / %.1f / %.1f ms", p.p50_ms, p.p95_ms, p.p99_ms);
}

unsigned long long whole(uint64_t value) {
  return value;
}

/// The first quantity that is calibrated, in large figures.
struct Headline {
  std::string value, beside;
  bool known = true;
};

Headline headline(const Touch& t, bool scaled) {
  if (!t.contact) {
    const bool unknown = t.light && t.light->state == LightState::Unknown;
    return {unknown ? "not known" : "no contact", "", false};
  }
  if (has_value(t.force_N))
    return {text("%.3f N", t.force_N.value), text("\xc2\xb1 %.3f N", t.force_N.standard_error)};
  if (t.traction && has_value(t.traction->fz_N)) {
    const Estimate& force = t.traction->fz_N;
    return {text("%.2f N", force.value), text("\xc2\xb1 %.2f N by the layer", force.standard_error)};
  }
  if (t.surface) {
    const SurfaceSummary& s = *t.surface;
    return {text("%.3f mm", s.depth_max_mm),
            s.depth_sd_mm > 0 ? text("\xc2\xb1 %.3f mm deep", s.depth_sd_mm) : "deep"};
  }
  if (scaled) return {text("%.2f mm\xc2\xb2", t.area_mm2), "of contact"};
  return {text("%llu px", whole(t.area_px)), "of contact"};
}

/// State of the headline. At rest, which the headline says, the state that a touch would have.
std::pair<std::string, Verdict> state_of(const Touch& shown, const Sensor& sensor) {
  const bool by_layer = !has_value(shown.force_N) && shown.traction && has_value(shown.traction->fz_N);
  const bool by_depth = !by_layer && !has_value(shown.force_N) && shown.surface;
  Verdict verdict = force_verdict(by_layer ? shown.traction->fz_N.validity : shown.force_N.validity);
  if (by_layer && shown.traction->fz_N.validity == Validity::Valid)
    verdict.words = "normal force, by the layer's elasticity";  // which no calibrated range bounds
  if (by_depth && shown.surface->validity != Validity::Valid &&
      (shown.contact || shown.surface->validity == Validity::LightUnknown)) {
    verdict = force_verdict(shown.surface->validity);
    if (shown.surface->validity != Validity::LightUnknown) verdict.words = to_string(shown.surface->validity);
    return {verdict.words, verdict};
  }
  if (shown.contact || !sensor.force) return {verdict.words, verdict};
  if (!sensor.force->fit_for_use) verdict = force_verdict(Validity::Unfit);
  if (!sensor.force->fit_for_use) return {verdict.words, verdict};
  const ForceRange range = calibrated_range(*sensor.force);
  return {text("force calibrated from %.2g to %.3g N", range.least_N, range.most_N),
          force_verdict(Validity::NoContact)};
}

/// The first known quantity, with its uncertainty and state.
void headline_lines(HudFrame& frame, const Touch& shown, const Tare& tare, const Sensor& sensor) {
  const float scale = frame.scale();
  const auto [state, verdict] = state_of(shown, sensor);
  const Headline first = headline(shown, has_scale(sensor));
  ImGui::PushFont(frame.large());
  first.known ? ImGui::TextUnformatted(first.value.c_str()) : ImGui::TextDisabled("%s", first.value.c_str());
  ImGui::PopFont();
  const ImVec2 high = ImGui::GetItemRectMax();
  const auto beside = [&](const std::string& words, Rgb colour, float lines_up) {
    ImGui::GetWindowDrawList()->AddText(
        {high.x + 8 * scale, high.y - (1 + lines_up) * ImGui::GetFontSize() - 3 * scale}, ink(colour),
        words.c_str());
  };
  beside(first.beside, theme().faint, 0);
  if (tare.on) beside("TARED (Shift+Z ends)", theme().doubtful, 1);
  wrapped_text(state, tint(theme().of(verdict.meaning)));
}

/// State of a contact, as short as its column.
const char* slip_word(Slip slip) {
  switch (slip) {
    case Slip::NotCalibrated:
      return "-";
    case Slip::Incipient:
      return "rim slips";
    default:
      return to_string(slip);
  }
}

void contact_table(const Touch& touch, const Tare& tare, bool scaled) {
  constexpr size_t kMost = 3;
  // The largest, in the order of their numbers.
  std::vector<const ContactTouch*> listed;
  for (const ContactTouch& c : touch.contacts) listed.push_back(&c);
  if (listed.size() > kMost) {
    std::nth_element(listed.begin(), listed.begin() + kMost, listed.end(),
                     [](const ContactTouch* a, const ContactTouch* b) { return a->area_px > b->area_px; });
    listed.resize(kMost);
    std::sort(listed.begin(), listed.end(),
              [](const ContactTouch* a, const ContactTouch* b) { return a->id < b->id; });
  }
  if (!ImGui::BeginTable("contacts", 4, ImGuiTableFlags_SizingStretchProp | ImGuiTableFlags_RowBg)) return;
  for (const float fraction : {0.16f, 0.34f, 0.23f, 0.27f})
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, fraction);
  for (const char* title : {"contact", tare.on ? "force [N], tared" : "force [N]",
                            scaled ? "area [mm\xc2\xb2]" : "area [px]", "state"}) {
    ImGui::TableNextColumn();
    ImGui::TextDisabled("%s", title);
  }
  for (const ContactTouch* contact : listed) {
    const ContactTouch& c = *contact;
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    ImGui::Text("%u", c.id);
    ImGui::TableNextColumn();
    if (c.force_N.validity == Validity::NotCalibrated)
      ImGui::TextDisabled("-");
    else
      ImGui::Text("%.3f \xc2\xb1 %.3f", c.force_N.value, c.force_N.standard_error);
    ImGui::TableNextColumn();
    if (scaled)
      ImGui::Text("%.2f", c.area_mm2);
    else
      ImGui::Text("%llu", whole(c.area_px));
    ImGui::TableNextColumn();
    const bool doubtful =
        c.force_N.validity != Validity::Valid && c.force_N.validity != Validity::NotCalibrated;
    if (saturation_matters(c, touch))
      ImGui::TextUnformatted("saturated");
    else if (c.at_border)
      ImGui::TextUnformatted("at border");
    else if (doubtful)
      ImGui::TextUnformatted(to_string(c.force_N.validity));
    else
      ImGui::TextUnformatted(slip_word(c.slip));
  }
  ImGui::EndTable();
  if (touch.contacts.size() > kMost)
    ImGui::TextDisabled("and %llu more, smaller", whole(touch.contacts.size() - kMost));
}

using Groups = MeasuredColumns;
// From what was asked for beyond touching to what is always there.
constexpr uint32_t kShearing = Groups::Shear | Groups::Slipping;
constexpr uint32_t kSections[] = {Groups::Traction,
                                  kShearing,
                                  Groups::Skin,
                                  Groups::Depth,
                                  Groups::Light,
                                  Groups::Dented | Groups::Extrapolated | Groups::Contacts,
                                  Groups::kOfTouch & ~kShearing,
                                  Groups::Confidence | Groups::Weighted};

std::string unit_text(const MeasuredQuantity<Touch>& q) {
  const std::string unit = *q.row.unit ? q.row.unit : q.unit;
  if (unit.empty()) return "";
  if (unit == "mm2") return " mm\xc2\xb2";
  if (unit == "mm3") return " mm\xc2\xb3";
  return " " + unit;
}

/// Without its unit; "-" where there is none.
std::string number_text(const MeasuredQuantity<Touch>& q, const QuantityValue& value, bool with_error) {
  if (const auto* word = std::get_if<std::string_view>(&value)) return std::string(*word);
  if (const auto* count = std::get_if<uint64_t>(&value)) return text("%llu", whole(*count));
  if (const bool* flag = std::get_if<bool>(&value)) return *flag ? "yes" : "no";
  const Estimate* estimate = shown_estimate(q, value);
  const double* plain = std::get_if<double>(&value);
  if (!estimate && !(plain && std::isfinite(*plain))) return "-";
  const double number = q.row.per_unit * (estimate ? estimate->value : *plain);
  std::string shown = text(q.row.sign ? "%+.*f" : "%.*f", q.row.places, number);
  if (estimate && with_error)
    shown += text(" \xc2\xb1 %.*f", q.row.places, q.row.per_unit * estimate->standard_error);
  return shown;
}

bool says_nothing(const QuantityValue& value) {
  const auto* word = std::get_if<std::string_view>(&value);
  const bool* flag = std::get_if<bool>(&value);
  const auto* count = std::get_if<uint64_t>(&value);
  const auto* number = std::get_if<double>(&value);
  return (word && (*word == "valid" || *word == "steady")) || (flag && !*flag) || (count && *count == 0) ||
         (number && *number == 0);
}

/// The deepest point, or, where nothing touches, how uneven the surface is.
Rows depth_rows(const Touch& t) {
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
std::optional<Row> quantity_row(std::vector<const MeasuredQuantity<Touch>*> parts, const Touch& t,
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
  Row row{first.row.label, some ? words + unit_text(first) : "-"};
  mark(first.name, t, content, state, row.words, row.meaning);
  return row;
}

/// Rows of what this sensor and its outputs measure.
Rows quantity_rows(const Touch& t, const HudContent& content, const ViewState& state) {
  Rows all;
  MeasuredColumns columns = MeasuredColumns::of(content.sensor, Output::Force, content.separate);
  columns.groups &= Groups::kOfTouch;
  if (t.skin && !content.separate) columns.groups |= Groups::Slipping;
  // Other quantities are there where the touch has them; of a layer where something presses it.
  const auto is_there = [&](const MeasuredQuantity<Touch>& q, uint32_t group) {
    if (group & Groups::kOfTouch) return (group & columns.groups) != 0;
    if (group == Groups::Traction && !(t.traction && has_value(t.traction->fz_N))) return false;
    if (group == Groups::Depth && !content.has_surface) return false;
    if (group == Groups::Contacts) return t.regions.has_value();
    return !std::holds_alternative<std::monostate>(q.value(t));
  };
  for (const uint32_t section : kSections) {
    std::vector<std::vector<const MeasuredQuantity<Touch>*>> rows;
    uint32_t group = 0;  // one without a column goes with the one before
    for (const MeasuredQuantity<Touch>& q : touch_quantities()) {
      if (q.group) group = q.group;
      if (!(group & section) || !*q.row.label || !is_there(q, group)) continue;
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
    for (const auto& parts : rows) {
      if (parts.front()->name == std::string_view("depth_max_mm"))
        for (Row& row : depth_rows(t)) all.push_back(std::move(row));
      else if (std::optional<Row> row = quantity_row(parts, t, content, state))
        all.push_back(std::move(*row));
    }
  }
  return all;
}

}  // namespace

void measurement_panel(HudFrame& frame, const Layout& layout, const HudContent& content, const Touch& t,
                       const ViewState& state) {
  const float scale = frame.scale();
  const Tare& tare = state.tare;
  const bool scaled = has_scale(content.sensor);
  ImGui::SetNextWindowPos(corner(layout.panel));
  ImGui::SetNextWindowSize(size_of(layout.panel));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
  // Scrolls where the numbers have no room.
  ImGui::Begin("measurements", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoBringToFrontOnFocus |
                   ImGuiWindowFlags_NoNav | (frame.has_window() ? 0 : ImGuiWindowFlags_NoScrollbar));
  ImGui::PopStyleVar();
  const std::string format = text("%u x %u px", content.frame.format.width, content.frame.format.height);
  const float format_width = ImGui::CalcTextSize(format.c_str()).x;
  const std::string name = content.sensor.name.empty() ? "unnamed sensor" : content.sensor.name;
  ImGui::TextUnformatted(
      shortened(name, ImGui::GetContentRegionAvail().x - format_width - 12 * scale).c_str());
  ImGui::SameLine(ImGui::GetWindowWidth() - format_width - 14 * scale);
  ImGui::TextDisabled("%s", format.c_str());
  if (content.has_surface) {
    // The image stays where it is while the numbers scroll.
    ImGui::SetCursorPosY(far_corner(layout.image).y + 6 * scale);
    ImGui::BeginChild("numbers", {0, 0}, false,
                      ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoNav |
                          (frame.has_window() ? 0 : ImGuiWindowFlags_NoScrollbar));
  }
  headline_lines(frame, t, tare, content.sensor);
  if (content.live && content.live->press)
    press_lines(*content.live->press, 1e-9 * static_cast<double>(t.time_ns));
  if (t.regions && t.contacts.size() > 1) contact_table(t, tare, scaled);
  Rows rows = quantity_rows(t, content, state);
  if (state.rates && content.live && content.live->to_measured.count > 0) {
    rows.push_back({"latency", "50 / 95 / 99 %"});
    rows.push_back({"to measured", percentiles_text(content.live->to_measured)});
    rows.push_back({"to shown", percentiles_text(content.live->to_shown)});
  }
  draw_rows(rows);
  if (content.has_surface) ImGui::EndChild();
  ImGui::End();
}

}  // namespace palpate::viz
