#include "viz/panels/measurement.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "capture/files/measurements.h"
#include "viz/panels/charts.h"
#include "viz/panels/press.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

ImVec4 colour(const Verdict& v) {
  return ImGui::ColorConvertU32ToFloat4(IM_COL32(v.red, v.green, v.blue, 255));
}

void row(const char* label, const std::string& value, const ImVec4* tint = nullptr) {
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  ImGui::TextDisabled("%s", label);
  ImGui::TableNextColumn();
  const float slack = ImGui::GetContentRegionAvail().x - ImGui::CalcTextSize(value.c_str()).x;
  if (slack > 0) ImGui::SetCursorPosX(ImGui::GetCursorPosX() + slack);
  if (tint) ImGui::PushStyleColor(ImGuiCol_Text, *tint);
  ImGui::TextWrapped("%s", value.c_str());  // in a narrow panel nothing is cut off
  if (tint) ImGui::PopStyleColor();
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
  if (t.traction && has_value(t.traction->force_z_N)) {
    const Estimate& force = t.traction->force_z_N;
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

/// What the headline is worth. At rest, which the headline says: what a touch would be worth.
std::pair<std::string, Verdict> state_of(const Touch& shown, const Sensor& sensor) {
  const bool by_layer = !has_value(shown.force_N) && shown.traction && has_value(shown.traction->force_z_N);
  const bool by_depth = !by_layer && !has_value(shown.force_N) && shown.surface;
  Verdict verdict = force_verdict(by_layer ? shown.traction->force_z_N.validity : shown.force_N.validity);
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

/// What is known first, with its uncertainty and what it is worth.
void headline_lines(HudFrame& frame, const Touch& shown, const Tare& tare, const Sensor& sensor) {
  const float scale = frame.scale();
  const auto [state, verdict] = state_of(shown, sensor);
  const Headline first = headline(shown, has_scale(sensor));
  ImGui::PushFont(frame.large());
  first.known ? ImGui::TextUnformatted(first.value.c_str()) : ImGui::TextDisabled("%s", first.value.c_str());
  ImGui::PopFont();
  const ImVec2 high = ImGui::GetItemRectMax();
  const auto beside = [&](const std::string& words, ImU32 tint, float lines_up) {
    ImGui::GetWindowDrawList()->AddText(
        {high.x + 8 * scale, high.y - (1 + lines_up) * ImGui::GetFontSize() - 3 * scale}, tint,
        words.c_str());
  };
  beside(first.beside, ImGui::GetColorU32(ImGuiCol_TextDisabled), 0);
  if (tare.on) beside("TARED (Shift+Z ends)", IM_COL32(240, 228, 66, 255), 1);
  ImGui::PushStyleColor(ImGuiCol_Text, colour(verdict));
  ImGui::TextWrapped("%s", state.c_str());
  ImGui::PopStyleColor();
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

/// Where a single contact is, and its shape; of several each has its own.
void shape_rows(const Touch& t, bool scaled, const HudContent& content, bool pixels) {
  const Ellipse& e = t.ellipse;
  row("ellipse", !t.contact ? "-"
                 : scaled   ? text("%.2f x %.2f mm", e.major_mm, e.minor_mm)
                            : text("%.1f x %.1f px", e.major_px, e.minor_px));
  // One system of coordinates: from the middle, x to the right, y downwards, as the axes of the surface have
  // it.
  const FrameFormat& f = content.frame.format;
  const double pitch = content.sensor.pitch_mm_per_px;
  row("centroid", !t.contact ? "-"
                  : scaled && !pixels
                      ? text("%+.2f, %+.2f mm", (t.centroid_x_px - 0.5 * (f.width - 1)) * pitch,
                             (t.centroid_y_px - 0.5 * (f.height - 1)) * pitch)
                      : text("%.2f, %.2f px", t.centroid_x_px, t.centroid_y_px));
  if (content.separate) return;
  row("moved", !t.contact ? "-"
               : scaled   ? text("%+.3f, %+.3f mm", t.shift_x_mm, t.shift_y_mm)
                          : text("%+.1f, %+.1f px", t.shift_x_px, t.shift_y_px));
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

void skin_rows(const SkinMotion& skin) {
  row("skin points", text("%u followed, %u lost", skin.points, skin.lost));
  if (has_value(skin.shift_x_mm))
    row("skin moved", text("%+.3f, %+.3f mm", skin.shift_x_mm.value, skin.shift_y_mm.value));
  if (has_value(skin.torsion_rad))
    row("twist", text("%+.2f \xc2\xb1 %.2f deg", 57.29578 * skin.torsion_rad.value,
                      57.29578 * skin.torsion_rad.standard_error));
  if (has_value(skin.stick_fraction))
    row("still sticks", text("%.0f \xc2\xb1 %.0f %% of radius", 100 * skin.stick_fraction.value,
                             100 * skin.stick_fraction.standard_error));
}

void traction_rows(const TractionSummary& t) {
  if (!has_value(t.force_z_N)) return;
  const auto three = [](const Estimate& x, const Estimate& y, const Estimate& z, const char* unit) {
    const auto one = [](const Estimate& e) {
      return has_value(e) ? text("%.2f", e.value) : std::string("-");
    };
    return one(x) + ", " + one(y) + ", " + one(z) + " " + unit;
  };
  row("force x, y, z", three(t.force_x_N, t.force_y_N, t.force_z_N, "N"));
  row("moment x, y, z", three(t.moment_x_Nmm, t.moment_y_Nmm, t.moment_z_Nmm, "N mm"));
  row("pressure", text("up to %.1f kPa on %.1f mm\xc2\xb2", t.pressure_max_kPa, t.area_mm2));
  if (has_value(t.force_x_N)) row("shear", text("up to %.1f kPa", t.shear_max_kPa));
  if (t.slipping_fraction) row("at friction limit", text("%.0f %% of the area", 100 * *t.slipping_fraction));
  if (t.force_z_N.validity == Validity::Valid) return;
  const ImVec4 tint = colour(force_verdict(t.force_z_N.validity));
  row("wrench", to_string(t.force_z_N.validity), &tint);
}

void light_row(const LightSummary& light) {
  const ImVec4 tint = colour(force_verdict(Validity::Clipped));
  if (light.state == LightState::Unknown) row("light", "unknown", &tint);
  if (light.state == LightState::Changed) row("light changed", text("by %.1f gray", light.change_gray));
}

void surface_rows(const Touch& t) {
  if (!t.surface || t.picture != PictureFault::None) return row("deepest", "-");
  const SurfaceSummary& s = *t.surface;
  if (!t.contact && s.validity != Validity::LightUnknown) {
    row("deepest", "-");
    // Whatever the sensor: a gel that creeps back, or a pad's noise.
    return row("surface at rest", text("uneven by %.3f mm", s.depth_max_mm));
  }
  const bool doubtful = s.validity != Validity::Valid && s.validity != Validity::NoContact &&
                        s.validity != Validity::NotCalibrated;
  const ImVec4 depth_tint = colour(force_verdict(s.validity));
  row("deepest", depth_text(s), doubtful ? &depth_tint : nullptr);
  if (t.contact && s.volume_mm3 > 0) row("volume", text("%.2f mm\xc2\xb3", s.volume_mm3));
  if (s.clipped_px > 0) {
    const ImVec4 tint = colour(force_verdict(Validity::Clipped));
    row("clipped slopes", text("%llu px", whole(s.clipped_px)),
        s.validity == Validity::Clipped ? &tint : nullptr);
  }
}

}  // namespace

void measurement_panel(HudFrame& frame, const Layout& layout, const HudContent& content, const Touch& t,
                       const ViewState& state) {
  const float scale = frame.scale();
  const Tare& tare = state.tare;
  const bool scaled = has_scale(content.sensor);
  const ViewRect& panel = layout.panel;
  ImGui::SetNextWindowPos({static_cast<float>(panel.x), static_cast<float>(panel.y)});
  ImGui::SetNextWindowSize({static_cast<float>(panel.width), static_cast<float>(panel.height)});
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
    ImGui::SetCursorPosY(static_cast<float>(layout.image.y) + static_cast<float>(layout.image.height) +
                         6 * scale);
    ImGui::BeginChild("numbers", {0, 0}, false,
                      ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoNav |
                          (frame.has_window() ? 0 : ImGuiWindowFlags_NoScrollbar));
  }
  headline_lines(frame, t, tare, content.sensor);
  if (content.live && content.live->press)
    press_lines(*content.live->press, 1e-9 * static_cast<double>(t.time_ns));
  if (t.regions && t.contacts.size() > 1) contact_table(t, tare, scaled);
  if (ImGui::BeginTable("values", 2, ImGuiTableFlags_SizingStretchProp)) {
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, 0.36f);
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, 0.64f);
    if (t.traction) traction_rows(*t.traction);
    if (content.sensor.shear && !content.separate) {
      row("shear x", newtons_text(t.shear_x_N));
      row("shear y", newtons_text(t.shear_y_N));
    }
    if ((content.sensor.shear || t.skin) && !content.separate) {
      const ImVec4 slip_tint = colour(slip_verdict(t.slip));
      row("stick or slip", t.slip == Slip::NoContact ? "-" : slip_verdict(t.slip).words, &slip_tint);
    }
    if (t.skin) skin_rows(*t.skin);
    if (content.has_surface) surface_rows(t);
    if (t.light) light_row(*t.light);
    const std::string area =
        scaled ? text("%.2f mm\xc2\xb2", t.area_mm2) : text("%llu px (no scale)", whole(t.area_px));
    row("area in contact", t.contact ? area : "-");
    if (t.contact && t.surface && t.surface->dented_mm2)
      row("area dented", text("%.2f mm\xc2\xb2", *t.surface->dented_mm2));
    if (t.regions)
      row("contacts", text("%llu%s", whole(t.contacts.size()), t.regions->overflow ? ", and more" : ""));
    if (t.contacts.size() < 2) shape_rows(t, scaled, content, state.pixels);
    row("sum, peak", text("%.0f, %.1f gray levels", t.gray_sum, t.peak_gray));
    const ImVec4 red = colour(force_verdict(Validity::Saturated));
    row("saturated", text("%llu px", whole(t.saturated_px)), saturation_matters(t) ? &red : nullptr);
    if (t.confidence) {
      const ImVec4 tint_apart = colour(force_verdict(Validity::Apart));
      std::string unknown = text("%llu px", whole(t.confidence->unknown_px));
      const uint32_t islands = t.surface && t.surface->weighted ? t.surface->weighted->islands : 0;
      if (islands > 1) unknown += text(", %u islands", islands);
      row("unknown", unknown, islands > 1 ? &tint_apart : nullptr);
    }
    if (state.rates && content.live && content.live->to_measured.count > 0) {
      row("latency", "50 / 95 / 99 %");
      row("to measured", percentiles_text(content.live->to_measured));
      row("to shown", percentiles_text(content.live->to_shown));
    }
    ImGui::EndTable();
  }
  if (content.has_surface) ImGui::EndChild();
  ImGui::End();
}

}  // namespace palpate::viz
