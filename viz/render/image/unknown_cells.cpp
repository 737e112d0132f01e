#include "viz/render/image/unknown_cells.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "engine/pipeline/surface_map.h"
#include "shaders/shared/cell_change.h"
#include "shaders/shared/confidence.h"
#include "viz/render/mesh_places.h"

namespace palpate::viz {
namespace {

using Cells = UnknownCells;
constexpr uint32_t kSide = shared::kCellSide;

Cells cells_of(const FrameFormat& format) {
  Cells cells;
  cells.width = (format.width + kSide - 1) / kSide;
  cells.height = (format.height + kSide - 1) / kSide;
  cells.cell_px = kSide;
  return cells;
}

void add(Cells& cells, size_t at, uint8_t reasons) {
  if (cells.reasons.empty()) cells.reasons.resize(size_t{cells.width} * cells.height);
  cells.reasons[at] |= reasons;
  cells.all |= reasons;
}

/// Adds a reason to cells that lie in `part`, of which `is_so` holds at half of their pixels or more.
template <typename IsSo>
void add_where(Cells& cells, const FrameFormat& format, const PixelRect& part, Cells::Reason reason,
               const IsSo& is_so) {
  for (uint32_t y = part.y / kSide; y * kSide < part.y + part.height; ++y)
    for (uint32_t x = part.x / kSide; x * kSide < part.x + part.width; ++x) {
      const uint32_t right = std::min((x + 1) * kSide, format.width),
                     foot = std::min((y + 1) * kSide, format.height);
      uint32_t count = 0;
      for (uint32_t row = y * kSide; row < foot; ++row)
        for (uint32_t column = x * kSide; column < right; ++column) count += is_so(column, row);
      if (2 * count >= (right - x * kSide) * (foot - y * kSide))
        add(cells, size_t{y} * cells.width + x, reason);
    }
}

void add_by_confidence(Cells& cells, const FrameFormat& format, const SurfaceMap& map) {
  constexpr std::array kReasons{
      std::pair{shared::kCovered, Cells::Covered}, std::pair{shared::kOutside, Cells::Outside},
      std::pair{shared::kSaturated, Cells::Saturated}, std::pair{shared::kShadowed, Cells::Shadowed}};
  // Most pixels of most frames are known: reasons that do not occur are not looked for by cells.
  uint32_t found = 0;
  for (uint32_t y = 0; y < format.height; ++y)
    for (const uint16_t one : map.confidence.subspan(size_t{y} * map.confidence_pitch, format.width))
      found |= one;
  for (const auto& [bit, reason] : kReasons) {
    if (!(found >> shared::kReasonShift & bit)) continue;
    add_where(cells, format, {0, 0, format.width, format.height}, reason,
              [&, wanted = bit << shared::kReasonShift](uint32_t x, uint32_t y) {
                const uint32_t one = map.confidence[size_t{y} * map.confidence_pitch + x];
                return (one & wanted) != 0 && (one & shared::kFullConfidence) == 0;
              });
  }
}

void add_saturated(Cells& cells, const Frame& frame, const Frame& background, const Touch& touch,
                   uint32_t saturation_gray) {
  const std::optional<PixelRect> touched = dented_part(touch, frame.format.width, frame.format.height);
  const bool compared = background.format == frame.format && background.pixels();
  const PixelRect all{0, 0, frame.format.width, frame.format.height};
  add_where(cells, frame.format, touched.value_or(all), Cells::Saturated, [&](uint32_t x, uint32_t y) {
    for (uint32_t c = 0; c < frame.format.channels; ++c)
      if (frame.at(c, x, y) >= saturation_gray && !(compared && background.at(c, x, y) >= saturation_gray))
        return true;
    return false;
  });
}

}  // namespace

UnknownCells unknown_cells(const Frame& frame, const Frame& background, const Touch& touch,
                           const Result& result, const Sensor& sensor) {
  Cells cells = cells_of(frame.format);
  const ExtrapolatedCells& beyond = result.extrapolated;
  if (beyond.cell_px == kSide)
    for (size_t i = 0; i < beyond.cells.size(); ++i)
      if (beyond.cells[i]) add(cells, i, Cells::Extrapolated);
  const SurfaceMap& map = surface_of(result);
  if (!map.confidence.empty()) add_by_confidence(cells, frame.format, map);
  if (!touch.confidence && touch.saturated_px > 0)
    add_saturated(cells, frame, background, touch, sensor.saturation_gray);
  return cells;
}

std::string words_of(const UnknownCells& cells) {
  constexpr std::array kWords{
      std::pair{Cells::Extrapolated, "extrapolated"}, std::pair{Cells::Covered, "covered by markers"},
      std::pair{Cells::Outside, "beyond the pad"}, std::pair{Cells::Saturated, "saturated"},
      std::pair{Cells::Shadowed, "too dark"}};
  std::string words;
  for (const auto& [reason, word] : kWords)
    if (cells.all & reason) words += std::string(words.empty() ? "not known: " : ", ") + word;
  return words;
}

}  // namespace palpate::viz
