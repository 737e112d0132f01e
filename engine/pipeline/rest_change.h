// Rest change: how the surface of a pad that nothing touches strays from frame to frame.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// Where nothing touches the pad, of a frame's surface as it was solved.
struct PadAtRest {
  double level_mm = 0;                    ///< height of the pad at rest
  double level_sd_mm = 0;                 ///< what that may be wrong by, where the cells do not say
  uint32_t cells_x = 0;                   ///< of a row
  std::span<const float> means_mm = {};   ///< mean height of each cell; empty: not known
  std::span<const uint8_t> at_rest = {};  ///< of each cell: whether nothing touches it
};

/// What a surface is wrong by stays much the same over the pad: against an earlier frame the level is known
/// by the cells that are at rest in both, and how much the change differs over the pad says how well.
class RestChange {
 public:
  struct Level {
    double mm = 0;                ///< height of the pad at rest
    double sd_mm = 0;             ///< of this frame, and of the earlier one as much
    double tilt_sd_per_cell = 0;  ///< of each frame's tilt, mm a cell
  };

  /// The earlier frame. `level_mm`: taken for the pad's height in it.
  void begin(const PadAtRest& rest, double level_mm);
  /// As it is stated where too few cells are at rest in both; of the first frame without an error.
  Level since(const PadAtRest& rest) const;

 private:
  /// Of blocks of cells, row by row; NaN where too little is at rest.
  struct Changes {
    uint32_t across = 0;
    std::vector<double> mm;
    std::vector<double> steps_mm() const;  ///< sizes, from a block to the next
  };
  Changes changes_since(const PadAtRest& rest) const;

  double level_mm_ = 0;
  std::vector<float> means_mm_;
  std::vector<uint8_t> at_rest_;
};

}  // namespace palpate
