#include "viz/panels/headline.h"

#include <imgui.h>

#include <cmath>

#include "engine/measure/quantities.h"
#include "viz/look/measures.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

std::string words_of(const Estimate& value, int places, const char* unit) {
  std::string words = text("%.*f", places, value.value);
  if (value.standard_error > 0) words += text(" \xc2\xb1 %.*f", places, value.standard_error);
  return words + " " + unit;
}

std::string time_of(double time_s, bool separate) {
  return separate ? "" : text(" at %.2f s", time_s);
}

std::string state_of(const Estimate& value) {
  return value.validity == Validity::Valid ? "" : std::string(", ") + to_string(value.validity);
}

}  // namespace

void Headline::take(std::optional<Peak>& peak, const Estimate& value, double time_s) {
  if (!has_value(value) || !std::isfinite(value.value)) return;
  const bool valid = value.validity == Validity::Valid;
  const bool was = peak && peak->value.validity == Validity::Valid;
  if (!peak || (valid == was ? value.value > peak->value.value : valid)) peak = {value, time_s};
}

void Headline::follow(const Touch& touch) {
  if (!touch.contact) return;
  const double time_s = 1e-9 * static_cast<double>(touch.time_ns);
  const bool by_layer = touch.traction && touch.force_N.validity == Validity::NotCalibrated;
  take(force_N_, by_layer ? touch.traction->fz_N : touch.force_N, time_s);
  if (touch.surface)
    take(depth_mm_, {touch.surface->depth_max_mm, touch.surface->depth_sd_mm, touch.surface->validity},
         time_s);
  take(area_px_, {static_cast<double>(touch.area_px), 0, Validity::Valid}, time_s);
}

std::string Headline::answer(bool separate) const {
  if (force_N_) return words_of(force_N_->value, 3, "N") + time_of(force_N_->time_s, separate);
  if (depth_mm_) return words_of(depth_mm_->value, 3, "mm") + " deep" + time_of(depth_mm_->time_s, separate);
  if (area_px_) return text("%.0f px", area_px_->value.value) + time_of(area_px_->time_s, separate);
  return "nothing touches";
}

std::string Headline::rest(bool separate) const {
  const char* largest = separate ? "" : "largest ";
  if (force_N_) {
    std::string words = std::string(largest) + "force" + state_of(force_N_->value);
    if (depth_mm_)
      words += ";  " + std::string(largest) + "depth " + words_of(depth_mm_->value, 3, "mm") +
               time_of(depth_mm_->time_s, separate) + state_of(depth_mm_->value);
    return words;
  }
  if (depth_mm_) return std::string(largest) + "depth" + state_of(depth_mm_->value);
  return area_px_ ? std::string(largest) + "area in contact; force and depth are not calibrated" : "";
}

void Headline::draw(const HudFrame& frame, const Layout& layout, bool separate) const {
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const float scale = frame.scale(), margin = kGrid_px * scale;
  const ImVec2 low = corner(layout.headline), high = far_corner(layout.headline);
  const float room = high.x - low.x - 3 * margin;
  const float y = low.y + margin;
  ImGui::PushFont(frame.large());
  const std::string large = shortened(answer(separate), room);
  list->AddText({low.x + 2 * margin, y}, ink(theme().text), large.c_str());
  ImGui::PopFont();
  const std::string small = shortened(rest(separate), room);
  list->AddText({low.x + 2 * margin, high.y - ImGui::GetFontSize() - margin / 2}, ink(theme().faint),
                small.c_str());
}

}  // namespace palpate::viz
