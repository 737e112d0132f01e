#include "viz/hud.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "viz/annotations.h"

namespace palpate::viz {
namespace {

constexpr double kTraceLength_s = 8;

std::string text(const char* format, ...) __attribute__((format(printf, 1, 2)));
std::string text(const char* format, ...) {
  char buffer[160];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  return buffer;
}

ImVec2 corner(const ViewRect& r) {
  return {static_cast<float>(r.x), static_cast<float>(r.y)};
}
ImVec2 size(const ViewRect& r) {
  return {static_cast<float>(r.width), static_cast<float>(r.height)};
}
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
  if (tint) {
    ImGui::TextColored(*tint, "%s", value.c_str());
  } else {
    ImGui::TextUnformatted(value.c_str());
  }
}

// As much of `whole` as fits, with dots where something is missing.
std::string shortened(const std::string& whole, float width) {
  std::string result = whole;
  for (size_t length = whole.size(); length > 0 && ImGui::CalcTextSize(result.c_str()).x > width; --length) {
    // Never within a character of several bytes.
    while (length > 1 && (static_cast<unsigned char>(whole[length - 1]) & 0xC0) == 0x80) --length;
    result = whole.substr(0, length - 1) + "...";
  }
  return result;
}

std::string shear_text(const Estimate& e) {
  if (e.validity == Validity::NotCalibrated || e.validity == Validity::NoContact) return "-";
  return text("%+.3f \xc2\xb1 %.3f N", e.value, e.standard_error);
}

std::string depth_text(const Touch& t) {
  std::string shown = text("%.3f", t.depth_max_mm);
  if (t.depth_sd_mm > 0) shown += text(" \xc2\xb1 %.3f", t.depth_sd_mm);
  shown += " mm";
  if (t.depth_validity == Validity::Saturated) shown += ", saturated";
  if (t.depth_validity == Validity::AtBorder) shown += ", at border";
  if (t.depth_validity == Validity::Clipped) shown += ", slopes clipped";
  if (t.depth_validity == Validity::Apart) shown += ", on an island";
  if (!t.datum_from_rest) shown += " (no rest level)";
  return shown;
}

Verdict slip_verdict(Slip slip) {
  switch (slip) {
    case Slip::Stick:
      return {"sticks", 122, 209, 122};
    case Slip::Slip:
      return {"SLIPS: force at the friction limit", 255, 170, 60};
    case Slip::NoContact:
      return {"no contact", 150, 158, 170};
    default:
      return {"not calibrated", 150, 158, 170};
  }
}

void help_window(const ViewRect& around, float scale, bool player) {
  const char* const player_lines[][2] = {{"Left, Right", "1 s back, on (Shift: 10 s)"},
                                         {",  .", "pause, and one frame back, on"},
                                         {"Up, Down", "twice, half the speed"},
                                         {"Home, End", "first, last frame"}};
  const char* const lines[][2] = {{"left drag", "orbit"},
                                  {"right drag, Shift + left drag", "pan"},
                                  {"wheel", "zoom"},
                                  {"Space", "pause"},
                                  {"W", "write a session: start, stop"},
                                  {"S", "write a screenshot (PNG)"},
                                  {"R", "reset the view"},
                                  {"T", "view from the top"},
                                  {"+  -", "exaggerate depth more, less"},
                                  {"E", "automatic exaggeration on, off"},
                                  {"A", "automatic colour range on, off"},
                                  {"L", "light on, off (off: read colours off the bar)"},
                                  {"G", "grid on, off"},
                                  {"V", "vsync: on, mailbox, off"},
                                  {"C", "controls on, off"},
                                  {"H, F1", "this help"},
                                  {"Esc, Q", "quit"}};
  ImGui::SetNextWindowPos({static_cast<float>(around.x) + static_cast<float>(around.width) / 2,
                           static_cast<float>(around.y) + static_cast<float>(around.height) / 2},
                          ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::Begin("Keys and mouse", nullptr,
               ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings);
  if (ImGui::BeginTable("keys", 2, ImGuiTableFlags_SizingFixedFit)) {
    const auto add = [](const char* const(&line)[2]) {
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(line[0]);
      ImGui::TableNextColumn();
      ImGui::TextDisabled("  %s", line[1]);
    };
    if (player) std::for_each(std::begin(player_lines), std::end(player_lines), add);
    for (const auto& line : lines)
      if (!player || *line[0] != 'W') add(line);  // a replay is not recorded again
    ImGui::EndTable();
  }
  ImGui::Dummy({1, 2 * scale});
  ImGui::End();
}

void control_window(const ViewRect& around, float scale, bool has_surface, const LiveStats* live,
                    ViewState& state) {
  ImGui::SetNextWindowPos(
      {static_cast<float>(around.x) + 12 * scale, static_cast<float>(around.y) + 12 * scale});
  ImGui::SetNextWindowCollapsed(static_cast<float>(around.width) < 560 * scale, ImGuiCond_Once);
  ImGui::Begin(
      "View", nullptr,
      ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings);
  ImGui::PushItemWidth(120 * scale);
  if (has_surface) {
    const float auto_column = 240 * scale;
    auto exaggeration = static_cast<float>(state.exaggeration);
    if (ImGui::SliderFloat("exaggeration", &exaggeration, 1, 100, "%.1f", ImGuiSliderFlags_Logarithmic)) {
      state.exaggeration = exaggeration;
      state.automatic_exaggeration = false;
    }
    ImGui::SameLine(auto_column);
    ImGui::Checkbox("auto##exaggeration", &state.automatic_exaggeration);
    auto range = static_cast<float>(state.range_mm);
    if (ImGui::SliderFloat("range [mm]", &range, 0.02f, 10, "%.2f", ImGuiSliderFlags_Logarithmic)) {
      state.range_mm = range;
      state.automatic_range = false;
    }
    ImGui::SameLine(auto_column);
    ImGui::Checkbox("auto##range", &state.automatic_range);
    ImGui::Checkbox("light", &state.lit);
    ImGui::SameLine();
    ImGui::Checkbox("grid", &state.grid);
    ImGui::SameLine();
    ImGui::Checkbox("axes", &state.axes);
  }
  int vsync = static_cast<int>(state.vsync);
  if (ImGui::Combo("vsync", &vsync, "on\0mailbox\0off\0")) state.vsync = static_cast<Vsync>(vsync);
  if (ImGui::Button(state.paused ? "Continue" : "Pause")) state.paused = !state.paused;
  ImGui::SameLine();
  if (ImGui::Button("Screenshot")) state.wants_screenshot = true;
  if (live && !live->player) {
    ImGui::SameLine();
    if (ImGui::Button(live->recording ? "Stop##record" : "Record##record"))
      state.wants_recording_switched = true;
  }
  if (has_surface) {
    ImGui::SameLine();
    if (ImGui::Button("Reset")) state.camera = {};
  }
  ImGui::SameLine();
  if (ImGui::Button("Help")) state.help = !state.help;
  ImGui::PopItemWidth();
  ImGui::End();
}

void status_line(const Layout& layout, const HudContent& content, float scale) {
  ImDrawList* list = ImGui::GetForegroundDrawList();
  const ImVec2 low = corner(layout.status);
  const ImVec2 high{low.x + static_cast<float>(layout.status.width),
                    low.y + static_cast<float>(layout.status.height)};
  list->AddRectFilled(low, high, IM_COL32(15, 17, 20, 255));
  std::string line;
  const double time_s = 1e-9 * static_cast<double>(content.touch.time_ns);
  if (const LiveStats* live = content.live) {
    line = text("shown %.0f/s   measured %.0f/s   captured %.0f/s   dropped %llu + %llu", live->shown_per_s,
                live->processed_per_s, live->captured_per_s,
                static_cast<unsigned long long>(live->dropped_before_engine),
                static_cast<unsigned long long>(live->dropped_before_display));
    if (const CaptureCounts& c = live->camera; c.lost + c.damaged + c.gaps > 0)
      line += text("   camera: %llu lost, %llu damaged, %llu gaps", static_cast<unsigned long long>(c.lost),
                   static_cast<unsigned long long>(c.damaged), static_cast<unsigned long long>(c.gaps));
    if (content.mesh.first) line += text("   mesh %u x %u", content.mesh.first, content.mesh.second);
    line += text("   draw %.0f ms", live->draw_ms);
    if (!live->note.empty()) line = live->note + "   |   " + line;
  } else {
    line = text("frame %llu   t = %.3f s", static_cast<unsigned long long>(content.touch.sequence), time_s);
    if (content.mesh.first) line += text("   mesh %u x %u", content.mesh.first, content.mesh.second);
  }
  const float y = low.y + (high.y - low.y - ImGui::GetFontSize()) / 2;
  const float device_width = ImGui::CalcTextSize(content.device.c_str()).x;
  const float line_width = ImGui::CalcTextSize(line.c_str()).x;
  const float margin = 12 * scale;
  list->PushClipRect(low, high);
  list->AddText({low.x + margin, y}, IM_COL32(190, 197, 207, 255), line.c_str());
  // The device's name only where it has room.
  if (line_width + device_width + 4 * margin < high.x - low.x)
    list->AddText({high.x - margin - device_width, y}, IM_COL32(130, 138, 150, 255), content.device.c_str());
  list->PopClipRect();
}

/// Time, place and speed of a replay, along the foot of the surface.
void player_bar(const Layout& layout, float scale, const PlayerStats& player, int64_t time_ns,
                ViewState& state) {
  const float height = 34 * scale;
  ImGui::SetNextWindowPos(
      {static_cast<float>(layout.surface.x), static_cast<float>(layout.status.y) - height});
  ImGui::SetNextWindowSize({static_cast<float>(layout.surface.width), height});
  ImGui::Begin("player", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBackground);
  const std::string words = text("%.2f s   frame %llu of %llu   %gx", 1e-9 * static_cast<double>(time_ns),
                                 static_cast<unsigned long long>(player.position + 1),
                                 static_cast<unsigned long long>(player.frames), player.speed);
  // As wide as its longest form, so that the bar does not dance.
  const float room = std::max(280 * scale, ImGui::CalcTextSize(words.c_str()).x + 12 * scale);
  ImGui::SetNextItemWidth(std::max(40 * scale, ImGui::GetContentRegionAvail().x - room));
  auto position = static_cast<int>(player.position);
  const int last = std::max(1, static_cast<int>(player.frames) - 1);
  if (ImGui::SliderInt("##position", &position, 0, last, "", ImGuiSliderFlags_AlwaysClamp))
    state.seek_to = static_cast<uint64_t>(position);
  ImGui::SameLine();
  ImGui::TextUnformatted(words.c_str());
  ImGui::End();
}

/// What a person must see at once: that it records, that recording failed, that no frames come.
void banner(const Layout& layout, const LiveStats& live, float scale) {
  std::vector<std::pair<std::string, ImU32>> lines;
  constexpr ImU32 kRed = IM_COL32(255, 96, 88, 255), kAmber = IM_COL32(255, 190, 70, 255);
  const SessionStatus& s = live.session;
  if (!s.error.empty()) lines.emplace_back("RECORDING FAILED: " + s.error, kRed);
  if (live.recording && s.error.empty()) {
    std::string words = text("REC  %llu frames  %.0f MB", static_cast<unsigned long long>(s.recorded),
                             1e-6 * static_cast<double>(s.written_bytes));
    if (s.dropped > 0) words += text("  %llu DROPPED", static_cast<unsigned long long>(s.dropped));
    lines.emplace_back(words, s.dropped > 0 ? kAmber : kRed);
  }
  if (!live.state.empty()) lines.emplace_back(live.state, kAmber);
  ImDrawList* list = ImGui::GetForegroundDrawList();
  float y = static_cast<float>(layout.surface.y) + 12 * scale;
  const float left = static_cast<float>(layout.surface.x) + 12 * scale;
  const float right = static_cast<float>(layout.surface.x) + static_cast<float>(layout.surface.width) -
                      static_cast<float>(kColourBarRoom_px) * scale;
  for (const auto& [whole, tint] : lines) {
    const std::string words = shortened(whole, right - left - 30 * scale);
    const ImVec2 room = ImGui::CalcTextSize(words.c_str());
    const float x = std::max(left, right - room.x - 12 * scale);
    list->AddRectFilled({x - 22 * scale, y - 4 * scale}, {x + room.x + 10 * scale, y + room.y + 4 * scale},
                        IM_COL32(15, 17, 20, 225), 5 * scale);
    list->AddCircleFilled({x - 9 * scale, y + room.y / 2}, 5 * scale, tint);
    list->AddText({x, y}, tint, words.c_str());
    y += room.y + 14 * scale;
  }
}

std::string percentiles_text(const Percentiles& p) {
  if (p.count == 0) return "-";
  return text("%.1f / %.1f / %.1f ms", p.p50_ms, p.p95_ms, p.p99_ms);
}

}  // namespace

Verdict force_verdict(Validity validity) {
  switch (validity) {
    case Validity::Valid:
      return {"normal force, within calibration", 122, 209, 122};
    case Validity::NoContact:
      return {"nothing touches the pad", 150, 158, 170};
    case Validity::BelowRange:
      return {"normal force BELOW the calibrated range", 255, 190, 70};
    case Validity::AboveRange:
      return {"normal force ABOVE the calibrated range", 255, 150, 60};
    case Validity::Saturated:
      return {"SATURATED pixels: force is at least this", 255, 96, 88};
    case Validity::AtBorder:
      return {"contact reaches the BORDER: force is at least this", 255, 150, 60};
    case Validity::Clipped:
      return {"slopes CLIPPED at max_slope: depth is too small", 255, 150, 60};
    case Validity::OnsetUnseen:
      return {"contact began UNSEEN: shear counts from there", 255, 190, 70};
    case Validity::Apart:
      return {"unknown pixels cut the surface into ISLANDS", 255, 150, 60};
    default:
      return {"force not calibrated: gray sum only", 150, 158, 170};
  }
}

Layout make_layout(VkExtent2D extent, float scale, const FrameFormat& format, bool has_surface) {
  const auto px = [scale](double value) { return static_cast<uint32_t>(std::lround(value * scale)); };
  const uint32_t width = std::max(extent.width, 2u), height = std::max(extent.height, 2u);
  const uint32_t status = std::min(px(24), height / 2);
  const uint32_t panel =
      std::min(std::clamp(static_cast<uint32_t>(0.27 * width), px(270), px(380)), width / 2);
  const double aspect = static_cast<double>(format.width) / format.height;
  Layout l;
  l.surface = {0, 0, width - panel, height - status};
  l.view = l.surface;
  // Its middle is the middle of what the colour bar leaves.
  l.view.x -= static_cast<int32_t>(px(kColourBarRoom_px));
  l.view.width += px(kColourBarRoom_px);
  l.panel = {static_cast<int32_t>(width - panel), 0, panel, height - status};
  l.status = {0, static_cast<int32_t>(height - status), width, status};
  const ViewRect room =
      has_surface ? ViewRect{l.panel.x + static_cast<int32_t>(px(12)), static_cast<int32_t>(px(36)),
                             panel - std::min(px(24), panel - 1),
                             std::max(1u, std::min(px(300), (height - status) * 2 / 5))}
                  : ViewRect{static_cast<int32_t>(px(12)), static_cast<int32_t>(px(12)),
                             std::max(1u, l.surface.width - std::min(px(24), l.surface.width - 1)),
                             std::max(1u, l.surface.height - std::min(px(24), l.surface.height - 1))};
  const double fit = std::min(room.width / aspect, static_cast<double>(room.height));
  l.image.height = std::max(1u, static_cast<uint32_t>(fit));
  l.image.width = std::max(1u, std::min(room.width, static_cast<uint32_t>(std::lround(fit * aspect))));
  l.image.x = room.x + static_cast<int32_t>((room.width - l.image.width) / 2);
  l.image.y = has_surface ? room.y : room.y + static_cast<int32_t>((room.height - l.image.height) / 2);
  return l;
}

void Hud::follow(const Touch& touch) {
  const bool is_force = touch.force_N.validity != Validity::NotCalibrated;
  const double time_s = 1e-9 * static_cast<double>(touch.time_ns);
  if (is_force != trace_is_force_ || (!trace_.empty() && time_s < trace_.back().time_s)) trace_.clear();
  trace_is_force_ = is_force;
  const double value = is_force ? touch.force_N.value : touch.gray_sum;
  trace_.push_back({time_s, touch.contact && std::isfinite(value) ? value : 0});
  while (trace_.size() > 2 && trace_[1].time_s < time_s - kTraceLength_s) trace_.pop_front();
  if (touch.shear_x_N.validity != Validity::NotCalibrated) {
    const double shear_N = std::hypot(touch.shear_x_N.value, touch.shear_y_N.value);
    if (std::isfinite(shear_N)) full_shear_N_ = std::max(full_shear_N_, shear_N);
  }
}

void Hud::trace(float width, float height, float scale) const {
  const ImVec2 low = ImGui::GetCursorScreenPos();
  ImGui::Dummy({width, height});
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddRectFilled(low, {low.x + width, low.y + height}, IM_COL32(30, 34, 41, 255), 4 * scale);
  if (trace_.empty()) return;
  double top = 0;
  for (const Sample& s : trace_) top = std::max(top, s.value);
  top = nice_ceiling(std::max(top, trace_is_force_ ? 0.01 : 1.0));
  const double end_s = trace_.back().time_s;
  const auto place = [&](const Sample& s) {
    const double x = 1 - (end_s - s.time_s) / kTraceLength_s;
    const double y = std::clamp(s.value / top, 0.0, 1.0);
    return ImVec2{low.x + static_cast<float>(std::clamp(x, 0.0, 1.0)) * width,
                  low.y + height - 3 * scale - static_cast<float>(y) * (height - 6 * scale)};
  };
  std::vector<ImVec2> line;
  line.reserve(trace_.size());
  for (const Sample& s : trace_) {
    const ImVec2 p = place(s);
    if (line.empty() || p.x - line.back().x >= 1) line.push_back(p);
  }
  list->AddPolyline(line.data(), static_cast<int>(line.size()), IM_COL32(92, 200, 255, 255), 0, 1.6f * scale);
  const std::string label =
      text(trace_is_force_ ? "%g N" : "%.0f gray", top) + text(", last %.0f s", kTraceLength_s);
  const ImVec2 label_size = ImGui::CalcTextSize(label.c_str());
  const ImVec2 at{low.x + 6 * scale, low.y + 3 * scale};
  list->AddRectFilled({at.x - 2, at.y}, {at.x + label_size.x + 2, at.y + label_size.y},
                      IM_COL32(30, 34, 41, 190));
  list->AddText(at, IM_COL32(150, 158, 170, 255), label.c_str());
}

void Hud::measurements(HudFrame& frame, const Layout& layout, const HudContent& content) {
  const Touch& t = content.touch;
  const float scale = frame.scale();
  ImGui::SetNextWindowPos(corner(layout.panel));
  ImGui::SetNextWindowSize(size(layout.panel));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
  ImGui::Begin("measurements", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoBringToFrontOnFocus);
  ImGui::PopStyleVar();
  const std::string format = text("%u x %u", content.frame.format.width, content.frame.format.height);
  const float format_width = ImGui::CalcTextSize(format.c_str()).x;
  const std::string name = content.sensor.name.empty() ? "unnamed sensor" : content.sensor.name;
  ImGui::TextUnformatted(
      shortened(name, ImGui::GetContentRegionAvail().x - format_width - 12 * scale).c_str());
  ImGui::SameLine(ImGui::GetWindowWidth() - format_width - 12 * scale);
  ImGui::TextDisabled("%s", format.c_str());
  if (content.has_surface) {
    ImGui::SetCursorPosY(static_cast<float>(layout.image.y) + static_cast<float>(layout.image.height) +
                         8 * scale);
  }

  const Verdict verdict = force_verdict(t.force_N.validity);
  const ImVec4 tint = colour(verdict);
  const bool has_force =
      t.force_N.validity != Validity::NotCalibrated && t.force_N.validity != Validity::NoContact;
  ImGui::PushFont(frame.large());
  if (has_force) {
    ImGui::TextUnformatted(text("%.3f N", t.force_N.value).c_str());
  } else if (t.force_N.validity == Validity::NotCalibrated) {
    ImGui::TextUnformatted(text("G %.0f", t.gray_sum).c_str());
  } else {
    ImGui::TextDisabled("no contact");
  }
  ImGui::PopFont();
  if (has_force) {
    const ImVec2 high = ImGui::GetItemRectMax();
    ImGui::GetWindowDrawList()->AddText({high.x + 8 * scale, high.y - ImGui::GetFontSize() - 4 * scale},
                                        ImGui::GetColorU32(ImGuiCol_TextDisabled),
                                        text("\xc2\xb1 %.3f N", t.force_N.standard_error).c_str());
  }
  ImGui::TextColored(tint, "%s", verdict.words);
  trace(ImGui::GetContentRegionAvail().x, 56 * scale, scale);

  if (!ImGui::BeginTable("values", 2, ImGuiTableFlags_SizingStretchProp)) {
    ImGui::End();
    return;
  }
  ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, 0.36f);
  ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, 0.64f);
  const Verdict slip = slip_verdict(t.slip);
  const ImVec4 slip_tint = colour(slip);
  row("shear x", shear_text(t.shear_x_N));
  row("shear y", shear_text(t.shear_y_N));
  row("stick or slip", slip.words, &slip_tint);
  if (content.has_surface) {
    const bool doubtful = t.depth_validity != Validity::Valid && t.depth_validity != Validity::NoContact &&
                          t.depth_validity != Validity::NotCalibrated;
    const ImVec4 depth_tint = colour(force_verdict(t.depth_validity));
    row("deepest", t.has_surface ? depth_text(t) : "-", doubtful ? &depth_tint : nullptr);
  }
  const bool scaled = has_scale(content.sensor);
  const auto area_px = static_cast<unsigned long long>(t.area_px);
  row("contact area", !t.contact ? "-"
                      : scaled   ? text("%.2f mm\xc2\xb2", t.area_mm2)
                                 : text("%llu px (no scale)", area_px));
  row("ellipse", t.contact && scaled ? text("%.2f x %.2f mm", t.ellipse.major_mm, t.ellipse.minor_mm) : "-");
  row("centroid", t.contact ? text("%.2f, %.2f px", t.centroid_x_px, t.centroid_y_px) : "-");
  row("moved", t.contact && scaled ? text("%+.3f, %+.3f mm", t.shift_x_mm, t.shift_y_mm) : "-");
  row("peak", text("%.1f gray", t.peak_gray));
  const ImVec4 red = colour(force_verdict(Validity::Saturated));
  row("saturated", text("%llu px", static_cast<unsigned long long>(t.saturated_px)),
      t.saturated_px ? &red : nullptr);
  if (content.has_surface && t.clipped_px > 0) {
    const ImVec4 tint_clipped = colour(force_verdict(Validity::Clipped));
    row("clipped slopes", text("%llu px", static_cast<unsigned long long>(t.clipped_px)),
        t.depth_validity == Validity::Clipped ? &tint_clipped : nullptr);
  }
  if (t.has_confidence) {
    const ImVec4 tint_apart = colour(force_verdict(Validity::Apart));
    std::string shown = text("%llu px", static_cast<unsigned long long>(t.unknown_px));
    if (t.islands > 1) shown += text(", %u islands", t.islands);
    row("unknown", shown, t.islands > 1 ? &tint_apart : nullptr);
  }
  if (content.live && content.live->to_measured.count > 0) {
    row("latency", "50 / 95 / 99 %");
    row("to measured", percentiles_text(content.live->to_measured));
    row("to shown", percentiles_text(content.live->to_shown));
  }
  ImGui::EndTable();
  ImGui::End();
}

void Hud::describe(HudFrame& frame, const Layout& layout, const HudContent& content, ViewState& state,
                   const Eye* eye, const Vec3& half_mm) {
  const float scale = frame.scale();
  ImDrawList* under = ImGui::GetBackgroundDrawList();
  const SurfaceStyle style = state.style(2 * std::max(half_mm.x, half_mm.y));
  if (content.has_surface && eye) {
    if (state.axes) draw_axes(under, *eye, layout.surface, layout.view, half_mm, style, scale);
    draw_colour_bar(under, layout.surface, style, state.automatic_range, scale);
  }
  const ImVec2 low = corner(layout.image);
  under->AddRect({low.x - 1, low.y - 1}, {low.x + size(layout.image).x + 1, low.y + size(layout.image).y + 1},
                 IM_COL32(70, 78, 90, 255));
  draw_contact(under, layout.image, content.touch, content.sensor, content.frame.format.width, full_shear_N_,
               scale);
  measurements(frame, layout, content);
  status_line(layout, content, scale);
  if (!frame.has_window()) return;
  if (state.controls) control_window(layout.surface, scale, content.has_surface, content.live, state);
  const bool player = content.live && content.live->player;
  if (content.live) banner(layout, *content.live, scale);
  if (player) player_bar(layout, scale, *content.live->player, content.touch.time_ns, state);
  if (state.help) {
    help_window(layout.surface, scale, player);
  } else {
    under->AddText({14 * scale, static_cast<float>(layout.status.y) - (player ? 52 : 22) * scale},
                   IM_COL32(120, 128, 140, 255),
                   content.has_surface ? "drag: orbit   wheel: zoom   H: help" : "H: help");
  }
}

}  // namespace palpate::viz
