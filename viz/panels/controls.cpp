#include "viz/panels/controls.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>

#include "viz/panels/actions/tool_bar.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

/// Buttons and boxes side by side; what has no room begins the next row.
class Rows {
 public:
  bool button(const char* label) {
    place(ImGui::CalcTextSize(label, nullptr, true).x + 2 * ImGui::GetStyle().FramePadding.x);
    return ImGui::Button(label);
  }
  void box(const char* label, bool& value) {
    place(ImGui::GetFrameHeight() + ImGui::GetStyle().ItemInnerSpacing.x +
          ImGui::CalcTextSize(label, nullptr, true).x);
    ImGui::Checkbox(label, &value);
  }

 private:
  void place(float width) {
    const float right = ImGui::GetWindowPos().x + ImGui::GetWindowContentRegionMax().x;
    if (begun_ && ImGui::GetItemRectMax().x + ImGui::GetStyle().ItemSpacing.x + width <= right)
      ImGui::SameLine();
    begun_ = true;
  }
  bool begun_ = false;
};

void range_setting(ViewState& state, float auto_column) {
  const auto slider = [&](const char* label, double& value, double unit, double least, double most,
                          const char* format) {
    auto shown = static_cast<float>(value * unit);
    if (ImGui::SliderFloat(label, &shown, static_cast<float>(least * unit), static_cast<float>(most * unit),
                           format, ImGuiSliderFlags_Logarithmic)) {
      value = shown / unit;
      if (bool* follows = state.automatic()) *follows = false;
    }
  };
  if (state.quantity == Quantity::Pressure)
    slider("range", state.range_MPa, 1e3, ViewState::kLeastRange_MPa, ViewState::kMostRange_MPa, "%.2f kPa");
  else if (state.quantity == Quantity::Strain)
    slider("range", state.strain_range, 100, ViewState::kLeastStrain, ViewState::kMostStrain, "%.1f %%");
  else if (state.quantity == Quantity::Friction)
    slider("range", state.friction_range, 1, ViewState::kLeastFriction, ViewState::kMostFriction, "%.2f");
  else
    slider("range", state.range_mm, 1, ViewState::kLeastRange_mm, ViewState::kMostRange_mm, "%.3f mm");
  if (bool* follows = state.automatic()) {
    ImGui::SameLine(auto_column);
    ImGui::Checkbox("auto##range", follows);
  }
}

void surface_settings(ViewState& state, float scale) {
  const float auto_column = 178 * scale;
  ImGui::PushItemWidth(100 * scale);
  if (ImGui::BeginCombo("colours", to_string(state.quantity))) {
    for (int i = 0; i < kQuantities; ++i) {
      const auto q = static_cast<Quantity>(i);
      if (!state.can_show(q)) continue;
      const char* words = q == Quantity::Strain ? "strain (area, from slopes)" : to_string(q);
      if (ImGui::Selectable(words, q == state.quantity)) state.quantity = q;
    }
    ImGui::EndCombo();
  }
  if (ImGui::BeginCombo("colour map", to_string(state.map))) {
    for (int i = 0; i < kColourMaps; ++i) {
      const auto map = static_cast<ColourMap>(i);
      if (ImGui::Selectable(to_string(map), map == state.map)) state.map = map;
    }
    ImGui::EndCombo();
  }
  range_setting(state, auto_column);
  auto exaggeration = static_cast<float>(state.exaggeration);
  if (ImGui::SliderFloat("vertical", &exaggeration, 1, 200, "x %.1f", ImGuiSliderFlags_Logarithmic)) {
    state.exaggeration = exaggeration;
    state.automatic_exaggeration = false;
  }
  ImGui::SameLine(auto_column);
  ImGui::Checkbox("auto##exaggeration", &state.automatic_exaggeration);
  ImGui::PopItemWidth();
}

/// Settings of the block for estimates from presses, as far as the window offers them.
void block_settings(const BlockSetting& now, float scale, ViewState& state) {
  BlockSetting draft = state.block_draft.value_or(now);
  bool active = false;
  const auto field = [&](const char* label, double& value, const char* format) {
    ImGui::PushItemWidth(70 * scale);
    ImGui::InputDouble(label, &value, 0, 0, format);
    ImGui::PopItemWidth();
    active = active || ImGui::IsItemActive();
    if (ImGui::IsItemDeactivatedAfterEdit()) state.block_requested = draft;
  };
  ImGui::Separator();
  ImGui::TextDisabled("block of tissue, from the next press on");
  field("modulus, Pa", draft.young_Pa, "%.0f");
  field("thickness, mm", draft.block_mm[2], "%.2f");
  field("length, mm", draft.block_mm[0], "%.2f");
  field("width, mm", draft.block_mm[1], "%.2f");
  if (active)
    state.block_draft = draft;
  else
    state.block_draft.reset();
  ImGui::Separator();
}

void switches(bool has_surface, ViewState& state) {
  Rows rows;
  for (const ViewSetting& setting : view_settings()) {
    const auto* const flag = std::get_if<bool ViewSettings::*>(&setting.member);
    if (!flag || *flag == &ViewSettings::controls || (setting.on_surface && !has_surface)) continue;
    if (*flag == &ViewSettings::object_map && !state.has_object_map) continue;
    std::string label = setting.name;
    std::replace(label.begin(), label.end(), '_', ' ');
    rows.box(label.c_str(), state.**flag);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", setting.sentence);
  }
}

}  // namespace

void control_window(const Layout& layout, float scale, bool has_surface, const LiveStats* live,
                    ViewState& state) {
  const ViewRect& around = layout.has_dock ? layout.dock : layout.pictures;
  const ImVec2 at = corner(around), size = size_of(around);
  ImGuiWindowFlags flags =
      ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav;
  if (layout.has_dock) {
    ImGui::SetNextWindowPos(at);
    ImGui::SetNextWindowSize(size);
    flags |= ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse;
  } else {
    // Without room of its own it is a title alone until it is opened.
    ImGui::SetNextWindowPos({at.x + 12 * scale, at.y + 12 * scale});
    ImGui::SetNextWindowCollapsed(true, ImGuiCond_Once);
    ImGui::SetNextWindowSizeConstraints({0, 0}, {size.x - 24 * scale, size.y - 24 * scale});
    flags |= ImGuiWindowFlags_AlwaysAutoResize;
  }
  ImGui::SetNextWindowBgAlpha(1);
  // Above a player there is less room: the rows move together.
  const bool close = layout.has_dock && size.y < 432 * scale;
  const ImVec2 spacing = ImGui::GetStyle().ItemSpacing;
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {spacing.x, close ? spacing.y / 2 : spacing.y});
  ImGui::Begin("Settings", nullptr, flags);
  if (has_surface) surface_settings(state, scale);
  if (live && live->press) block_settings(live->press->block, scale, state);
  switches(has_surface, state);
  ImGui::PushItemWidth(70 * scale);
  int strain = static_cast<int>(state.skin_strain);
  if (state.can_show_skin && ImGui::Combo("skin strain", &strain, "off\0stretch\0shear\0"))
    state.skin_strain = static_cast<SkinStrain>(strain);
  const bool player = live && live->player;
  const bool whole = player && state.whole_recording;
  if (ImGui::BeginCombo("time axis", whole ? "whole" : text("%g s", state.chart_span_s).c_str())) {
    for (const double span_s : kChartSpans_s)
      if (ImGui::Selectable(text("%g s", span_s).c_str(), !whole && span_s == state.chart_span_s)) {
        state.chart_span_s = span_s;
        state.whole_recording = !player;
        state.chart_view.reset();
      }
    if (player && ImGui::Selectable("whole", whole)) state.whole_recording = true, state.chart_view.reset();
    ImGui::EndCombo();
  }
  int vsync = static_cast<int>(state.vsync);
  if (ImGui::Combo("vsync", &vsync, "on\0mailbox\0off\0")) state.vsync = static_cast<Vsync>(vsync);
  ImGui::PopItemWidth();
  Rows rows;
  for (const BarButton& button : bar_buttons(layout, scale, has_surface, live, state))
    if (!button.in_bar && rows.button(button.label)) button.action->run(state);
  ImGui::Text("text");
  ImGui::SameLine();
  if (ImGui::SmallButton(" - ##text")) state.enlarge_text(false);
  ImGui::SameLine();
  if (ImGui::SmallButton(" + ##text")) state.enlarge_text(true);
  ImGui::SameLine();
  if (ImGui::SmallButton("full screen")) state.full_screen_requested = true;
  if (live) {
    ImGui::PushTextWrapPos(0);
    if (live->notes.empty())
      ImGui::TextDisabled("no folder for snapshots and marks: HOME is not set");
    else
      ImGui::TextDisabled("snapshots and marks go to %s", live->notes.c_str());
    ImGui::PopTextWrapPos();
  }
  ImGui::End();
  ImGui::PopStyleVar();
}

}  // namespace palpate::viz
