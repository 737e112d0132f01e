// Where a frame is touched, found on the host while it passes through anyway: what no contact reaches need
// not be computed.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

/// What one look at a frame tells.
struct TouchedTiles {
  uint32_t columns = 0;          ///< of tiles
  uint32_t rows = 0;             ///< of tiles
  std::vector<uint8_t> touched;  ///< rows x columns; 1: touched
  uint64_t count = 0;            ///< of touched tiles
  PixelRect box;                 ///< around all touched tiles, clipped to the frame
  uint64_t saturated_px = 0;     ///< as Touch::saturated_px
};

/// Finds tiles of 32 x 32 px with contact: pixels whose filtered change from the background reaches the
/// sensor's threshold, by the contact stage's own integers. Most tiles are decided by their largest raw
/// change, which no mean over it can exceed; the others are filtered. Not thread safe.
class ContactTiles {
 public:
  static constexpr uint32_t kTile_px = 32;
  /// Every contact pixel lies in a touched tile or so far from one at most: a pixel takes part in the
  /// filtered value of those two beside it.
  static constexpr uint32_t kReach_px = 2;

  ContactTiles(const Sensor& sensor, const FrameFormat& format);

  void set_background(const Frame& background) { background_ = background; }
  /// Of a frame of the background's format. The answer holds until the next call.
  const TouchedTiles& find(const Frame& frame);

 private:
  template <typename Pixel, Signal kSignal>
  void find_as(const Frame& frame);
  template <typename Pixel, Signal kSignal>
  void filter_run(const Frame& frame, uint32_t x0, uint32_t x1, uint32_t y0);
  template <typename Pixel>
  uint64_t saturated(const Frame& frame, const PixelRect& tile) const;

  Signal signal_;
  uint32_t reach_;       ///< filtered change from which a pixel is in contact, 1/256 gray levels
  uint32_t saturation_;  ///< gray levels
  uint32_t dead_;        // untouched gray levels, see dead_gray()
  Frame background_;
  std::vector<uint8_t> change_, bright_;        ///< largest raw values of each column of a row of tiles
  std::vector<uint8_t> row_;                    ///< one row's changes, with apron
  std::array<std::vector<uint8_t>, 5> across_;  ///< the last five rows, filtered along the row
  std::vector<uint8_t> most_;                   ///< largest filtered value of each column
  TouchedTiles tiles_;
};

}  // namespace palpate
