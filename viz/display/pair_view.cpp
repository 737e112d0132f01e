#include "viz/display/pair_view.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/gpu/context.h"
#include "engine/measure/quantities.h"
#include "engine/pipeline/surface_map.h"
#include "viz/live/history.h"
#include "viz/look/measures.h"
#include "viz/panels/charts/chart.h"
#include "viz/panels/charts/charts.h"
#include "viz/panels/numbers/grip_cards.h"
#include "viz/render/annotations.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"
#include "viz/render/layout.h"
#include "viz/render/mesh_places.h"

namespace palpate::viz {
namespace {

constexpr std::array<const char*, 2> kNames{"left", "right"};
constexpr int kBandAlpha = 70;
constexpr double kLongestSilence_s = 1;

}  // namespace

PairLayout pair_layout(VkExtent2D extent, float scale, const std::array<FrameFormat, 2>& formats,
                       const std::array<bool, 2>& has_surface, bool charts_wanted) {
  const double grid = double{kGrid_px} * static_cast<double>(scale);
  const double width = extent.width, height = extent.height;
  const double foot = 5 * grid, head = 4 * grid;
  const double panel =
      std::min(std::clamp(std::floor(0.27 * width / grid) * grid, 34 * grid, 60 * grid), width / 2);
  PairLayout l;
  l.has_charts = charts_wanted && height > 60 * grid;
  const double charts = l.has_charts ? std::floor(0.36 * height / grid) * grid : 0;
  const double left = width - panel, above = height - foot - charts;
  const double each = std::floor(left / 2 / grid) * grid;
  for (size_t i = 0; i < 2; ++i) {
    const double x = static_cast<double>(i) * each;
    l.heads[i] = rect_of(x + grid, 0, each - 2 * grid, head);
    // Where there is no surface the image has its place.
    const double image = has_surface[i] ? std::floor(0.34 * (above - head) / grid) * grid : above - head;
    l.surfaces[i] = rect_of(x, head, has_surface[i] ? each : 1, has_surface[i] ? above - head - image : 1);
    l.images[i] = fitted(rect_of(x + grid, above - image + grid / 2, each - 2 * grid, image - grid),
                         aspect_of(formats[i]));
  }
  l.panel = rect_of(left, 0, panel, height - foot);
  l.charts = rect_of(0, above, left, charts);
  l.foot = rect_of(0, height - foot, width, foot);
  return l;
}

PairView::PairView(gpu::Context& context, const RenderPass& pass, const std::array<Sensor, 2>& sensors,
                   uint32_t frames_in_flight, GLFWwindow* window, float scale)
    : context_(context),
      pass_(pass),
      sensors_(sensors),
      frames_in_flight_(frames_in_flight),
      window_(window),
      scale_(scale),
      frame_(std::make_unique<HudFrame>(context, pass, frames_in_flight, window, scale)) {
  for (size_t i = 0; i < 2; ++i) {
    surfaces_[i] = std::make_unique<SurfaceView>(context, pass, frames_in_flight);
    images_[i] = std::make_unique<ImageView>(context, pass, frames_in_flight);
  }
  state_.fit_to(sensors[0]);
  state_.quantity = Quantity::Depth;
}

/// Fonts of another size are made anew, between two pictures.
void PairView::fit_text() {
  const float wanted = scale_ * state_.text_scale;
  if (std::abs(frame_->scale() / wanted - 1) < 1e-3f) return;
  frame_.reset();  // there is one at a time: it owns the window's callbacks
  frame_ = std::make_unique<HudFrame>(context_, pass_, frames_in_flight_, window_, wanted);
}

void PairView::follow(const GripFrame& grip) {
  GripSample sample;
  sample.time = 1e-9 * static_cast<double>(grip.time_ns);
  if (!samples_.empty() && sample.time <= samples_.back().time) samples_.clear();  // a loop starts anew
  sample.gap = !samples_.empty() && sample.time - samples_.back().time > kLongestSilence_s;
  if (grip.grip) {
    const Grip& g = *grip.grip;
    sample.force_N = g.force_N;
    sample.imbalance_N = g.imbalance_N;
    sample.thickness_mm = g.thickness_mm;
    sample.load_N = {g.load_x_N, g.load_y_N, g.load_z_N};
    sample.gripped = has_value(g.force_N);
  }
  // A frame alone says nothing of the grip; without any pair the curves end.
  if (!grip.grip && !sample.gap) return;
  samples_.push_back(sample);
  while (samples_.back().time - samples_.front().time > History::kLongest_s) samples_.pop_front();
}

void PairView::follow(const Touch& touch) {
  state_.follow(touch, longest_side_mm_);
  const double shear_N = std::hypot(touch.shear_x_N.value, touch.shear_y_N.value);
  if (has_value(touch.shear_x_N) && std::isfinite(shear_N)) full_shear_N_ = std::max(full_shear_N_, shear_N);
}

void PairView::describe_finger(size_t which, const PairContent& shown) {
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const float scale = frame_->scale();
  const ShownTouch& finger = shown.fingers[which];
  const ViewRect& head = layout_.heads[which];
  const float y = corner(head).y + (size_of(head).y - ImGui::GetFontSize()) / 2;
  float x = corner(head).x;
  const auto put = [&](const std::string& words, ImU32 colour) {
    const std::string seen = shortened(words, far_corner(head).x - x);
    list->AddText({x, y}, colour, seen.c_str());
    x += ImGui::CalcTextSize(seen.c_str()).x + 10 * scale;
  };
  put(kNames[which], ink(theme().text));
  if (finger.state.empty() && finger.frame)
    put(text("%s   %.1f/s", sensors_[which].name.c_str(), finger.measured_per_s), ink(theme().faint));
  else
    put(finger.state.empty() ? "no frames yet" : finger.state,
        ink(finger.state.empty() ? theme().faint : theme().wrong));
  if (!finger.frame) return;
  const FrameFormat& format = finger.frame->format;
  const ViewRect& view = layout_.surfaces[which];
  if (view.width > 1) {
    const bool roomy = is_roomy(view, scale);
    std::vector<PlacedText> placed;
    if (state_.axes && roomy) placed = draw_axes(list, eyes_[which], view, half_mm_[which], style(), scale);
    if (state_.contacts)
      draw_touch(list, {eyes_[which], view, half_mm_[which]}, finger.tared, format, {.scale = scale},
                 std::move(placed));
    roomy ? draw_colour_bar(list, view, style(), state_.automatic_range, scale)
          : draw_low_colour_bar(list, view, style(), scale);
  }
  const ViewRect& image = layout_.images[which];
  list->AddRect({corner(image).x - 1, corner(image).y - 1},
                {far_corner(image).x + 1, far_corner(image).y + 1}, ink(theme().frame));
  draw_touch(
      list, image, finger.tared, format,
      {.contacts = state_.contacts, .skin = state_.skin, .full_shear_N = full_shear_N_, .scale = scale});
}

void PairView::describe_numbers(const PairContent& shown) {
  begin_panel("fingers", layout_.panel, frame_->scale());
  std::vector<Card> cards;
  if (shown.recording || !shown.failed.empty()) {
    Card card{.title = "recording"};
    card.rows.push_back(shown.failed.empty()
                            ? CardRow{"", "RECORDING (W ends it)", Meaning::Wrong}
                            : CardRow{"", "RECORDING FAILED: " + shown.failed, Meaning::Wrong});
    cards.push_back(std::move(card));
  }
  cards.push_back(grip_card(*frame_, shown.grip.value_or(GripFrame{}), shown.zeroed));
  for (size_t i = 0; i < 2; ++i) {
    const ShownTouch& finger = shown.fingers[i];
    if (!finger.frame) continue;
    const bool has_surface = surface_of(*finger.result).buffer != nullptr;
    const HudContent content{sensors_[i], *finger.frame, *finger.touch, has_surface, nullptr, "", {0, 0}};
    cards.push_back(finger_card(kNames[i], finger.tared, content, state_));
  }
  draw_cards(*frame_, cards);
  ImGui::End();
}

void PairView::draw_plot(const Plot& plot, Chart chart, int ticks) const {
  const auto each_interval = [&](const auto& use) {
    for (const GripSample& s : samples_)
      for (const Curve& curve : plot.curves)
        if (const auto ends = interval(curve.value(s)); ends && chart.visible(s.time)) use(*ends);
  };
  // What is never near zero has an axis of its own range.
  double from = plot.from_zero ? 0 : INFINITY;
  if (!plot.from_zero) each_interval([&](const Chart::Ends& ends) { from = std::min(from, ends.first); });
  if (!std::isfinite(from)) from = 0;
  AxisRange range;
  each_interval([&](const Chart::Ends& ends) {
    range.take(std::pair{ends.first - from, ends.second - from});
  });
  const double step = range.round(plot.least, ticks);
  chart.begin(from + range.least, from + range.most, step);
  for (const Curve& curve : plot.curves) {
    if (curve.band)
      chart.band(
          samples_, [&](const GripSample& s) { return interval(curve.value(s)); },
          ink(curve.colour, kBandAlpha));
    chart.line(
        samples_,
        [&](const GripSample& s) {
          const Estimate e = curve.value(s);
          return has_value(e) ? std::optional(e.value) : std::nullopt;
        },
        ink(curve.colour), curve.line);
  }
  chart.unclip();
  for (const Curve& curve : plot.curves) chart.title(curve.title, ink(curve.colour));
  chart.frame();
}

std::vector<PairView::Plot> PairView::plots() const {
  const Theme& t = theme();
  std::vector<Plot> all = {
      {{{"grip force [N], band: 95 %", t.chosen, LineStyle::Solid, true,
         [](const auto& s) { return s.force_N; }},
        {"imbalance (dashed)", t.third, LineStyle::Dashed, false,
         [](const auto& s) { return s.imbalance_N; }}},
       0.05,
       true},
      {{{"load [N]: x", t.second, LineStyle::Solid, false, [](const auto& s) { return s.load_N[0]; }},
        {"y (dashed)", t.third, LineStyle::Dashed, false, [](const auto& s) { return s.load_N[1]; }},
        {"z (dotted)", t.depth, LineStyle::Dotted, false, [](const auto& s) { return s.load_N[2]; }}},
       0.05,
       true},
      {{{"thickness [mm], band: 95 %", t.depth, LineStyle::Solid, true,
         [](const auto& s) { return s.thickness_mm; }}},
       0.2,
       false}};
  // What this grip never has leaves its room to the others.
  for (size_t k = all.size(); k-- > 1;)
    if (std::ranges::none_of(samples_,
                             [&](const GripSample& s) { return has_value(all[k].curves[0].value(s)); }))
      all.erase(all.begin() + static_cast<std::ptrdiff_t>(k));
  return all;
}

void PairView::describe_charts() const {
  if (!layout_.has_charts) return;
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const float scale = frame_->scale(), row = ImGui::GetFontSize(), head = row + 4 * scale;
  const auto [left, right] = axis_ends(layout_.charts, scale);
  const float top = corner(layout_.charts).y, axis = row + 6 * scale;
  const float bottom = far_corner(layout_.charts).y - axis;
  const double span_s = state_.chart_span_s,
               end_s = samples_.empty() ? span_s : std::max(samples_.back().time, span_s);
  std::vector<Plot> shown = plots();
  const auto possible = static_cast<size_t>(std::max(1.0f, (bottom - top) / (3.2f * row)));
  if (shown.size() > possible) shown.resize(possible);
  const float each = (bottom - top) / static_cast<float>(shown.size());
  const int ticks = std::max(1, static_cast<int>((each - head) / (1.7f * row)));
  for (size_t k = 0; k < shown.size(); ++k) {
    const float y = top + static_cast<float>(k) * each;
    draw_plot(shown[k], {list, {left, y + head}, {right, y + each - 3 * scale}, end_s, span_s, scale}, ticks);
  }
  Chart(list, {left, bottom}, {right, bottom + axis}, end_s, span_s, scale).time_ticks("time [s]");
}

void PairView::record(VkCommandBuffer cmd, VkExtent2D extent, const PairContent& shown, uint32_t mesh_columns,
                      const std::function<void(const PairLayout&)>& content,
                      const std::function<void()>& begin_pass) {
  use_theme(state_.light_theme);
  fit_text();
  std::array<FrameFormat, 2> formats;
  std::array<bool, 2> has_surface{};
  for (size_t i = 0; i < 2; ++i) {
    const ShownTouch& finger = shown.fingers[i];
    const ShownTouch& other = shown.fingers[1 - i];
    const ShownTouch& known = finger.frame || !other.frame ? finger : other;  // places do not jump
    if (known.frame) formats[i] = known.frame->format;
    has_surface[i] = known.frame && surface_of(*known.result).buffer != nullptr;
    longest_side_mm_ = std::max(longest_side_mm_,
                                std::max(formats[i].width, formats[i].height) * sensors_[i].pitch_mm_per_px);
  }
  const float scale = frame_->scale();
  layout_ = pair_layout(extent, scale, formats, has_surface, state_.charts);
  for (size_t i = 0; i < 2; ++i) {
    const ViewRect& view = layout_.surfaces[i];
    half_mm_[i] =
        surface_half_size_mm(formats[i].width, formats[i].height, sensors_[i].pitch_mm_per_px, style());
    eyes_[i] = place(state_.camera, half_mm_[i], view.aspect(), margins_of(view, scale));
  }
  frame_->begin(extent);
  for (size_t i = 0; i < 2; ++i) describe_finger(i, shown);
  describe_numbers(shown);
  describe_charts();
  if (content) content(layout_);
  map_to_picture_barrier(context_, cmd);
  begin_pass();
  for (size_t i = 0; i < 2; ++i) {
    const ShownTouch& finger = shown.fingers[i];
    if (!finger.frame) continue;
    const SurfaceMap& map = surface_of(*finger.result);
    if (map.buffer)
      surfaces_[i]->draw(cmd, map, finger.touch->surface->depth_offset_mm, sensors_[i].pitch_mm_per_px,
                         eyes_[i], style(), layout_.surfaces[i], mesh_columns, {},
                         dented_part(*finger.touch, finger.frame->format.width, finger.frame->format.height));
    images_[i]->draw(cmd, *finger.frame, map, layout_.images[i], extent);
  }
  frame_->draw(cmd);
}

}  // namespace palpate::viz
