// Regions stage: connected regions of the contact, each with the sums that the contact stage has of them all.
// The parts within a tile are found and summed on the device; the host joins them across tiles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/kernel.h"
#include "engine/stages/frame/contact.h"
#include "palpate/frame.h"
#include "shaders/shared/regions.h"

namespace palpate {
namespace gpu {
class Commands;
class Context;
}  // namespace gpu

/// One connected region (8 neighbours) of contact pixels.
struct Region {
  ContactMoments moments;  ///< of its pixels; exact in every format, `saturated` counts its own
  PixelRect box;           ///< around them
};

class Regions {
 public:
  /// `contact` keeps marks and outlives this.
  Regions(gpu::Context& context, const Contact& contact, const FrameFormat& format);

  /// Memory of one frame in flight.
  struct Slot {
    gpu::DeviceBuffer heads;    ///< RegionPart of each tile whose contact is one part
    gpu::DeviceBuffer list;     ///< RegionPart of each other part, in no order
    gpu::DeviceBuffer records;  ///< ContactRecord of each in the list
    gpu::DeviceBuffer count;    ///< of parts that the list has, or would have with room
  };
  Slot slot(gpu::Context& context) const;
  /// On the host, before every submission.
  static void start(const Slot& slot);
  /// After the contact stage, whose records of this frame are `records`.
  void record(gpu::Commands& commands, const PaddedImage& frame, const PaddedImage& background,
              const gpu::DeviceBuffer& records, const Slot& slot) const;

  /// The regions of a finished frame, in reading order of the tiles and parts that they begin with. False,
  /// and no region, where there were more parts than the list holds.
  bool find(const Slot& slot, std::span<const shared::ContactRecord> records, std::vector<Region>& regions);

  /// Parts that the list has room for; tiles that are one part without saturated pixels need none.
  uint32_t capacity() const { return push_.capacity; }
  uint64_t memory_bytes() const { return part_marks_.bytes(); }
  static uint64_t memory_bytes(const Slot& slot) {
    return slot.heads.bytes() + slot.list.bytes() + slot.records.bytes() + slot.count.bytes();
  }

 private:
  struct Part {
    const shared::RegionPart* shape = nullptr;
    const shared::ContactRecord* sums = nullptr;
  };
  bool collect(const Slot& slot, std::span<const shared::ContactRecord> records);
  void join(uint32_t a, uint32_t b);
  void join_neighbours(uint32_t part);
  uint32_t root(uint32_t part);

  const Contact& contact_;
  uint32_t width_, height_;
  shared::RegionsPush push_{};
  gpu::Kernel kernel_;
  gpu::TexelView marks_;
  gpu::DeviceBuffer part_marks_;
  gpu::TexelView part_mark_texels_;
  // Lists of the frame that `find` looks at; kept so that frames allocate nothing.
  std::vector<uint32_t> listed_;
  std::vector<Part> parts_;      // by tile, then by order
  std::vector<uint32_t> first_;  // of each tile in parts_, and the end
  std::vector<uint32_t> parent_, slot_of_;
};

}  // namespace palpate
