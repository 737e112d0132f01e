// Frame slot: everything that one frame in flight owns.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/measure/height_rows.h"
#include "engine/pipeline/surface/weighted_slot.h"
#include "engine/stages/frame/confidence.h"
#include "engine/stages/frame/contact.h"
#include "engine/stages/frame/markers.h"
#include "engine/stages/frame/regions.h"
#include "engine/stages/frame/upload.h"
#include "engine/stages/surface/rest_level.h"
#include "engine/stages/traction.h"

namespace palpate {

/// The part of the surface method. What a method does not need stays empty.
struct SurfaceSlot {
  FloatMap depth;
  // Where the host changes or reads heights, and the depth's own memory is not mapped.
  gpu::DeviceBuffer readback;
  gpu::Commands to_device;     ///< moves them back; nothing waits for it
  bool changed = false;        ///< by the host, the frame that is measured
  bool was_corrected = false;  ///< by what was found at rest
  bool rest_unknown = false;   ///< what was taken off may have been touched
  gpu::DeviceBuffer rest_records;
  gpu::DeviceBuffer clipped;         ///< of slopes
  gpu::DeviceBuffer border_records;  ///< of pressure
  gpu::DeviceBuffer right_side;      ///< Solve::Exact: goes to the host
  WeightedSlot weighted;

  const gpu::DeviceBuffer& on_host() const { return readback ? readback : depth.buffer; }
};

/// Memory of the layer's traction. Empty where none is asked for.
struct TractionSlot {
  gpu::DeviceBuffer input;   ///< the map of pressures
  gpu::DeviceBuffer depths;  ///< of cells, on their way to the stage
  TractionStage::Slot stage;
  gpu::Commands solve;
  std::vector<float> pressure_kPa, shear_x_kPa, shear_y_kPa;
};

struct ConfidenceSlot {
  ConfidenceMap map;
  uint32_t pitch = 0;  ///< of the map, pixels
  gpu::DeviceBuffer records;
  ConfidenceCounts counts;  ///< of the frame that is measured
};

/// Commands are recorded once and submitted for every frame.
struct FrameSlot {
  /// `untouched`: the image that is subtracted, or null.
  FrameSlot(gpu::Context& context, const FrameFormat& format, const Contact& contact,
            const PaddedImage* untouched)
      : frame(context, "frame", format),
        background(untouched ? *untouched : frame),
        records(context, "contact records", contact.record_bytes(), gpu::Memory::Readback),
        commands(context) {}

  void give_back() {
    lease.reset();
    pages.reset();
  }

  /// The image that all stages but the skin's measure.
  const PaddedImage& without_markers() const { return markers ? markers->frame : frame; }

  PaddedImage frame;
  std::optional<Markers::Slot> markers;  ///< where they are filled
  const PaddedImage& background;         ///< where nothing is subtracted the frame itself: it is not read
  // Commands before `commands`: moving what the processor wrote, where device memory is not mapped, or
  // padding what is read in place.
  gpu::Commands staged;
  gpu::Commands padded;
  gpu::Commands* first = nullptr;  ///< the one of them that went with the last frame
  // Pages of a frame that is read in place, until it is finished.
  std::shared_ptr<MappedPages> pages;
  std::shared_ptr<const uint8_t> lease;  ///< given back before the pages, wherever both go
  uint32_t copies = 0;

  gpu::DeviceBuffer records;
  Regions::Slot regions;
  gpu::DeviceBuffer cell_changes;
  gpu::DeviceBuffer gradient_sums;
  gpu::DeviceBuffer skin_records;
  std::vector<float> skin_sd_px;  ///< standard error of each point of the frame that is measured
  ConfidenceSlot confidence;
  SurfaceSlot surface;
  std::vector<uint8_t> extrapolated;  ///< cells
  TractionSlot traction;
  gpu::Commands commands;
  gpu::Commands weighted;            ///< for frames that are expected to need weights
  gpu::Commands* running = nullptr;  ///< which of both the last frame was submitted with
};

}  // namespace palpate
