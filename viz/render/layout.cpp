#include "viz/render/layout.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "viz/look/measures.h"

namespace palpate::viz {
namespace {

constexpr double kLeastSurface_px = 256;  // beside a dock, at scale 1
constexpr double kPlayer_px = 80, kTools_px = 40, kHeadline_height_px = 64, kStatus_px = 24;
constexpr double kFlags_px = 16, kPlayerKeys_px = 32;  // above and below the thumbnails of a replay
constexpr double kNumbers_px = 440;                    // below the image
constexpr double kLowBarRoom_px = 32;                  // below a small surface

ViewRect inset(const ViewRect& r, int32_t margin) {
  const auto less = [margin](uint32_t side) {
    return std::max(1u, side - std::min(2 * static_cast<uint32_t>(margin), side - 1));
  };
  return {r.x + margin, r.y + margin, less(r.width), less(r.height)};
}

/// Two halves that meet on the grid: side by side, or one above the other where a picture is larger so.
std::array<ViewRect, 2> halves(const ViewRect& r, double aspect, int32_t grid) {
  std::array<ViewRect, 2> both{r, r};
  const auto half = [grid](uint32_t side) {
    const auto cells = side / 2 / static_cast<uint32_t>(grid);
    return std::max(1u, cells * static_cast<uint32_t>(grid));
  };
  const double beside = std::min(r.width / 2.0 / aspect, 1.0 * r.height),
               above = std::min(r.width / aspect, r.height / 2.0);
  if (beside >= above) {
    both[0].width = half(r.width);
    both[1].width = r.width - both[0].width;
    both[1].x += static_cast<int32_t>(both[0].width);
  } else {
    both[0].height = half(r.height);
    both[1].height = r.height - both[0].height;
    both[1].y += static_cast<int32_t>(both[0].height);
  }
  return both;
}

/// Gives surface and image their places.
void share(Layout& l, const ViewRect& small, int32_t margin, double aspect, bool has_surface,
           const Panels& panels) {
  ViewRect large = l.pictures;
  l.has_map = panels.map;
  if (panels.map) {
    const auto [first, second] = halves(l.pictures, aspect, margin);
    large = first;
    l.map = second;
  }
  const bool equal = panels.arrangement == Arrangement::BothEqual && has_surface;
  const bool alone = panels.arrangement == Arrangement::OneAlone;
  const bool image_large = panels.image_large || !has_surface;
  l.has_surface = has_surface && !(alone && image_large);
  l.has_image = !(alone && !image_large);
  l.numbers_y = small.y;
  std::array<ViewRect, 2> rooms{large, small};
  if (equal) rooms = halves(large, aspect, margin);
  if (l.has_surface) l.surface = rooms[image_large ? 1 : 0];
  if (l.has_image) {
    const ViewRect& room = rooms[image_large ? 0 : 1];
    const bool is_small = !equal && !image_large;
    l.image = fitted(is_small ? room : inset(room, margin), aspect, is_small);
  }
  if (equal || alone || !has_surface) return;
  const ViewRect& second = image_large ? l.surface : l.image;
  l.numbers_y = second.y + static_cast<int32_t>(second.height) + margin;
}

}  // namespace

const char* to_string(Arrangement arrangement) {
  constexpr std::array kNames{"one large", "both equal", "one alone"};
  return kNames[static_cast<size_t>(arrangement)];
}

ViewRect rect_of(double x, double y, double width, double height) {
  return {static_cast<int32_t>(x), static_cast<int32_t>(y), static_cast<uint32_t>(std::max(width, 1.0)),
          static_cast<uint32_t>(std::max(height, 1.0))};
}

ViewRect fitted(const ViewRect& room, double aspect, bool at_top) {
  ViewRect r;
  const double fit = std::min(room.width / aspect, static_cast<double>(room.height));
  r.height = std::max(1u, static_cast<uint32_t>(fit));
  r.width = std::max(1u, std::min(room.width, static_cast<uint32_t>(std::lround(fit * aspect))));
  r.x = room.x + static_cast<int32_t>((room.width - r.width) / 2);
  r.y = at_top ? room.y : room.y + static_cast<int32_t>((room.height - r.height) / 2);
  return r;
}

bool is_roomy(const ViewRect& surface, float scale) {
  constexpr float kWidth_px = 400, kHeight_px = 200;
  return static_cast<float>(surface.width) >= kWidth_px * scale &&
         static_cast<float>(surface.height) >= kHeight_px * scale;
}

ViewMargins margins_of(const ViewRect& surface, float scale) {
  const double x = double{scale} / surface.width, y = double{scale} / surface.height;
  if (!is_roomy(surface, scale))
    return {kGrid_px * x, kGrid_px * x, kGrid_px * y, (kGrid_px + kLowBarRoom_px) * y};
  return {kLabelRoom_px * x, (kLabelRoom_px / 2 + kColourBarRoom_px) * x, kLabelRoom_px / 2 * y,
          kLabelRoom_px * y};
}

Layout make_layout(VkExtent2D extent, float scale, const FrameFormat& format, bool has_surface,
                   const Panels& panels) {
  const auto px = [scale](double value) { return static_cast<uint32_t>(std::lround(value * scale)); };
  const uint32_t width = std::max(extent.width, 2u), height = std::max(extent.height, 2u);
  // A fraction of the picture, on the grid.
  const auto part = [&](double fraction, uint32_t of) {
    return px(kGrid_px * std::floor(fraction * of / (double{kGrid_px} * scale)));
  };
  const uint32_t status = std::min(px(kStatus_px), height / 2);
  const uint32_t panel =
      std::min(std::clamp(part(0.27, width), px(272), std::max(px(384), part(0.18, width))), width / 2);
  const bool alone = panels.arrangement == Arrangement::OneAlone;
  const uint32_t above = height - status, left = alone ? width : width - panel;
  const double wanted = panels.tools ? kTools_px : panels.headline ? kHeadline_height_px : 0;
  const uint32_t tools = std::min(px(wanted), above / 4);
  Layout l;
  const bool foot_requested = !alone && (panels.charts || (panels.profile && has_surface));
  // Above a player they leave it some of their room; a picture's letters are large, and three charts need
  // more.
  const double foot_share = panels.player ? 0.31 : panels.headline && panels.chart_rows > 2 ? 0.44 : 0.34;
  uint32_t foot = std::clamp(part(foot_share, above), px(128), std::max(px(264), part(0.22, above)));
  if (!foot_requested || foot + tools + px(140) > above) foot = 0;
  // The surface keeps a width that it can be seen in.
  const uint32_t dock =
      panels.dock > 0 && left >= px(panels.dock) + px(kLeastSurface_px) ? px(panels.dock) : 0;
  l.has_dock = dock > 0;
  l.has_player = panels.player;
  const uint32_t player = panels.player ? std::min(px(kPlayer_px), (above - foot - tools) / 2) : 0;
  const uint32_t pictures = above - foot - player - tools;
  const auto top = static_cast<int32_t>(tools);
  l.has_tools = panels.tools;
  if (l.has_tools) l.tools = {0, 0, left, tools};
  l.has_headline = panels.headline && !panels.tools;
  if (l.has_headline) l.headline = {0, 0, left, tools};
  l.pictures = {static_cast<int32_t>(dock), top, left - dock, pictures};
  if (l.has_dock) l.dock = {0, top, dock, pictures};
  if (l.has_player) {
    l.player = {0, top + static_cast<int32_t>(pictures), left, player};
    const uint32_t words = std::min(px(kFlags_px + kPlayerKeys_px), player - 1);
    const uint32_t before = px(kAxisLeft_px), both = before + px(kAxisRight_px);
    l.strip = {static_cast<int32_t>(before),
               l.player.y + static_cast<int32_t>(std::min(px(kFlags_px), words)),
               std::max(left, both + 1) - both, player - words};
  }
  if (foot > 0) {
    l.has_charts = panels.charts;
    l.has_profile = panels.profile && has_surface;
    const uint32_t profile = !l.has_profile ? 0 : l.has_charts ? part(0.4, left) : left;
    const auto y = static_cast<int32_t>(above - foot);
    if (l.has_charts) l.charts = {0, y, left - profile, foot};
    if (l.has_profile) l.profile = {static_cast<int32_t>(left - profile), y, profile, foot};
  }
  l.status = {0, static_cast<int32_t>(above), width, status};
  l.has_panel = !alone;
  if (l.has_panel) l.panel = {static_cast<int32_t>(left), 0, panel, above};
  // The small picture leaves room for the numbers below it.
  const uint32_t numbers = px(kNumbers_px);
  const uint32_t room_px = std::clamp(above > numbers ? above - numbers : 0u, std::min(px(112), above / 3),
                                      std::max(px(304), 3 * panel / 4));
  const auto margin = static_cast<int32_t>(px(kGrid_px));
  const ViewRect small{l.panel.x + margin, 4 * margin,
                       panel - std::min(static_cast<uint32_t>(2 * margin), panel - 1), std::max(1u, room_px)};
  share(l, small, margin, static_cast<double>(format.width) / format.height, has_surface, panels);
  return l;
}

}  // namespace palpate::viz
