// A frame on its way through the device.
#pragma once

#include <chrono>
#include <memory>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "palpate/pipeline.h"
#include "engine/stages/contact.h"
#include "engine/stages/rest_level.h"
#include "engine/stages/regions.h"
#include "engine/stages/upload.h"
#include "engine/stages/weighted_frame.h"

namespace palpate {

/// Everything one frame in flight owns. Its commands are recorded once and submitted for every frame.
struct FrameSlot {
  FrameSlot(gpu::Context& context, const FrameFormat& format, const Contact& contact)
      : frame(context, "frame", format),
        records(context, "contact records", contact.record_bytes(), gpu::Memory::Readback),
        commands(context) {}

  void give_back() {
    lease.reset();
    pages.reset();
  }

  PaddedImage frame;
  // What comes before `commands`: moving what the processor wrote, where device memory is not mapped, or
  // padding what is read in place.
  gpu::Commands staged;
  gpu::Commands padded;
  gpu::Commands* first = nullptr;  // the one of them that went with the last frame
  // Of a frame that is read in place, until it is finished.
  std::shared_ptr<MappedPages> pages;
  std::shared_ptr<const uint8_t> lease;  // given back before the pages, wherever both go
  uint32_t copies = 0;
  gpu::DeviceBuffer records;
  FloatMap depth;
  gpu::DeviceBuffer datum_records;
  gpu::DeviceBuffer border_records;  // Reading::Elastic
  gpu::DeviceBuffer clipped;         // the other readings
  gpu::DeviceBuffer skin_records;
  gpu::DeviceBuffer gradient_sums;
  gpu::Commands commands;
  // Only for SurfaceSolver::Exact, which leaves the GPU in between.
  gpu::DeviceBuffer right_side;
  gpu::DeviceBuffer solved;
  gpu::Commands after_solve;

  Regions::Slot parts;        // with Output::Contacts
  WeightedFrame::Slot known;  // where not everything is

  FramePlace place;  // for which the commands were recorded
  bool free = true;
  uint64_t sequence = 0;
  int64_t time_ns = 0;
  bool after_gap = false;
  std::chrono::steady_clock::time_point submitted;

  /// Sides of the frame's image that are not sides of the whole frame.
  InnerEdges inner_edges(const FrameFormat& format) const {
    return {place.x > 0, place.x + format.width<place.frame_width, place.y> 0,
            place.y + format.height < place.frame_height};
  }
};

}  // namespace palpate
