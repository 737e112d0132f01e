#include "viz/panels/numbers/grip_cards.h"

#include <imgui.h>

#include <string_view>
#include <utility>
#include <variant>

#include "viz/look/measures.h"
#include "viz/panels/numbers/quantity_rows.h"
#include "viz/panels/numbers/quantity_words.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

/// Why an estimate may be wrong, or has no number; nothing where it is valid, or never had one.
std::string doubt_of(const Estimate& estimate) {
  switch (estimate.validity) {
    case Validity::Valid:
    case Validity::NoContact:
    case Validity::NotCalibrated:
      return {};
    default:
      return to_string(estimate.validity);
  }
}

using GripPart = const MeasuredQuantity<GripFrame>*;

/// The quantities of one label, as one row; of several the numbers alone.
CardRow card_row(const std::vector<GripPart>& parts, const GripFrame& frame) {
  const MeasuredQuantity<GripFrame>& first = *parts.front();
  const std::string_view name = first.name;
  if (name == "grip_slip" && frame.grip) {
    const Verdict verdict = slip_verdict(frame.grip->slip);
    return {first.row.label, frame.grip->slip == Slip::NoContact ? "-" : verdict.words, verdict.meaning};
  }
  std::string words, doubt;
  bool some = false;
  for (const GripPart q : parts) {
    const QuantityValue value = q->value(frame);
    const std::string number = number_text(*q, value, parts.size() == 1);
    some |= number != "-";
    words += (words.empty() ? "" : ", ") + number;
    if (const auto* estimate = std::get_if<Estimate>(&value)) doubt = doubt_of(*estimate);
  }
  if (name == "stiffness_N_per_mm" && frame.grip) {
    const StiffnessState state = frame.grip->stiffness;
    const bool silent = state == StiffnessState::Known || state == StiffnessState::NotGripped;
    doubt = silent ? "" : to_string(state);
  }
  CardRow row{first.row.label, some ? words + unit_text(first) : "-"};
  if (doubt.empty()) return row;
  row.words = some ? row.words + ", " + doubt : doubt;
  row.meaning = some ? Meaning::Doubtful : Meaning::Explains;
  return row;
}

}  // namespace

Card grip_card(const HudFrame& frame, const GripFrame& grip, bool zeroed) {
  Card card{.title = "grip", .aside = zeroed ? "TARED (Shift+Z ends)" : "", .above_px = kHeadline_px};
  const Estimate force = grip.grip ? grip.grip->force_N : Estimate{};
  const bool known = has_value(force);
  std::string figures = "no contact", error;
  if (known) {
    figures = text("%.3f N", force.value);
    error = text("\xc2\xb1 %.3f N", force.standard_error);
  } else if (!grip.grip) {
    figures = "one finger alone";
  } else if (force.validity == Validity::NotCalibrated) {
    figures = "not calibrated";
  }
  card.draw = [&frame, figures, error, known, scale = frame.scale()](ImVec2 low, ImVec2) {
    ImGui::SetCursorScreenPos(low);
    ImGui::PushFont(frame.large());
    known ? ImGui::TextUnformatted(figures.c_str()) : ImGui::TextDisabled("%s", figures.c_str());
    ImGui::PopFont();
    const float foot = low.y + (kHeadline_px - 3) * scale;
    ImGui::GetWindowDrawList()->AddText(
        {ImGui::GetItemRectMax().x + kGrid_px * scale, foot - ImGui::GetFontSize()}, ink(theme().faint),
        error.c_str());
  };
  if (known && force.validity != Validity::Valid) {
    const Verdict verdict = force_verdict(force.validity);
    card.rows.push_back({"", verdict.words, verdict.meaning});
  }
  std::vector<GripPart> parts;
  for (const MeasuredQuantity<GripFrame>& q : grip_quantities()) {
    if (!*q.row.label || std::string_view(q.name) == "grip_force_N") continue;
    if (!parts.empty() && std::string_view(parts.back()->row.label) != q.row.label)
      card.rows.push_back(card_row(std::exchange(parts, {}), grip));
    parts.push_back(&q);
  }
  card.rows.push_back(card_row(parts, grip));
  return card;
}

Card finger_card(const char* title, const Touch& shown, const HudContent& content, const ViewState& state) {
  using Groups = MeasuredColumns;
  Card card{.title = title};
  const Estimate& force = shown.force_N;
  if (force.validity != Validity::NotCalibrated) {
    const Verdict verdict = force_verdict(force.validity);
    const bool doubtful = shown.contact && force.validity != Validity::Valid;
    CardRow row{"force", "-"};
    if (has_value(force)) row.words = text("%.3f \xc2\xb1 %.3f N", force.value, force.standard_error);
    card.rows.push_back(std::move(row));
    if (doubtful) card.rows.push_back({"", verdict.words, verdict.meaning});
  }
  for (CardRow& row :
       quantity_rows(shown, content, state, Groups::Shear | Groups::Slipping | Groups::Depth | Groups::Light))
    card.rows.push_back(std::move(row));
  return card;
}

}  // namespace palpate::viz
