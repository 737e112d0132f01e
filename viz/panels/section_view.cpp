// The section line as it is drawn and dragged; its measurements are in section.cpp.
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "viz/panels/section.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"
#include "viz/render/view_state.h"

namespace palpate::viz {
namespace {

constexpr ImU32 kLine = IM_COL32(255, 255, 255, 255);
constexpr ImU32 kShadow = IM_COL32(0, 0, 0, 190);
constexpr float kReach_px = 11;  // of the mouse around an end

ImVec2 on_image(const ViewRect& r, double x, double y) {
  return {static_cast<float>(r.x + x * r.width), static_cast<float>(r.y + y * r.height)};
}
Vec3 world(double x, double y, const Vec3& half_mm, double z = 0) {
  return {(2 * x - 1) * half_mm.x, (1 - 2 * y) * half_mm.y, z};
}
std::optional<ImVec2> on_surface(const Eye& eye, const ViewRect& view, const Vec3& at) {
  const Projected p = eye.project(at);
  if (!p.in_front) return std::nullopt;
  return ImVec2{static_cast<float>(view.x + p.x * view.width),
                static_cast<float>(view.y + p.y * view.height)};
}

void end_mark(ImDrawList* list, ImVec2 at, const char* letter, float scale) {
  list->AddCircleFilled(at, 8 * scale, kShadow);
  list->AddCircleFilled(at, 7 * scale, kLine);
  const ImVec2 size = ImGui::CalcTextSize(letter);
  list->AddText({at.x - size.x / 2, at.y - size.y / 2}, IM_COL32(10, 12, 16, 255), letter);
}

/// Where on the rest level the mouse points, as fractions of the frame; none where it points past it.
std::optional<std::pair<double, double>> under_mouse(const Eye& eye, const ViewRect& view,
                                                     const Vec3& half_mm, ImVec2 mouse) {
  const Vec3 ray = eye.ray((static_cast<double>(mouse.x) - view.x) / view.width,
                           (static_cast<double>(mouse.y) - view.y) / view.height);
  if (std::abs(ray.z) < 1e-6) return std::nullopt;
  const double t = -eye.position.z / ray.z;
  if (t <= 0) return std::nullopt;
  const Vec3 p = eye.position + ray * t;
  return std::pair{0.5 + 0.5 * p.x / half_mm.x, 0.5 - 0.5 * p.y / half_mm.y};
}

}  // namespace

void draw_section(ImDrawList* list, const ViewRect& rect, const SectionLine& line, float scale) {
  list->PushClipRect(corner(rect), far_corner(rect), true);
  const ImVec2 a = on_image(rect, line.x0, line.y0), b = on_image(rect, line.x1, line.y1);
  list->AddLine(a, b, kShadow, 3.5f * scale);
  list->AddLine(a, b, kLine, 1.4f * scale);
  end_mark(list, a, "A", scale);
  end_mark(list, b, "B", scale);
  list->PopClipRect();
}

void draw_section(ImDrawList* list, const ViewRect& view, const Eye& eye, const SectionLine& line,
                  const Profile& profile, const Vec3& half_mm, const SurfaceStyle& style, float scale) {
  if (profile.depth_mm.size() < 2) return;
  list->PushClipRect(corner(view), far_corner(view), true);
  std::vector<ImVec2> points;
  const size_t count = profile.depth_mm.size();
  for (size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(count - 1);
    const double x = line.x0 + t * (line.x1 - line.x0), y = line.y0 + t * (line.y1 - line.y0);
    const auto p = on_surface(eye, view, world(x, y, half_mm, -profile.depth_mm[i] * style.exaggeration));
    if (!p) continue;
    if (points.empty() || i + 1 == count || std::hypot(p->x - points.back().x, p->y - points.back().y) >= 2)
      points.push_back(*p);
  }
  const int n = static_cast<int>(points.size());
  list->AddPolyline(points.data(), n, kShadow, 0, 3.5f * scale);
  list->AddPolyline(points.data(), n, kLine, 0, 1.5f * scale);
  if (const auto a = on_surface(eye, view, world(line.x0, line.y0, half_mm))) end_mark(list, *a, "A", scale);
  if (const auto b = on_surface(eye, view, world(line.x1, line.y1, half_mm))) end_mark(list, *b, "B", scale);
  list->PopClipRect();
}

bool SectionMouse::follow(SectionLine& line, const ViewRect& image, const ViewRect& view, const Eye* eye,
                          const Vec3& half_mm, float scale) {
  const ImGuiIO& io = ImGui::GetIO();
  const ImVec2 mouse = io.MousePos;
  const auto place = [&]() -> std::optional<std::pair<double, double>> {
    if (on_image_)
      return std::pair{static_cast<double>(mouse.x - static_cast<float>(image.x)) / image.width,
                       static_cast<double>(mouse.y - static_cast<float>(image.y)) / image.height};
    return eye ? under_mouse(*eye, view, half_mm, mouse) : std::nullopt;
  };
  if (held_ == Held::Nothing) {
    if (!ImGui::IsMouseClicked(ImGuiMouseButton_Left)) return false;
    on_image_ = inside(image, mouse);
    // Panels above the surface come first; the image lies in one that has no controls.
    if (!on_image_ && (!eye || !inside(view, mouse) || io.WantCaptureMouse)) return false;
    const auto at = [&](double x, double y) {
      return on_image_ ? std::optional(on_image(image, x, y)) : on_surface(*eye, view, world(x, y, half_mm));
    };
    const std::array<std::pair<Held, std::optional<ImVec2>>, 3> handles{
        std::pair{Held::Start, at(line.x0, line.y0)}, std::pair{Held::End, at(line.x1, line.y1)},
        std::pair{Held::All, at((line.x0 + line.x1) / 2, (line.y0 + line.y1) / 2)}};
    for (const auto& [what, where] : handles)
      if (where && std::hypot(where->x - mouse.x, where->y - mouse.y) < kReach_px * scale) {
        held_ = what;
        break;
      }
    if (held_ == Held::Nothing) return false;
    if (const auto p = place()) std::tie(last_x_, last_y_) = *p;
    return true;
  }
  if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
    held_ = Held::Nothing;
    return false;
  }
  const auto p = place();
  if (!p) return true;
  const double x = std::clamp(p->first, 0.0, 1.0), y = std::clamp(p->second, 0.0, 1.0);
  if (held_ == Held::Start) line.x0 = x, line.y0 = y;
  if (held_ == Held::End) line.x1 = x, line.y1 = y;
  if (held_ == Held::All) line.move(p->first - last_x_, p->second - last_y_);
  std::tie(last_x_, last_y_) = *p;
  return true;
}

void draw_profile(ImDrawList* list, const ViewRect& rect, const Profile& profile, const std::string& wrong,
                  float scale) {
  const float row = ImGui::GetFontSize();
  const ImVec2 low = corner(rect), high = far_corner(rect);
  list->PushClipRect(low, high, true);
  const ImVec2 from{low.x + 48 * scale, low.y + row + 8 * scale};
  const ImVec2 to{high.x - 10 * scale, high.y - row - 6 * scale};
  list->AddRectFilled(from, to, ink(theme().chart));
  list->AddText({from.x, low.y + 4 * scale}, ink(theme().depth), "A to B: depth [mm]");
  if (!wrong.empty()) {
    const ImVec2 size = ImGui::CalcTextSize(wrong.c_str());
    list->AddText({to.x - size.x, low.y + 4 * scale}, ink(theme().doubtful), wrong.c_str());
  }
  if (profile.depth_mm.size() < 2 || !(profile.length_mm > 0)) {
    list->AddText({from.x + 6 * scale, from.y + 4 * scale}, ink(theme().faint), "the section has no length");
    list->PopClipRect();
    return;
  }
  const Profile::Extreme least = profile.least(), most = profile.most();
  const double span = std::max(most.depth_mm - std::min(0.0, least.depth_mm), 0.02);
  const double step = nice_ceiling(span / std::max(1.0, static_cast<double>((to.y - from.y) / (2 * row))));
  const double top = std::floor(std::min(0.0, least.depth_mm) / step + 1e-9) * step;
  const double bottom = std::max(std::ceil(most.depth_mm / step), top / step + 1) * step + 0.4 * step;
  const auto at = [&](double along_mm, double depth_mm) {
    return ImVec2{from.x + static_cast<float>(along_mm / profile.length_mm) * (to.x - from.x),
                  from.y + static_cast<float>((depth_mm - top) / (bottom - top)) * (to.y - from.y)};
  };
  for (double d = top; d <= bottom; d += step) {
    const float y = at(0, d).y;
    list->AddLine({from.x, y}, {to.x, y}, std::abs(d) < 1e-9 ? ink(theme().frame) : ink(theme().grid));
    const std::string label = tick_text(d, step);
    list->AddText({from.x - ImGui::CalcTextSize(label.c_str()).x - 4 * scale, y - row / 2},
                  ink(theme().faint), label.c_str());
  }
  const double along = nice_ceiling(profile.length_mm / std::max(2.0f, (to.x - from.x) / (60 * scale)));
  const char* title = "[mm]";
  const float title_x = to.x - ImGui::CalcTextSize(title).x;
  for (double x = 0; x <= profile.length_mm * (1 + 1e-9); x += along) {
    const ImVec2 p = at(x, bottom);
    list->AddLine({p.x, to.y}, {p.x, to.y + 3 * scale}, ink(theme().faint));
    const std::string label = tick_text(x, along);
    const float width = ImGui::CalcTextSize(label.c_str()).x;
    if (p.x + width / 2 < title_x - 4 * scale)
      list->AddText({p.x - width / 2, to.y + 4 * scale}, ink(theme().faint), label.c_str());
  }
  list->AddText({title_x, to.y + 4 * scale}, ink(theme().faint), title);

  std::vector<ImVec2> points;
  const size_t count = profile.depth_mm.size();
  for (size_t i = 0; i < count; ++i) {
    const ImVec2 p =
        at(profile.length_mm * static_cast<double>(i) / static_cast<double>(count - 1), profile.depth_mm[i]);
    if (points.empty() || p.x - points.back().x >= 1) points.push_back(p);
  }
  list->AddPolyline(points.data(), static_cast<int>(points.size()), ink(theme().depth), 0, 1.7f * scale);
  const auto label = [&](const char* name, const Profile::Extreme& e, bool below_requested) {
    const ImVec2 p = at(e.at_mm, e.depth_mm);
    list->AddCircleFilled(p, 3 * scale, ink(theme().text));
    std::string words = text("%s %.3f mm at %.2f mm", name, e.depth_mm, e.at_mm);
    if (ImGui::CalcTextSize(words.c_str()).x > to.x - from.x - 4)
      words = text("%.3f at %.1f mm", e.depth_mm, e.at_mm);
    const ImVec2 size = ImGui::CalcTextSize(words.c_str());
    const float x = std::clamp(p.x - size.x / 2, from.x + 2, std::max(from.x + 2, to.x - size.x - 2));
    const bool below = below_requested && p.y + 5 * scale + size.y <= to.y;
    const float y = below ? p.y + 5 * scale : std::max(p.y - size.y - 4 * scale, from.y);
    list->AddRectFilled({x - 2, y}, {x + size.x + 2, y + size.y}, ink(theme().chart, 215));
    list->AddText({x, y}, ink(theme().text), words.c_str());
  };
  if (most.depth_mm - least.depth_mm > 1e-6) {
    label("least", least, false);
    label("deepest", most, true);
  }
  list->AddRect(from, to, ink(theme().frame));
  list->PopClipRect();
}

}  // namespace palpate::viz
