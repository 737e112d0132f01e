#include "viz/panels/run_panel.h"

#include <imgui.h>

#include <string>
#include <variant>

#include "engine/base/text.h"

namespace palpate::viz {
namespace {

/// Those that make sense before a source is open.
constexpr const char* kShown[] = {"rate_Hz", "patience_s", "solver", "sequence", "fixed_light", "loop"};

struct Field {
  const char* label;
  const Setting& setting;
  RunSettings& run;

  void operator()(bool RunSettings::*member) const { ImGui::Checkbox(label, &(run.*member)); }
  void operator()(double RunSettings::*member) const {
    double& value = run.*member;
    const double none = RunSettings{}.*member;
    const std::string shown = value == none ? "default" : text("%g", value);
    if (!ImGui::InputDouble(label, &value, 0, 0, shown.c_str(), ImGuiInputTextFlags_EnterReturnsTrue)) return;
    if (!in_range(setting, value)) value = none;
  }
  void operator()(std::optional<SurfaceSolver> RunSettings::*member) const {
    std::optional<SurfaceSolver>& value = run.*member;
    if (!ImGui::BeginCombo(label, value ? to_string(*value) : "default")) return;
    if (ImGui::Selectable("default", !value)) value.reset();
    for (const auto& [name, solver] : kSolverNames)
      if (ImGui::Selectable(name.c_str(), value == solver)) value = solver;
    ImGui::EndCombo();
  }
  template <typename Other>
  void operator()(Other RunSettings::*) const {}
};

}  // namespace

void run_panel(RunSettings& run, float scale) {
  if (!ImGui::TreeNode("Settings of the run")) return;
  ImGui::PushItemWidth(90 * scale);
  for (const char* name : kShown) {
    const Setting& setting = run_setting(name);
    const std::string label = std::string(setting.option + 2) + (*setting.unit ? ", " : "") + setting.unit;
    std::visit(Field{label.c_str(), setting, run}, setting.member);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", setting.sentence);
  }
  ImGui::PopItemWidth();
  ImGui::TreePop();
}

}  // namespace palpate::viz
