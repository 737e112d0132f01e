#include "viz/panels/actions/text_field.h"

#include <imgui.h>

#include "viz/render/drawing.h"

namespace palpate::viz {

void text_field(const char* id, const char* hint, TypedText& typed) {
  if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
  // The field takes letters two pictures from now: what is typed until then waits, in its order.
  ImVector<ImWchar>& letters = ImGui::GetIO().InputQueueCharacters;
  if (!typed.takes_letters) {
    typed.early.insert(typed.early.end(), letters.begin(), letters.end());
    letters.resize(0);
  } else {
    for (auto letter = typed.early.rbegin(); letter != typed.early.rend(); ++letter)
      letters.insert(letters.begin(), *letter);
    typed.early.clear();
  }
  ImGui::InputTextWithHint(id, hint, typed.text.data(), typed.text.size());
  typed.takes_letters = ImGui::IsItemActive();
}

void end_labelling(ViewState& state, bool mark) {
  if (mark)
    state.mark_requested = true;
  else
    state.label.text = {};
  state.labelling = state.label.takes_letters = false;
  state.label.early.clear();
}

void label_window(const ViewRect& around, float scale, ViewState& state) {
  ImGui::SetNextWindowPos(middle(around), ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowFocus();
  ImGui::Begin("Text of the event", nullptr,
               ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav);
  ImGui::SetNextItemWidth(260 * scale);
  text_field("##label", "", state.label);
  if (ImGui::Button("Mark")) end_labelling(state, true);
  ImGui::SameLine();
  if (ImGui::Button("Cancel")) end_labelling(state, false);
  ImGui::End();
}

}  // namespace palpate::viz
