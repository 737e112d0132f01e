#include "viz/panels/sensor.h"

#include <imgui.h>

#include <algorithm>
#include <optional>

#include "viz/panels/charts/calibration_chart.h"
#include "viz/panels/charts/charts.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

std::string origin_text(const Origin& origin) {
  std::string words;
  const auto add = [&](const std::string& part) {
    if (!part.empty()) words += (words.empty() ? "" : "; ") + part;
  };
  if (!origin.from.empty()) add("from " + origin.from);
  add(origin.made);
  add(origin.note);
  return words;
}

CalibrationLine scale_line(const Sensor& s) {
  if (!has_scale(s)) return {"scale", false, "px only; palpate calibrate scale gives mm", {}};
  std::string what = text("%.5g", s.pitch_mm_per_px);
  if (s.pitch_sd_mm_per_px > 0) what += text(" \xc2\xb1 %.2g", s.pitch_sd_mm_per_px);
  return {"scale", true, what + " mm/px", {}};
}

CalibrationLine force_line(const Sensor& s) {
  if (!s.force) return {"force", false, "gray sum only; palpate calibrate force gives newtons", {}};
  const ForceCalibration& f = *s.force;
  const ForceRange range = calibrated_range(f);
  std::string what = text("%s of %s, %.3g to %.3g N, scatter %.2g N", to_string(f.model), to_string(f.signal),
                          range.least_N, range.most_N, f.residual_sd_N);
  if (f.r_squared > 0) what += text(", R\xc2\xb2 %.4f", f.r_squared);
  if (f.loading && f.unloading) what += text(", hysteresis %.2g %% of full scale", 100 * f.hysteresis);
  if (f.drift_N_per_min != 0) what += text(", drift %.2g N/min", f.drift_N_per_min);
  if (!f.shapes_judged) what += ", too few objects to judge other shapes";
  if (!f.fit_for_use) what = "NOT FIT FOR USE: " + what;
  return {"force", f.fit_for_use, what, origin_text(f.origin)};
}

CalibrationLine shear_line(const Sensor& s) {
  if (!s.shear)
    return {"shear", false, "shift in mm only; palpate calibrate shear gives newtons and slip", {}};
  std::string what = text("%.3g, %.3g N/mm \xc2\xb1 %.2g %%, friction %.3g", s.shear->kx_N_per_mm,
                          s.shear->ky_N_per_mm, 100 * s.shear->relative_sd, s.shear->friction);
  if (s.shear->friction_sd > 0) what += text(" \xc2\xb1 %.2g", s.shear->friction_sd);
  if (s.shear->shift_max_mm > 0) what += text(", to %.3g mm", s.shear->shift_max_mm);
  return {"shear", true, what + text(", by %s", to_string(s.shear->signal)), origin_text(s.shear->origin)};
}

CalibrationLine surface_line(const Sensor& s) {
  switch (s.reading) {
    case SurfaceReading::Shading:
      return {"surface",
              true,
              text("shading: facing gray %.4g gray levels, depth gain %.4g", s.shading.facing_gray,
                   s.shading.depth_gain),
              {}};
    case SurfaceReading::Photometric:
      return {"surface", true, text("photometric: normal to %.3g (held out)", s.photometric.normal_sd),
              origin_text(s.photometric.origin)};
    case SurfaceReading::Elastic: {
      std::string what =
          text("elastic: %.4g gray/MPa, E %.3g MPa", s.elastic.gray_per_MPa, s.elastic.young_MPa);
      if (s.elastic.thickness_mm > 0) what += text(", %.3g mm thick", s.elastic.thickness_mm);
      if (s.elastic.relative_sd > 0) what += text(", depth \xc2\xb1 %.2g %%", 100 * s.elastic.relative_sd);
      return {"surface", true, what, {}};
    }
    case SurfaceReading::Lookup:
      return {"surface", !s.lookup.points.empty(),
              s.lookup.points.empty() ? std::string("lookup without points")
                                      : text("lookup: to %.3g mm \xc2\xb1 %.2g mm", s.lookup.points.back()[1],
                                             s.lookup.depth_sd_mm),
              origin_text(s.lookup.origin)};
    default:
      return {"surface", false, "none: contact and force only", {}};
  }
}

}  // namespace

std::vector<CalibrationLine> calibrations(const Sensor& s) {
  std::vector<CalibrationLine> lines{scale_line(s), force_line(s), shear_line(s), surface_line(s)};
  if (s.skin)
    lines.push_back(
        {"skin", true, text("%s, every %.3g px", to_string(s.skin->kind), s.skin->spacing_px), {}});
  else
    lines.push_back(
        {"skin", false, "no pattern: slip by the friction limit alone, rolls look like slides", {}});
  if (s.lens)
    lines.push_back({"lens", true, text("distortion undone, to %.2g px", s.lens->residual_px),
                     origin_text(s.lens->origin)});
  else
    lines.push_back({"lens", false, "taken as free of distortion; palpate calibrate scale finds it", {}});
  if (s.flat)
    lines.push_back({"flat field", true, "uneven light undone", origin_text(s.flat->origin)});
  else
    lines.push_back({"flat field", false, "uneven light is not undone; palpate calibrate flat", {}});
  if (s.background.kind == BackgroundKind::None)
    lines.push_back({"background", true, "none needed: frames hold the change", {}});
  else if (!s.background.image.empty())
    lines.push_back({"background", true, "untouched image in a file", s.background.image});
  else
    lines.push_back({"background",
                     true,
                     text("the first %u frame%s of each recording: keep the pad untouched then",
                          s.background.first_frames, s.background.first_frames == 1 ? "" : "s"),
                     {}});
  return lines;
}

namespace {

/// Force and shear, side by side where there is room.
void calibration_charts(const Sensor& sensor, const Touch& touch, float height, float scale, bool tared) {
  const std::optional<double> largest_N =
      sensor.force ? std::optional(calibrated_range(*sensor.force).most_N) : std::nullopt;
  const float room = ImGui::GetContentRegionAvail().x, gap = 18 * scale;
  const bool beside = sensor.force && sensor.shear && room >= 560 * scale;
  const float width = beside ? (room - gap) / 2 : room;
  const auto place = [&] {
    const ImVec2 at = ImGui::GetCursorScreenPos();
    ImGui::Dummy({width, height});
    return ViewRect{static_cast<int32_t>(at.x), static_cast<int32_t>(at.y), static_cast<uint32_t>(width),
                    static_cast<uint32_t>(height)};
  };
  if (sensor.force) draw_force_calibration(ImGui::GetWindowDrawList(), place(), *sensor.force, touch, scale);
  if (beside) ImGui::SameLine(0, gap);
  if (sensor.shear)
    draw_shear_calibration(ImGui::GetWindowDrawList(), place(), *sensor.shear, largest_N, touch, scale);
  if (tared && (sensor.force || sensor.shear))
    ImGui::TextDisabled("Forces on these curves are as measured, not tared.");
}

}  // namespace

void sensor_panel(const Layout& layout, float scale, const Sensor& sensor, const Touch& touch,
                  ViewState& state) {
  const ViewRect& around = layout.has_dock ? layout.dock : layout.pictures;
  const ImVec2 size = size_of(around);
  ImGuiWindowFlags flags = ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove |
                           ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav;
  if (layout.has_dock || layout.has_headline) {
    ImGui::SetNextWindowPos(corner(around));
    ImGui::SetNextWindowSize(size);
    flags |= ImGuiWindowFlags_NoResize;
  } else {
    const float width = std::min(680 * scale, size.x - 16 * scale);
    ImGui::SetNextWindowPos(middle(around), ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowSizeConstraints({width, 0}, {width, size.y - 8});
    flags |= ImGuiWindowFlags_AlwaysAutoResize;
  }
  ImGui::SetNextWindowBgAlpha(1);
  ImGui::Begin("Sensor and calibrations", &state.sensor_panel, flags);
  ImGui::TextUnformatted(sensor.name.empty() ? "unnamed sensor" : sensor.name.c_str());
  const ImVec4 faint = ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled);
  wrapped_text(text("contact: %s, from %g gray levels, saturated from %u gray levels",
                    to_string(sensor.signal), sensor.threshold_gray, sensor.saturation_gray),
               faint);
  calibration_charts(sensor, touch, std::clamp(0.33f * size.y, 140 * scale, 260 * scale), scale,
                     state.tare.on);
  if (ImGui::BeginTable("calibrations", 2, ImGuiTableFlags_SizingFixedFit)) {
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed);
    ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch);
    for (const CalibrationLine& line : calibrations(sensor)) {
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(line.name);
      ImGui::TableNextColumn();
      const ImVec4 missing = tint(theme().doubtful);
      wrapped_text((line.present ? "" : "missing: ") + line.what,
                   line.present ? ImGui::GetStyleColorVec4(ImGuiCol_Text) : missing);
      if (!line.origin.empty()) wrapped_text(line.origin, faint);
    }
    ImGui::EndTable();
  }
  ImGui::End();
}

}  // namespace palpate::viz
