// Contacts that touch one another, separated by the depth between them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// A watershed of the depth map: cells are added from the deepest up. Where two basins meet, the shallower
/// one stays a contact of its own if its peak is deep enough below the saddle between them.
class DepthBasins {
 public:
  static constexpr double kSaddle = 0.35;        ///< at most, of the shallower one's depth
  static constexpr double kSureErrors = 2;       ///< of depth, by which a peak exceeds its saddle
  static constexpr double kLeastPeak = 0.2;      ///< of the deepest one's depth
  static constexpr uint32_t kMostContacts = 64;  ///< beyond, what meets is one

  struct Shape {
    uint32_t cells_x = 0, cells_y = 0;
    uint32_t margin = 0;  ///< cells from the border, within which no peak stands out
    double least_px = 0;  ///< area of a contact
  };
  DepthBasins() = default;
  explicit DepthBasins(const Shape& shape);

  /// Splits what `owner` tells of each cell (0: nothing, else a contact) and numbers contacts anew, from 1,
  /// in the order of their peaks; returns how many. `depth_mm`: mean of each cell, 0 at rest; `error_mm`: of
  /// them; `pixels`: of each cell. `was`: which contact each new one is part of; the first stands for 0.
  uint32_t split(std::span<const float> depth_mm, double error_mm, std::span<const float> pixels,
                 std::span<uint32_t> owner, std::vector<uint32_t>& was);

 private:
  /// Where the depth is greatest around.
  struct Peak {
    uint32_t parent = 0;  ///< itself, or one that it has become part of
    float depth_mm = 0;
    double area_px = 0;
    uint32_t contact = 0;
    bool at_border = false;
  };
  void sort(std::span<const float> depth_mm, std::span<const uint32_t> owner);
  void add(uint32_t cell, std::span<const uint32_t> owner, std::span<const float> depth_mm, double error_mm);
  uint32_t meet(uint32_t own, uint32_t other, float saddle_mm, double error_mm);
  uint32_t root(uint32_t basin);
  uint32_t number(std::span<uint32_t> owner, std::vector<uint32_t>& was);

  Shape shape_;
  float deepest_mm_ = 0;
  std::vector<Peak> peaks_;
  std::vector<uint32_t> order_;     // cells with an owner, the deepest first
  std::vector<uint32_t> basin_;     // of each cell
  std::vector<uint32_t> first_of_;  // of each owner: its contact
};

}  // namespace palpate
