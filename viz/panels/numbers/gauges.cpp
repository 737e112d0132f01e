#include "viz/panels/numbers/gauges.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/measure/quantities.h"
#include "viz/look/measures.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {

void draw_force_bar(ImDrawList* list, ImVec2 low, ImVec2 high, const ForceRange& range,
                    const std::optional<Estimate>& force, float scale) {
  const double full_N = 1.1 * range.most_N;
  const auto at = [&](double force_N) {
    return low.x + static_cast<float>(std::clamp(force_N / full_N, 0.0, 1.0)) * (high.x - low.x);
  };
  list->AddRectFilled(low, high, ink(theme().field), scale);
  if (force) {
    list->AddRectFilled(low, {at(force->value), high.y}, ink(theme().chosen), scale);
    const float from = at(force->value - 2 * force->standard_error);
    const float to = at(force->value + 2 * force->standard_error), y = (low.y + high.y) / 2;
    for (const auto& [colour, width] : {std::pair{theme().panel, 4 * scale}, {theme().text, 2 * scale}}) {
      list->AddLine({from, y}, {to, y}, ink(colour), width);  // with a rim: it is seen on the bar too
      for (const float end : {from, to}) list->AddLine({end, low.y}, {end, high.y}, ink(colour), width / 2);
    }
    if (force->value > full_N)
      list->AddTriangleFilled({high.x - (high.y - low.y), low.y}, {high.x, y},
                              {high.x - (high.y - low.y), high.y}, ink(theme().text));
  }
  for (const double end_N : {range.least_N, range.most_N})
    list->AddLine({at(end_N), low.y - 2 * scale}, {at(end_N), high.y + 2 * scale}, ink(theme().limit),
                  2 * scale);
}

void draw_shear_dial(ImDrawList* list, ImVec2 low, ImVec2 high, const Estimate& x, const Estimate& y,
                     double limit_N, Slip slip, float scale) {
  constexpr float kLimit = 0.84f;  // of the dial: what is beyond it still has room
  const ImVec2 middle{(low.x + high.x) / 2, (low.y + high.y) / 2};
  const float half = (high.x - low.x) / 2, radius = kLimit * half;
  list->AddCircleFilled(middle, radius, ink(theme().field), 48);
  list->AddLine({middle.x - radius, middle.y}, {middle.x + radius, middle.y}, ink(theme().frame));
  list->AddLine({middle.x, middle.y - radius}, {middle.x, middle.y + radius}, ink(theme().frame));
  const bool known = has_value(x) && has_value(y);
  list->AddCircle(middle, radius, known && limit_N > 0 ? ink(theme().limit) : ink(theme().frame), 48,
                  1.5f * scale);
  if (!known) return;
  const double length_N = std::hypot(x.value, y.value);
  const double unit_N = limit_N > 0 ? limit_N / radius : length_N / radius;  // newtons a pixel
  if (!(unit_N > 0)) return;
  // What lies beyond the dial stays at its edge.
  const double shown = std::min(1.0, half / std::max(length_N / unit_N, 1e-9)) / unit_N;
  const ImVec2 tip{middle.x + static_cast<float>(x.value * shown),
                   middle.y + static_cast<float>(y.value * shown)};
  const Rgb colour = theme().of(slip_verdict(slip).meaning);
  list->AddLine(middle, tip, ink(colour), 3 * scale);
  list->AddCircleFilled(tip, 3.5f * scale, ink(colour));
  const double error_N = std::max(x.standard_error, y.standard_error);
  if (!std::isfinite(error_N)) return;
  list->PushClipRect(low, high, true);  // it ends with the dial
  list->AddCircle(tip, static_cast<float>(std::min<double>(2 * error_N / unit_N, half)), ink(theme().text), 0,
                  scale);
  list->PopClipRect();
}

void draw_level(ImDrawList* list, ImVec2 low, ImVec2 high, const std::optional<lump::PadTilt>& tilt,
                float scale) {
  constexpr float kMost_deg = 7;
  const ImVec2 middle{(low.x + high.x) / 2, (low.y + high.y) / 2};
  const float half = (high.x - low.x) / 2, degree = half / kMost_deg;
  list->AddCircleFilled(middle, half, ink(theme().field), 48);
  list->AddLine({middle.x - half, middle.y}, {middle.x + half, middle.y}, ink(theme().frame));
  list->AddLine({middle.x, middle.y - half}, {middle.x, middle.y + half}, ink(theme().frame));
  for (const float ring_deg : {2.0f, 5.0f})
    list->AddCircle(middle, ring_deg * degree, tilt ? ink(theme().limit) : ink(theme().frame), 48, scale);
  if (!tilt) return;
  // What lies beyond the dial stays at its edge.
  const double shown = std::min(1.0, static_cast<double>(kMost_deg) / std::max(tilt->size_deg(), 1e-9));
  const ImVec2 bubble{middle.x - degree * static_cast<float>(shown * tilt->x_deg),
                      middle.y - degree * static_cast<float>(shown * tilt->y_deg)};
  const Rgb colour = theme().of(tilt->size_deg() > 5 ? Meaning::Doubtful : Meaning::Valid);
  list->PushClipRect(low, high, true);  // it ends with the dial
  list->AddCircle(bubble, degree * static_cast<float>(std::max(tilt->x_sd_deg, tilt->y_sd_deg)),
                  ink(theme().text), 0, scale);
  list->AddCircleFilled(bubble, 3.5f * scale, ink(colour));
  list->PopClipRect();
}

}  // namespace palpate::viz
