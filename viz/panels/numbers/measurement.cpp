#include "viz/panels/numbers/measurement.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/files/measurements.h"
#include "viz/look/measures.h"
#include "viz/panels/charts/charts.h"
#include "viz/panels/numbers/cards.h"
#include "viz/panels/numbers/gauges.h"
#include "viz/panels/numbers/hand_scan.h"
#include "viz/panels/numbers/press.h"
#include "viz/panels/numbers/quantity_rows.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

using Groups = MeasuredColumns;
constexpr uint32_t kShear = Groups::Shear | Groups::Slipping;
constexpr uint32_t kMotion = Groups::ShiftMillimetres | Groups::ShiftPixels | Groups::Skin;
constexpr uint32_t kContact = (Groups::kOfTouch & ~kShear & ~kMotion) | Groups::Contacts | Groups::Dented;
constexpr uint32_t kSurface =
    Groups::Depth | Groups::Extrapolated | Groups::Light | Groups::Confidence | Groups::Weighted;

unsigned long long whole(uint64_t value) {
  return value;
}

/// The first quantity that is known, in large figures.
struct Headline {
  const char* title;
  std::string value, error;
  bool known = true;
};

/// What is measured of this touch, or, where nothing touches, would be.
Headline headline(const Touch& t, const Sensor& sensor) {
  const bool by_layer = t.traction && has_value(t.traction->fz_N);
  if (!t.contact) {
    const bool unknown = t.light && t.light->state == LightState::Unknown;
    return {sensor.force || sensor.layer ? "force"
            : t.surface                  ? "depth"
                                         : "contact",
            unknown ? "not known" : "no contact", "", false};
  }
  if (has_value(t.force_N))
    return {"force", text("%.3f N", t.force_N.value), text("\xc2\xb1 %.3f N", t.force_N.standard_error)};
  if (by_layer) {
    const Estimate& force = t.traction->fz_N;
    return {"force", text("%.2f N", force.value), text("\xc2\xb1 %.2f N by the layer", force.standard_error)};
  }
  if (t.surface) {
    const SurfaceSummary& s = *t.surface;
    return {"depth", text("%.3f mm", s.depth_max_mm),
            s.depth_sd_mm > 0 ? text("\xc2\xb1 %.3f mm deep", s.depth_sd_mm) : "deep"};
  }
  if (has_scale(sensor)) return {"contact", text("%.2f mm\xc2\xb2", t.area_mm2), "of contact"};
  return {"contact", text("%llu px", whole(t.area_px)), "of contact"};
}

/// Why the headline may be wrong; at rest, why that of a touch would be. Nothing where it is valid.
std::optional<CardRow> state_row(const Touch& t, const Sensor& sensor) {
  const bool by_layer = !has_value(t.force_N) && t.traction && has_value(t.traction->fz_N);
  const bool by_depth = !by_layer && !has_value(t.force_N) && t.surface &&
                        t.surface->validity != Validity::Valid &&
                        (t.contact || t.surface->validity == Validity::LightUnknown);
  Validity state = by_layer ? t.traction->fz_N.validity : by_depth ? t.surface->validity : t.force_N.validity;
  if (!t.contact && !by_depth && sensor.force && !sensor.force->fit_for_use) state = Validity::Unfit;
  const bool absent = state == Validity::NotCalibrated && !sensor.force;
  if (state == Validity::Valid || state == Validity::NoContact || absent) return {};
  const Verdict verdict = force_verdict(state);
  const bool of_depth = by_depth && state != Validity::LightUnknown;
  return CardRow{"", of_depth ? to_string(state) : verdict.words, verdict.meaning};
}

/// The headline with its error and its zero at its right, in one rectangle; what has no room becomes a row.
Card force_card(const HudFrame& frame, const Touch& t, const HudContent& content, const ViewState& state,
                float width) {
  const float scale = frame.scale();
  const Sensor& sensor = content.sensor;
  const Headline first = headline(t, sensor);
  Card card{.title = first.title, .above_px = kHeadline_px};
  ImGui::PushFont(frame.large());
  const float figures = ImGui::CalcTextSize(first.value.c_str()).x;
  ImGui::PopFont();
  const std::string zero = state.tare.on ? "TARED (Shift+Z ends)" : "";
  const float beside =
      std::max(ImGui::CalcTextSize(first.error.c_str()).x, ImGui::CalcTextSize(zero.c_str()).x);
  const bool room = figures + beside + 4 * kGrid_px * scale <= width;
  if (!room && !first.error.empty()) card.rows.push_back({"", first.error, Meaning::Explains});
  if (!room && !zero.empty()) card.rows.push_back({"", zero, Meaning::Doubtful});
  if (std::optional<CardRow> doubt = state_row(t, sensor)) card.rows.push_back(std::move(*doubt));
  std::optional<ForceRange> range;
  if (sensor.force && sensor.force->fit_for_use) {
    range = calibrated_range(*sensor.force);
    card.above_px += 1.5f * kGrid_px;
    card.rows.push_back(
        {"calibrated", text("%.2g to %.3g N", range->least_N, range->most_N), Meaning::Explains});
  }
  // As measured, since the range is of what is measured.
  const Touch& measured = content.touch;
  card.draw = [&frame, &measured, first, zero, room, range, scale](ImVec2 low, ImVec2 high) {
    ImGui::SetCursorScreenPos(low);
    ImGui::PushFont(frame.large());
    first.known ? ImGui::TextUnformatted(first.value.c_str())
                : ImGui::TextDisabled("%s", first.value.c_str());
    ImGui::PopFont();
    const ImVec2 end = ImGui::GetItemRectMax();
    const float row = ImGui::GetFontSize(), foot = low.y + (kHeadline_px - 3) * scale;
    ImDrawList* list = ImGui::GetWindowDrawList();
    if (room) {
      list->AddText({end.x + kGrid_px * scale, foot - row}, ink(theme().faint), first.error.c_str());
      list->AddText({end.x + kGrid_px * scale, foot - 2 * row}, ink(theme().doubtful), zero.c_str());
    }
    if (!range) return;
    const bool forced = measured.contact && has_value(measured.force_N);
    draw_force_bar(list, {low.x, high.y - kGrid_px * scale}, high, *range,
                   forced ? std::optional(measured.force_N) : std::nullopt, scale);
  };
  return card;
}

/// By calibration, else by the elastic layer; without a friction, or a force that it limits, without a dial.
Card shear_card(const Touch& t, const Sensor& sensor, const ViewState& state, float scale) {
  Card card{.title = "shear"};
  if (!sensor.shear || !(sensor.force || (t.traction && sensor.skin))) return card;
  const bool by_layer = !has_value(t.shear_x_N) && t.traction && has_value(t.traction->fx_N);
  const Estimate x = by_layer ? t.traction->fx_N : t.shear_x_N, y = by_layer ? t.traction->fy_N : t.shear_y_N;
  const Estimate& normal = by_layer ? t.traction->fz_N : t.force_N;
  const double limit_N =
      !state.tare.on && has_value(normal) ? sensor.shear->friction * std::max(normal.value, 0.0) : 0;
  if (limit_N > 0 && has_value(x) && has_value(y))
    card.aside = text("%.0f %% of the friction limit", 100 * std::hypot(x.value, y.value) / limit_N);
  card.beside_px = 8 * kGrid_px;
  card.draw = [x, y, limit_N, slip = t.slip, scale](ImVec2 low, ImVec2 high) {
    draw_shear_dial(ImGui::GetWindowDrawList(), low, high, x, y, limit_N, slip, scale);
  };
  return card;
}

/// The largest contacts, in the order of their numbers.
CardRows contact_rows(const Touch& touch, bool scaled) {
  constexpr size_t kMost = 3;
  std::vector<const ContactTouch*> listed;
  for (const ContactTouch& c : touch.contacts) listed.push_back(&c);
  if (listed.size() > kMost) {
    std::nth_element(listed.begin(), listed.begin() + kMost, listed.end(),
                     [](const ContactTouch* a, const ContactTouch* b) { return a->area_px > b->area_px; });
    listed.resize(kMost);
    std::sort(listed.begin(), listed.end(),
              [](const ContactTouch* a, const ContactTouch* b) { return a->id < b->id; });
  }
  CardRows rows;
  for (const ContactTouch* contact : listed) {
    const ContactTouch& c = *contact;
    const bool calibrated = c.force_N.validity != Validity::NotCalibrated;
    std::string words =
        calibrated ? text("%.3f \xc2\xb1 %.3f N, ", c.force_N.value, c.force_N.standard_error) : "";
    words += scaled ? text("%.2f mm\xc2\xb2", c.area_mm2) : text("%llu px", whole(c.area_px));
    const bool doubtful = calibrated && c.force_N.validity != Validity::Valid;
    if (saturation_matters(c, touch))
      words += ", saturated";
    else if (c.at_border)
      words += ", at border";
    else if (doubtful)
      words += std::string(", ") + to_string(c.force_N.validity);
    else if (c.slip != Slip::NotCalibrated)
      words += std::string(", ") + (c.slip == Slip::Incipient ? "rim slips" : to_string(c.slip));
    rows.push_back({text("%u", c.id), std::move(words), doubtful ? Meaning::Doubtful : Meaning::Plain});
  }
  if (touch.contacts.size() > kMost)
    rows.push_back(
        {"", text("and %llu more, smaller", whole(touch.contacts.size() - kMost)), Meaning::Explains});
  return rows;
}

/// What this sensor has, from what was asked for beyond touching to what is always there.
std::vector<Card> cards_of(const HudFrame& frame, const Touch& t, const HudContent& content,
                           const ViewState& state, float width) {
  std::vector<Card> cards{force_card(frame, t, content, state, width)};
  std::ranges::move(quantity_rows(t, content, state, Groups::Traction), std::back_inserter(cards[0].rows));
  if (content.live && content.live->press) {
    Card tissue{.title = "tissue", .beside_px = 8 * kGrid_px};
    tissue.draw = [tilt = content.live->press->tilt, scale = frame.scale()](ImVec2 low, ImVec2 high) {
      draw_level(ImGui::GetWindowDrawList(), low, high, tilt, scale);
    };
    const bool by_hand = content.live->scan.has_value();
    std::vector<PressRow> rows =
        press_rows(*content.live->press, 1e-9 * static_cast<double>(t.time_ns), by_hand);
    if (by_hand) std::ranges::move(scan_rows(*content.live->scan), std::back_inserter(rows));
    for (PressRow& row : rows)
      tissue.rows.push_back({std::move(row.name), std::move(row.value), row.meaning});
    cards.push_back(std::move(tissue));
  }
  const auto add = [&](Card card, uint32_t groups) {
    std::ranges::move(quantity_rows(t, content, state, groups), std::back_inserter(card.rows));
    if (!card.rows.empty() || card.draw) cards.push_back(std::move(card));
  };
  add(shear_card(t, content.sensor, state, frame.scale()), kShear);
  Card contact{.title = "contact"};
  if (t.regions && t.contacts.size() > 1) {
    contact.aside = state.tare.on ? "force of each, tared" : "";
    contact.rows = contact_rows(t, has_scale(content.sensor));
  }
  add(std::move(contact), kContact);
  add({.title = "surface"}, kSurface);
  add({.title = "motion"}, kMotion);
  add({.title = "object"}, Groups::Object);
  return cards;
}

}  // namespace

void measurement_panel(HudFrame& frame, const Layout& layout, const HudContent& content, const Touch& t,
                       const ViewState& state) {
  const float scale = frame.scale();
  begin_panel("measurements", layout.panel, scale);
  const std::string format = text("%u x %u px", content.frame.format.width, content.frame.format.height);
  const float format_width = ImGui::CalcTextSize(format.c_str()).x;
  const std::string name = content.sensor.name.empty() ? "unnamed sensor" : content.sensor.name;
  ImGui::TextUnformatted(
      shortened(name, ImGui::GetContentRegionAvail().x - format_width - 12 * scale).c_str());
  ImGui::SameLine(ImGui::GetWindowWidth() - format_width - kGrid_px * scale);
  ImGui::TextDisabled("%s", format.c_str());
  // The small picture stays where it is while the numbers scroll.
  ImGui::SetCursorPosY(static_cast<float>(layout.numbers_y));
  ImGui::BeginChild("numbers", {0, 0}, false,
                    ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoNav |
                        (frame.has_window() ? 0 : ImGuiWindowFlags_NoScrollbar));
  draw_cards(frame, cards_of(frame, t, content, state, ImGui::GetContentRegionAvail().x));
  ImGui::EndChild();
  ImGui::End();
}

}  // namespace palpate::viz
