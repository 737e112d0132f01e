#include "capture/calibrate/photometric/next_presses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/base/statistics.h"
#include "engine/base/text.h"

namespace palpate {
namespace {

constexpr size_t kAcross = 3;
constexpr double kWorse = 1.5;  // than the usual part

struct Part {
  double squares_mm2 = 0, away_px = std::numeric_limits<double>::infinity();
  size_t presses = 0;
};

}  // namespace

std::optional<PressPlace> place_for_presses(std::span<const FoundPress> presses, uint32_t width_px,
                                            uint32_t height_px) {
  const double wide = static_cast<double>(width_px) / kAcross,
               high = static_cast<double>(height_px) / kAcross;
  std::array<Part, kAcross * kAcross> parts;
  const auto part_of = [](double at, double size) {
    return static_cast<size_t>(std::clamp(std::floor(at / size), 0.0, kAcross - 1.0));
  };
  for (const FoundPress& press : presses) {
    if (!press.refusal.empty()) continue;
    Part& own = parts[part_of(press.y_px, high) * kAcross + part_of(press.x_px, wide)];
    ++own.presses;
    own.squares_mm2 += press.depth_error_mm * press.depth_error_mm;
    for (size_t i = 0; i < parts.size(); ++i) {
      const size_t column = i % kAcross, row = i / kAcross;
      const double x = (static_cast<double>(column) + 0.5) * wide;
      const double y = (static_cast<double>(row) + 0.5) * high;
      parts[i].away_px = std::min(parts[i].away_px, std::hypot(press.x_px - x, press.y_px - y));
    }
  }
  std::vector<double> errors_mm;
  std::array<double, kAcross * kAcross> error_mm{};
  size_t emptiest = parts.size(), worst = parts.size();
  for (size_t i = 0; i < parts.size(); ++i) {
    const Part& part = parts[i];
    if (!std::isfinite(part.away_px)) return std::nullopt;
    if (part.presses == 0) {
      if (emptiest == parts.size() || part.away_px > parts[emptiest].away_px) emptiest = i;
      continue;
    }
    error_mm[i] = std::sqrt(part.squares_mm2 / static_cast<double>(part.presses));
    errors_mm.push_back(error_mm[i]);
    if (worst == parts.size() || error_mm[i] > error_mm[worst]) worst = i;
  }
  const double usual_mm = median(errors_mm);
  const bool empty = emptiest < parts.size();
  if (!empty && error_mm[worst] <= kWorse * usual_mm) return std::nullopt;
  const size_t at = empty ? emptiest : worst, column = at % kAcross, row = at / kAcross;
  const double left = static_cast<double>(column) * wide, top = static_cast<double>(row) * high;
  return PressPlace{
      left, top, left + wide, top + high,
      empty ? "no press was here"
            : text("depth is wrong by %.3g mm here, elsewhere by %.3g mm", error_mm[worst], usual_mm)};
}

}  // namespace palpate
