#include "engine/pipeline/rest_change.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "engine/base/numbers.h"
#include "engine/base/statistics.h"

namespace palpate {
namespace {

/// Cells that a change is averaged over, in which their own noise is small.
constexpr uint32_t kBlock_cells = 8;
constexpr size_t kFewestBlocks = 4;

/// What a level is wrong by from one frame to another, of what the pad at rest strays by in one: most of that
/// stays as it is. RMS of seven simulated objects (0.4 to 0.6).
constexpr double kLevel = 0.6;

}  // namespace

void RestChange::begin(const PadAtRest& rest, double level_mm) {
  level_mm_ = level_mm;
  means_mm_.assign(rest.means_mm.begin(), rest.means_mm.end());
  at_rest_.assign(rest.at_rest.begin(), rest.at_rest.end());
}

// Medians, since cells next to an object may be taken for at rest where the skin is bent.
RestChange::Level RestChange::since(const PadAtRest& rest) const {
  constexpr double kDeviation = 1.48;  // of a normal, over its median size
  if (means_mm_.empty() && !rest.means_mm.empty()) return {.mm = rest.level_mm};
  const Changes changes = changes_since(rest);
  std::vector<double> known;
  std::ranges::copy_if(changes.mm, std::back_inserter(known), [](double mm) { return !std::isnan(mm); });
  if (known.size() < kFewestBlocks)
    return {.mm = rest.level_mm,
            .sd_mm = kLevel * rest.level_sd_mm,
            .tilt_sd_per_cell = rest.level_sd_mm / (0.5 * rest.cells_x)};
  const double change_mm = median(known);
  for (double& block : known) block = std::abs(block - change_mm);
  // Half of a change's square is each frame's.
  return {.mm = level_mm_ + change_mm,
          .sd_mm = kDeviation * median(known) / std::numbers::sqrt2,
          .tilt_sd_per_cell = kDeviation * median(changes.steps_mm()) / std::numbers::sqrt2 / kBlock_cells};
}

std::vector<double> RestChange::Changes::steps_mm() const {
  std::vector<double> out;
  const auto add = [&](double step_mm) {
    if (!std::isnan(step_mm)) out.push_back(std::abs(step_mm));
  };
  for (size_t i = 0; i < mm.size(); ++i) {
    if (i % across + 1 < across) add(mm[i + 1] - mm[i]);
    if (i + across < mm.size()) add(mm[i + across] - mm[i]);
  }
  return out;
}

RestChange::Changes RestChange::changes_since(const PadAtRest& rest) const {
  constexpr double kLeast = kBlock_cells * kBlock_cells / 4.0;  // cells at rest in both frames
  Changes out;
  if (rest.cells_x == 0 || rest.means_mm.size() != means_mm_.size()) return out;
  const auto rows = static_cast<uint32_t>(means_mm_.size() / rest.cells_x);
  out.across = (rest.cells_x + kBlock_cells - 1) / kBlock_cells;
  for (uint32_t top = 0; top < rows; top += kBlock_cells)
    for (uint32_t left = 0; left < rest.cells_x; left += kBlock_cells) {
      double sum = 0, cells = 0;
      for (uint32_t y = top; y < std::min(top + kBlock_cells, rows); ++y)
        for (uint32_t x = left; x < std::min(left + kBlock_cells, rest.cells_x); ++x) {
          const size_t cell = size_t{y} * rest.cells_x + x;
          if (rest.at_rest[cell] == 0 || at_rest_[cell] == 0) continue;
          sum += double{rest.means_mm[cell]} - double{means_mm_[cell]};
          ++cells;
        }
      out.mm.push_back(cells >= kLeast ? sum / cells : kNaN);
    }
  return out;
}

}  // namespace palpate
