// Connected parts of the known pixels of a frame. Slopes determine heights within such an island up to a
// constant; between two islands the difference in height is not determined.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace palpate {

struct Islands {
  uint32_t count = 0;       ///< of known pixels, joined by edges
  uint32_t touched = 0;     ///< of those, with a touched pixel
  uint64_t unknown_px = 0;  ///< pixels that belong to none

  /// More than one: the height between them is not determined.
  bool apart() const { return count > 1; }
};

/// Keeps its working memory, so that a frame allocates nothing.
class IslandFinder {
 public:
  /// `known` is height x width, not 0 where a pixel is known. `touched` (may be empty: nowhere) tells for a
  /// pixel. `labels`, if given, becomes height x width: 0 for unknown, else the island from 1.
  Islands find(std::span<const uint8_t> known, uint32_t width, uint32_t height,
               const std::function<bool(uint32_t x, uint32_t y)>& touched = {},
               std::vector<uint32_t>* labels = nullptr);

 private:
  /// Known pixels side by side in a row, columns first to last.
  struct Run {
    uint32_t y, first, last;
  };
  uint32_t root(uint32_t run);

  std::vector<Run> runs_;
  std::vector<uint32_t> parent_, number_;
  std::vector<uint8_t> has_touch_;
};

/// The same once.
Islands find_islands(std::span<const uint8_t> known, uint32_t width, uint32_t height,
                     const std::function<bool(uint32_t x, uint32_t y)>& touched = {},
                     std::vector<uint32_t>* labels = nullptr);

}  // namespace palpate
