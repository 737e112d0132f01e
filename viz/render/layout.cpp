#include "viz/render/layout.h"

#include <algorithm>
#include <cmath>

#include "viz/look/measures.h"

namespace palpate::viz {
namespace {

constexpr double kLeastSurface_px = 256;  // beside a dock, at scale 1
constexpr double kPlayer_px = 32, kTools_px = 40, kStatus_px = 24;
constexpr double kNumbers_px = 440;  // below the image

}  // namespace

ViewMargins margins_of(const ViewRect& surface, float scale) {
  const double x = double{scale} / surface.width, y = double{scale} / surface.height;
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
  const uint32_t panel = std::min(std::clamp(part(0.27, width), px(272), px(384)), width / 2);
  const uint32_t above = height - status, left = width - panel;
  const uint32_t tools = panels.tools ? std::min(px(kTools_px), above / 4) : 0;
  const double aspect = static_cast<double>(format.width) / format.height;
  Layout l;
  const bool foot_requested = panels.charts || (panels.profile && has_surface);
  uint32_t foot = std::clamp(part(0.34, above), px(128), px(264));
  if (!foot_requested || foot + tools + px(140) > above) foot = 0;
  // The surface keeps a width that it can be seen in.
  const uint32_t dock =
      panels.dock > 0 && left >= px(panels.dock) + px(kLeastSurface_px) ? px(panels.dock) : 0;
  l.has_dock = dock > 0;
  l.has_player = panels.player;
  const uint32_t player = panels.player ? std::min(px(kPlayer_px), (above - foot - tools) / 2) : 0;
  const uint32_t surface = above - foot - player - tools;
  const auto top = static_cast<int32_t>(tools);
  l.has_tools = panels.tools;
  if (l.has_tools) l.tools = {0, 0, left, tools};
  l.surface = {static_cast<int32_t>(dock), top, left - dock, surface};
  if (l.has_dock) l.dock = {0, top, dock, surface};
  if (l.has_player) l.player = {0, top + static_cast<int32_t>(surface), left, player};
  if (foot > 0) {
    l.has_charts = panels.charts;
    l.has_profile = panels.profile && has_surface;
    const uint32_t profile = !l.has_profile ? 0 : l.has_charts ? part(0.4, left) : left;
    const auto y = static_cast<int32_t>(above - foot);
    if (l.has_charts) l.charts = {0, y, left - profile, foot};
    if (l.has_profile) l.profile = {static_cast<int32_t>(left - profile), y, profile, foot};
  }
  l.panel = {static_cast<int32_t>(left), 0, panel, above};
  l.status = {0, static_cast<int32_t>(above), width, status};
  // The image leaves room for the numbers below it.
  const uint32_t numbers = px(kNumbers_px);
  const uint32_t image_room =
      std::clamp(above > numbers ? above - numbers : 0u, std::min(px(112), above / 3), px(304));
  const auto margin = static_cast<int32_t>(px(kGrid_px));
  const uint32_t margins = px(2 * kGrid_px);
  const ViewRect room =
      has_surface ? ViewRect{l.panel.x + margin, 4 * margin, panel - std::min(margins, panel - 1),
                             std::max(1u, image_room)}
                  : ViewRect{l.surface.x + margin, l.surface.y + margin,
                             std::max(1u, l.surface.width - std::min(margins, l.surface.width - 1)),
                             std::max(1u, l.surface.height - std::min(margins, l.surface.height - 1))};
  const double fit = std::min(room.width / aspect, static_cast<double>(room.height));
  l.image.height = std::max(1u, static_cast<uint32_t>(fit));
  l.image.width = std::max(1u, std::min(room.width, static_cast<uint32_t>(std::lround(fit * aspect))));
  l.image.x = room.x + static_cast<int32_t>((room.width - l.image.width) / 2);
  l.image.y = has_surface ? room.y : room.y + static_cast<int32_t>((room.height - l.image.height) / 2);
  return l;
}

}  // namespace palpate::viz
