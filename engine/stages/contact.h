// Contact stage: background subtraction, 5x5 binomial filter, threshold, exact integer moments, in one
// kernel. A sensor whose frames need no subtraction or no filter gets a kernel without it.
#pragma once

#include <cstdint>
#include <span>

#include "palpate/frame.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/kernel.h"
#include "palpate/sensor.h"
#include "engine/stages/upload.h"
#include "engine/gpu/tuning.h"
#include "shaders/shared/contact.h"

namespace palpate {
namespace gpu {
class Commands;
}

/// Exact sums over the contact pixels, those whose filtered gray g reaches the threshold. x and y count from
/// the pixel (width / 2, height / 2), rounded down, so that large frames lose no digits; g is in 1/256 gray
/// levels (Eq. 53, 55-58). With at most 2^26 pixels (kMaxPixels), |x| and |y| at most 2^13 and g below 2^24,
/// every sum stays below 2^63: the largest, sum g |x|, is at most 2^24 * 2^26 * 2^12, since |x| averages a
/// quarter of the width over a full frame.
struct ContactMoments {
  uint64_t area = 0;
  uint64_t gray = 0;
  int64_t gray_x = 0;
  int64_t gray_y = 0;
  int64_t x = 0;
  int64_t y = 0;
  int64_t xx = 0;
  int64_t xy = 0;
  int64_t yy = 0;
  uint32_t peak = 0;       ///< largest g
  uint64_t saturated = 0;  ///< raw pixels at or above the saturation level, in the whole frame
  bool border = false;     ///< contact pixels in the frame's outermost rows or columns

  bool operator==(const ContactMoments&) const = default;
};

/// The same sums with x and y counted from a place dx px to the left of it and dy px above.
ContactMoments moved(ContactMoments moments, int64_t dx, int64_t dy);

inline constexpr uint64_t kMaxPixels = uint64_t{1} << 26;

class Contact {
 public:
  /// `keep_filtered`: also stores the filtered image, for Reading::Shading and Elastic; not with
  /// Filter::None. `keep_marks`: also stores which pixels are contact, for the stage `regions`.
  Contact(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, bool keep_filtered,
          const Tuning& tuning, bool keep_marks = false);

  uint64_t record_bytes() const { return uint64_t{tiles()} * sizeof(shared::ContactRecord); }
  uint32_t tiles() const { return push_.tiles_x * push_.tiles_y; }
  uint32_t tiles_x() const { return push_.tiles_x; }
  uint32_t tile_columns() const { return tile_columns_; }  ///< px
  uint32_t tile_rows() const { return tile_rows_; }        ///< px

  /// Leaves one ContactRecord for each tile in `records`. With BackgroundKind::None `background` is not read:
  /// the frame itself will do.
  void record(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
              const gpu::DeviceBuffer& records) const;
  /// Adds the tiles' records up, in 64 bits.
  ContactMoments sum(std::span<const shared::ContactRecord> records) const;
  /// Adds one tile's record, of all its contact or a part of it.
  void add(ContactMoments& moments, const shared::ContactRecord& record, uint32_t tile) const;

  /// What the stage `regions` lists of tiles' parts, on the GPU.
  struct Parts {
    const gpu::DeviceBuffer& list;   ///< shared::RegionPart
    const gpu::TexelView& marks;     ///< R32UI: kMaxTileRows rows of each
    const gpu::DeviceBuffer& count;  ///< one number: how many there would be with room for all
    uint32_t capacity;
  };
  /// Leaves one ContactRecord for each part in `records`; only with keep_marks.
  void record_parts(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
                    const Parts& parts, const gpu::DeviceBuffer& records) const;

  /// Filtered image, two pixels of 16 bits to a word, low half first; tiles_x() * tile_columns() pixels from
  /// row to row.
  const gpu::DeviceBuffer& filtered() const { return filtered_; }
  /// One word for each row of each tile, a bit a pixel from the left; tile_rows() words from tile to tile.
  const gpu::DeviceBuffer& marks() const { return marks_; }
  /// Stored 16-bit units to one gray level.
  uint32_t filtered_units_per_gray() const { return units_per_gray_; }

 private:
  shared::ContactPush push_{};
  uint32_t tile_columns_ = 0;
  uint32_t tile_rows_ = 0;
  uint32_t workgroup_ = 0;
  uint32_t units_per_gray_ = 256;
  enum class Form { Filtered, Unfiltered, Moments };
  Form form_ = Form::Filtered;
  gpu::Kernel kernel_;
  gpu::Kernel parts_kernel_;
  gpu::DeviceBuffer filtered_;
  gpu::DeviceBuffer marks_;
};

}  // namespace palpate
