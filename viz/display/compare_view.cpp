#include "viz/display/compare_view.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "engine/measure/quantities.h"
#include "viz/look/measures.h"
#include "viz/panels/charts/chart.h"
#include "viz/panels/charts/charts.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"
#include "viz/render/view_state.h"

namespace palpate::viz {
namespace {

constexpr const char* kNames[] = {"A", "B"};
constexpr LineStyle kLines[] = {LineStyle::Solid, LineStyle::Dashed};

ImU32 colour_of(size_t which) {
  return ink(which == 0 ? theme().chosen : theme().second);
}

std::deque<Sample> samples_of(const RecordingCurve& curve, double zero_s) {
  std::deque<Sample> samples;
  for (size_t i = 0; i < curve.points.size(); ++i) {
    const CurvePoint& point = curve.points[i];
    Sample s;
    s.time = point.time_s - zero_s;
    s.position = i;
    s.contact = point.contact;
    s.force_N = point.force_N;
    s.has_depth = point.depth_mm.validity != Validity::NotCalibrated;
    s.depth_mm = point.depth_mm.value;
    s.depth_sd_mm = point.depth_mm.standard_error;
    samples.push_back(s);
  }
  return samples;
}

}  // namespace

CompareLayout compare_layout(VkExtent2D extent, float scale) {
  const double grid = double{kGrid_px} * static_cast<double>(scale), margin = 2 * grid;
  const double width = extent.width, height = extent.height;
  const double heading = 11 * grid, foot = 5 * grid, charts = std::floor(0.36 * height / grid) * grid;
  const double table = std::clamp(std::floor(0.42 * width / grid) * grid, 38 * grid, 72 * grid);
  const double above = height - heading - charts - foot;
  const double image = std::max(1.0, (width - table - 3 * margin) / 2);
  CompareLayout l;
  l.heading = rect_of(margin, grid, width - 2 * margin, heading - grid);
  l.a = rect_of(margin, heading + 3 * grid, image, above - 4 * grid);
  l.b = rect_of(2 * margin + image, heading + 3 * grid, image, above - 4 * grid);
  l.table = rect_of(3 * margin + 2 * image, heading, table - margin, above);
  l.charts = rect_of(0, height - charts - foot, width, charts);
  l.foot = rect_of(0, height - foot, width, foot);
  return l;
}

CompareView::CompareView(gpu::Context& context, const RenderPass& pass, uint32_t frames_in_flight,
                         GLFWwindow* window, float scale, const RecordingCurve& a, const RecordingCurve& b)
    : curves_{&a, &b},
      images_{ImageView(context, pass, frames_in_flight), ImageView(context, pass, frames_in_flight)},
      frame_(std::make_unique<HudFrame>(context, pass, frames_in_flight, window, scale)),
      largest_(compare_largest(a, b)) {
  for (const RecordingCurve* curve : curves_)
    for (const CurvePoint& point : curve->points)
      if (point.contact && has_value(point.depth_mm)) range_mm_ = std::max(range_mm_, point.depth_mm.value);
  range_mm_ = scale_ceiling(std::max(range_mm_, ViewState::kLeastRange_mm));
}

void CompareView::align(const CompareState& state) {
  const bool same = time_ && state.alignment == aligned_.alignment && state.mark == aligned_.mark &&
                    state.offset_s == aligned_.offset_s;
  if (same) return;
  time_.emplace(*curves_[0], *curves_[1], state.alignment, state.mark, state.offset_s);
  aligned_ = state;
  for (size_t i = 0; i < 2; ++i) samples_[i] = samples_of(*curves_[i], clock_s(i));
  from_s_ = std::min(samples_[0].front().time, samples_[1].front().time);
  to_s_ = std::max({samples_[0].back().time, samples_[1].back().time, from_s_ + 1e-3});
}

std::optional<double> CompareView::moment_at(float x, float y) const {
  const auto [left, right] = axis_ends(layout_.charts, frame_->scale());
  if (!inside(layout_.charts, {x, y}) || x < left || x > right) return std::nullopt;
  return from_s_ + (to_s_ - from_s_) * static_cast<double>((x - left) / (right - left));
}

/// The shown picture of a recording, drawn in its rectangle's size; without a frame at that moment the
/// nearest.
void CompareView::picture(size_t which, const CompareState& state) {
  const RecordingCurve& curve = *curves_[which];
  const uint16_t* map = curve.map_of(curve.index_at(state.cursor_s + clock_s(which)));
  Frame& picture = pictures_[which];
  picture.reshape({curve.width, curve.height, 3, 8});
  for (uint32_t y = 0; map && y < curve.height; ++y)
    for (uint32_t x = 0; x < curve.width; ++x) {
      const double value = map[y * curve.width + x];
      const auto colour =
          curve.has_depth
              ? viz::colour_of(state.map, std::min(1.0, value * RecordingCurve::kDepthUnit_mm / range_mm_))
              : std::array<float, 3>{static_cast<float>(value) / 255, static_cast<float>(value) / 255,
                                     static_cast<float>(value) / 255};
      for (uint32_t c = 0; c < 3; ++c)
        picture.set(c, x, y, static_cast<uint32_t>(std::lround(255 * colour[c])));
    }
}

/// In columns where they have room, else one value below another; what is in doubt is said below its row.
void CompareView::table(const std::vector<ComparedValue>& rows, const char* heading, float& y) {
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const float scale = frame_->scale(), left = corner(layout_.table).x, right = far_corner(layout_.table).x;
  const float line = ImGui::GetFontSize() + 7 * scale, column = 126 * scale;
  const bool wide = right - left >= 118 * scale + 3 * column;
  const auto put = [&](float end, ImU32 colour, const std::string& words) {
    list->AddText({end - ImGui::CalcTextSize(words.c_str()).x, y}, colour, words.c_str());
  };
  const auto room_for = [&](float lines) { return y + lines * line <= far_corner(layout_.table).y; };
  const float row_lines = wide ? 1 : 4;
  if (!room_for(1 + row_lines)) return;
  list->AddText({left, y}, ink(theme().faint), heading);
  const std::array<ImU32, 3> inks{colour_of(0), colour_of(1), ink(theme().text)};
  const std::array<const char*, 3> labels{"A", "B", "B - A"};
  for (size_t i = 0; wide && i < 3; ++i)
    put(right - (2 - static_cast<float>(i)) * column, inks[i], labels[i]);
  y += line;
  for (const ComparedValue& row : rows) {
    if (!room_for(row_lines)) return;
    const std::string& name = row.name;
    const std::string shown = name.starts_with("largest ") ? name.substr(8) : name;
    list->AddText({left, y}, ink(theme().text), shown.c_str());
    const std::array<Estimate, 3> values{row.a, row.b, row.difference};
    std::string doubt = row.doubt;
    for (size_t i = 0; i < 3; ++i) {
      Estimate value = values[i];
      if (i < 2 && has_value(value) && value.validity != Validity::Valid)
        doubt += std::string(doubt.empty() ? "" : "; ") + labels[i] + " " + to_string(value.validity);
      if (has_value(value)) value.validity = Validity::Valid;
      if (!wide) {
        y += line;
        list->AddText({left + 12 * scale, y}, inks[i], labels[i]);
      }
      put(wide ? right - (2 - static_cast<float>(i)) * column : right, ink(theme().text),
          value_words(value, row.unit, row.has_error, i == 2));
    }
    y += line;
    if (doubt.empty() || !room_for(1)) continue;
    list->AddText({left + 12 * scale, y}, ink(theme().doubtful), shortened(doubt, right - left).c_str());
    y += line;
  }
  y += 8 * scale;
}

void CompareView::words(const CompareState& state) {
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const float scale = frame_->scale();
  const ImVec2 low = corner(layout_.heading);
  const float room = size_of(layout_.heading).x;
  const std::string headline = headline_of(largest_);
  ImFont* large = frame_->large();
  ImGui::PushFont(large);
  const bool fits = ImGui::CalcTextSize(headline.c_str()).x <= room;
  if (fits) list->AddText({low.x, low.y}, ink(theme().text), headline.c_str());
  ImGui::PopFont();
  if (!fits) list->AddText({low.x, low.y + 8 * scale}, ink(theme().text), shortened(headline, room).c_str());
  const std::string aligned =
      text("aligned by the %s", to_string(state.alignment)) +
      (state.offset_s != 0 ? text(", B moved by %+.3f s", state.offset_s) : std::string()) +
      text(", shown at %+.2f s", state.cursor_s);
  list->AddText({low.x, low.y + 44 * scale}, ink(theme().faint), shortened(aligned, room).c_str());
  for (size_t i = 0; i < 2; ++i) {
    const ViewRect& at = i == 0 ? layout_.a : layout_.b;
    const std::string name = std::string(kNames[i]) + "  " + curves_[i]->input;
    const ImVec2 place{corner(at).x, corner(at).y - ImGui::GetFontSize() - 5 * scale};
    // The end of a path says more than its begin.
    std::string shown = name;
    for (size_t cut = 4; ImGui::CalcTextSize(shown.c_str()).x > size_of(at).x && cut < name.size(); ++cut)
      shown = std::string(kNames[i]) + "  .." + name.substr(cut);
    list->AddText(place, colour_of(i), shown.c_str());
    const ViewRect inner = fitted(at, aspect_of(*curves_[i]));
    list->AddRect(corner(inner), far_corner(inner), colour_of(i), 0, 0, 2 * scale);
    if (curves_[i]->has_depth)
      shadowed_text(list,
                    {corner(inner).x + 6 * scale, far_corner(inner).y - ImGui::GetFontSize() - 6 * scale},
                    IM_COL32_WHITE, text("0 to %.3g mm deep", range_mm_));
  }
  float y = corner(layout_.table).y;
  table(largest_, "largest", y);
  table(compare_at(*curves_[0], *curves_[1], *time_, state.cursor_s), "at the cursor", y);
}

void CompareView::charts(const CompareState& state) {
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const float scale = frame_->scale(), row = ImGui::GetFontSize();
  const auto [left, right] = axis_ends(layout_.charts, scale);
  const float top = corner(layout_.charts).y, axis = row + 6 * scale;
  const float bottom = far_corner(layout_.charts).y - axis;
  const double length = to_s_ - from_s_;
  const auto value_of = [](const Sample& s, bool force) {
    return force
               ? s.force_N
               : Estimate{s.depth_mm, s.depth_sd_mm, s.has_depth ? Validity::Valid : Validity::NotCalibrated};
  };
  const auto has = [&](bool force) {
    return std::ranges::any_of(samples_, [&](const auto& samples) {
      return std::ranges::any_of(samples,
                                 [&](const Sample& s) { return s.contact && has_value(value_of(s, force)); });
    });
  };
  std::vector<bool> kinds;
  for (const bool force : {true, false})
    if (has(force)) kinds.push_back(force);
  const float each = (bottom - top) / static_cast<float>(std::max<size_t>(kinds.size(), 1));
  const float head = row + 4 * scale;
  for (size_t k = 0; k < kinds.size(); ++k) {
    const bool force = kinds[k];
    Chart chart(list, {left, top + static_cast<float>(k) * each + head},
                {right, top + static_cast<float>(k + 1) * each - 3 * scale}, to_s_, length, scale);
    double most = force ? 0.02 : 0.05;
    for (const auto& samples : samples_)
      for (const Sample& s : samples)
        if (const Estimate e = value_of(s, force); s.contact && has_value(e) && std::isfinite(e.value))
          most = std::max(most, e.value + 2 * e.standard_error);
    const int ticks = std::max(1, static_cast<int>((each - head) / (1.7f * row)));
    chart.begin(0, scale_ceiling(1.02 * most), tick_step(0, scale_ceiling(1.02 * most), ticks));
    for (size_t i = 0; i < 2; ++i) {
      if (force)
        chart.band(
            samples_[i],
            [&](const Sample& s) -> std::optional<Chart::Ends> {
              const Estimate e = value_of(s, true);
              if (!has_value(e)) return std::nullopt;
              return Chart::Ends{e.value - 2 * e.standard_error, e.value + 2 * e.standard_error};
            },
            (colour_of(i) & ~IM_COL32_A_MASK) | IM_COL32(0, 0, 0, 50));
      chart.line(
          samples_[i],
          [&](const Sample& s) -> std::optional<double> {
            const Estimate e = value_of(s, force);
            if (e.validity == Validity::NotCalibrated) return std::nullopt;
            return s.contact && has_value(e) ? e.value : 0;
          },
          colour_of(i), kLines[i]);
    }
    const float x = chart.at(state.cursor_s, 0).x;
    list->AddLine({x, chart.low().y}, {x, chart.high().y}, ink(theme().slips), 1.6f * scale);
    chart.unclip();
    chart.title(force ? "force [N], bands: 95 %" : "deepest [mm]", ink(theme().text));
    chart.title("A", colour_of(0));
    chart.title("B (dashed)", colour_of(1));
    chart.frame();
  }
  Chart(list, {left, bottom}, {right, bottom + axis}, to_s_, length, scale).time_ticks("time [s]");
}

void CompareView::record(VkCommandBuffer cmd, VkExtent2D extent, CompareState& state,
                         const std::function<void(const CompareLayout&)>& content,
                         const std::function<void()>& begin_pass) {
  use_theme(state.light);
  layout_ = compare_layout(extent, frame_->scale());
  align(state);
  state.cursor_s = std::clamp(state.cursor_s, from_s_, to_s_);
  for (size_t i = 0; i < 2; ++i) picture(i, state);
  frame_->begin(extent);
  words(state);
  charts(state);
  if (content) content(layout_);
  begin_pass();
  for (size_t i = 0; i < 2; ++i)
    images_[i].draw(cmd, pictures_[i], {}, fitted(i == 0 ? layout_.a : layout_.b, aspect_of(*curves_[i])),
                    extent);
  frame_->draw(cmd);
}

}  // namespace palpate::viz
