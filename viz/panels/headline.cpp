#include "viz/panels/headline.h"

#include <imgui.h>

#include <cmath>

#include "capture/run/compare/compare_recordings.h"
#include "capture/run/largest.h"
#include "engine/measure/quantities.h"
#include "viz/look/measures.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

/// Without its state, which is said behind it.
std::string words_of(Estimate value, const char* unit) {
  value.validity = Validity::Valid;
  return value_words(value, unit, true);
}

std::string time_of(double time_s, bool separate) {
  return separate ? "" : text(" at %.2f s", time_s);
}

}  // namespace

void Headline::Peak::take(const Estimate& value, double time_s) {
  if (!has_value(value) || !std::isfinite(value.value)) return;
  if (!any || value.value > any->value.value) any = {value, time_s};
  if (value.validity == Validity::Valid && (!valid || value.value > valid->value.value))
    valid = {value, time_s};
}

void Headline::follow(const Touch& touch, bool separate) {
  if (separate) *this = {};
  if (!touch.contact) return;
  const double time_s = 1e-9 * static_cast<double>(touch.time_ns);
  force_N_.take(force_of_touch(touch), time_s);
  if (touch.surface)
    depth_mm_.take({touch.surface->depth_max_mm, touch.surface->depth_sd_mm, touch.surface->validity},
                   time_s);
  area_px_.take({static_cast<double>(touch.area_px), 0, Validity::Valid}, time_s);
}

std::string Headline::answer(bool separate) const {
  const auto at = [separate](const Moment& moment) { return time_of(moment.time_s, separate); };
  if (force_N_.any) return words_of(force_N_.any->value, "N") + at(*force_N_.any);
  if (depth_mm_.any) return words_of(depth_mm_.any->value, "mm") + " deep" + at(*depth_mm_.any);
  if (area_px_.any) return text("%.0f px", area_px_.any->value.value) + at(*area_px_.any);
  return "nothing touches";
}

/// Why the largest value may be wrong, and the largest that is not in doubt.
std::string Headline::doubt(const Peak& peak, const char* unit, bool separate) {
  if (peak.any->value.validity == Validity::Valid) return {};
  std::string words = std::string(", ") + to_string(peak.any->value.validity);
  if (peak.valid)
    words += "; valid " + words_of(peak.valid->value, unit) + time_of(peak.valid->time_s, separate);
  return words;
}

std::string Headline::rest(bool separate) const {
  const std::string largest = separate ? "" : "largest ";
  if (force_N_.any) {
    std::string words = largest + "force" + doubt(force_N_, "N", separate);
    if (depth_mm_.any)
      words += ";  " + largest + "depth " + words_of(depth_mm_.any->value, "mm") +
               time_of(depth_mm_.any->time_s, separate) + doubt(depth_mm_, "mm", separate);
    return words;
  }
  if (depth_mm_.any) return largest + "depth" + doubt(depth_mm_, "mm", separate);
  return area_px_.any ? largest + "area in contact; force and depth are not calibrated" : "";
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
