// Contact stage: background subtraction, 5x5 binomial filter, threshold, exact integer moments, in one
// kernel. A sensor whose frames need no subtraction or no filter gets a kernel without it.
#pragma once

#include <cstdint>
#include <span>

#include "engine/gpu/buffer.h"
#include "engine/gpu/kernel.h"
#include "engine/gpu/tuning.h"
#include "engine/measure/moments.h"
#include "engine/stages/frame/upload.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"
#include "shaders/shared/contact.h"

namespace palpate {
namespace gpu {
class Commands;
}

class Contact {
 public:
  /// `keep_filtered`: also stores the filtered image, for SurfaceReading::Shading and Elastic; not with
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

  /// Parts of tiles for the stage `regions`, on the GPU.
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
  enum class Form { Filtered, Unfiltered, Moments, Tiles };
  void make_strips(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, bool keep_filtered,
                   bool keep_marks);
  void make_tiles(gpu::Context& context, const Sensor& sensor, const FrameFormat& format, bool keep_filtered,
                  bool keep_marks);
  Form form_ = Form::Filtered;
  gpu::Kernel kernel_;
  gpu::Kernel parts_kernel_;
  gpu::DeviceBuffer filtered_;
  gpu::DeviceBuffer marks_;
};

}  // namespace palpate
