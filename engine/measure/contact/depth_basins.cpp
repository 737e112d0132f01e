#include "engine/measure/contact/depth_basins.h"

#include <algorithm>

namespace palpate {
namespace {

constexpr uint32_t kNoBasin = UINT32_MAX;

}  // namespace

DepthBasins::DepthBasins(const Shape& shape) : shape_(shape) {
  const size_t cells = size_t{shape.cells_x} * shape.cells_y;
  order_.reserve(cells);
  peaks_.reserve(cells);
  basin_.resize(cells);
  first_of_.reserve(kMostContacts + 1);
}

uint32_t DepthBasins::split(std::span<const float> depth_mm, double error_mm, std::span<const float> pixels,
                            std::span<uint32_t> owner, std::vector<uint32_t>& was) {
  sort(depth_mm, owner);
  peaks_.clear();
  std::fill(basin_.begin(), basin_.end(), kNoBasin);
  for (const uint32_t cell : order_) {
    add(cell, owner, depth_mm, error_mm);
    peaks_[basin_[cell]].area_px += double{pixels[cell]};
  }
  return number(owner, was);
}

void DepthBasins::sort(std::span<const float> depth_mm, std::span<const uint32_t> owner) {
  order_.clear();
  deepest_mm_ = 0;
  for (uint32_t cell = 0; cell < owner.size(); ++cell) {
    if (owner[cell] == 0) continue;
    order_.push_back(cell);
    deepest_mm_ = std::max(deepest_mm_, depth_mm[cell]);
  }
  std::sort(order_.begin(), order_.end(), [&](uint32_t a, uint32_t b) {
    return depth_mm[a] != depth_mm[b] ? depth_mm[a] > depth_mm[b] : a < b;
  });
}

// To the basin of a deeper neighbour, or as a peak.
void DepthBasins::add(uint32_t cell, std::span<const uint32_t> owner, std::span<const float> depth_mm,
                      double error_mm) {
  const uint32_t x = cell % shape_.cells_x, y = cell / shape_.cells_x;
  uint32_t own = kNoBasin;
  const auto look_at = [&](uint32_t neighbour) {
    if (basin_[neighbour] == kNoBasin || owner[neighbour] != owner[cell]) return;
    const uint32_t other = root(basin_[neighbour]);
    own = own == kNoBasin || own == other ? other : meet(own, other, depth_mm[cell], error_mm);
  };
  if (x > 0) look_at(cell - 1);
  if (x + 1 < shape_.cells_x) look_at(cell + 1);
  if (y > 0) look_at(cell - shape_.cells_x);
  if (y + 1 < shape_.cells_y) look_at(cell + shape_.cells_x);
  if (own == kNoBasin) {
    own = static_cast<uint32_t>(peaks_.size());
    // Lamps at the pad's sides change with any touch, and their slopes leave depth there.
    const bool at_border = x < shape_.margin || y < shape_.margin || x + shape_.margin >= shape_.cells_x ||
                           y + shape_.margin >= shape_.cells_y;
    peaks_.push_back({own, depth_mm[cell], 0, 0, at_border});
  }
  basin_[cell] = own;
}

// Two basins at a saddle; returns the deeper one. A peak that stands out keeps its basin.
uint32_t DepthBasins::meet(uint32_t own, uint32_t other, float saddle_mm, double error_mm) {
  const bool first = peaks_[own].depth_mm >= peaks_[other].depth_mm;
  const uint32_t high = first ? own : other, low = first ? other : own;
  Peak& lower = peaks_[low];
  const bool stands_out = lower.depth_mm >= static_cast<float>(kLeastPeak) * deepest_mm_ &&
                          saddle_mm < static_cast<float>(kSaddle) * lower.depth_mm &&
                          lower.depth_mm - saddle_mm >= static_cast<float>(kSureErrors * error_mm) &&
                          lower.area_px >= shape_.least_px && !lower.at_border;
  if (!stands_out) {
    lower.parent = high;
    peaks_[high].area_px += lower.area_px;
  }
  return high;
}

uint32_t DepthBasins::root(uint32_t basin) {
  while (peaks_[basin].parent != basin) basin = peaks_[basin].parent = peaks_[peaks_[basin].parent].parent;
  return basin;
}

uint32_t DepthBasins::number(std::span<uint32_t> owner, std::vector<uint32_t>& was) {
  first_of_.clear();
  was.assign(1, 0);
  uint32_t count = 0;
  for (const uint32_t cell : order_) {
    Peak& peak = peaks_[root(basin_[cell])];
    if (peak.contact != 0) continue;
    if (owner[cell] >= first_of_.size()) first_of_.resize(owner[cell] + 1, 0);
    uint32_t& first = first_of_[owner[cell]];
    // A peak that is too small, or beyond the most contacts, joins its owner's deepest.
    if (first != 0 && (peak.area_px < shape_.least_px || count >= kMostContacts)) {
      peak.contact = first;
      continue;
    }
    peak.contact = ++count;
    was.push_back(owner[cell]);
    if (first == 0) first = count;
  }
  for (const uint32_t cell : order_) owner[cell] = peaks_[root(basin_[cell])].contact;
  return count;
}

}  // namespace palpate
