// One frame, start to end: pixels in, Touch and height map out.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/export.h"
#include "palpate/frame.h"
#include "palpate/options.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"

namespace palpate {

class Device;
namespace gpu {
class Context;
class DeviceBuffer;
struct ScopeTime;
struct ScopeTraffic;
}  // namespace gpu

/// The height map of one finished frame, on the GPU: rows x pitch floats, mm, positive into the pad, up to
/// the constant SurfaceSummary::depth_offset_mm.
struct SurfaceMap {
  const gpu::DeviceBuffer* buffer = nullptr;
  uint32_t width = 0;   ///< px
  uint32_t height = 0;  ///< px
  uint32_t pitch = 0;   ///< floats from one row to the next
  /// What is known of each pixel (shaders/shared/confidence.h), in host memory, rows confidence_pitch apart;
  /// empty unless Touch::confidence or pixels are saturated untouched.
  std::span<const uint16_t> confidence = {};
  uint32_t confidence_pitch = 0;
  /// With PipelineOptions::skip_untouched: the buffer holds this part of the frame only, its first row and
  /// column first; beyond it depth is 0, whatever the constant.
  std::optional<PixelRect> window = {};
};

/// Pressure and shear of one finished frame, rows of cells of cell_px x cell_px px from the frame's first
/// pixel on; empty unless Output::Traction was asked for, and without contact.
struct TractionMaps {
  uint32_t width = 0;  ///< cells
  uint32_t height = 0;
  uint32_t cell_px = 0;
  std::span<const float> pressure_kPa = {};                   ///< >= 0
  std::span<const float> shear_x_kPa = {}, shear_y_kPa = {};  ///< on the pad; empty where no skin is followed
};

/// Shear over pressure of each cell, >= 0; 0 where the pressure is below a twentieth of the largest, which is
/// too little to divide by. Empty where shear is not known or nothing touches.
PALPATE_API std::vector<float> friction_ratios(const TractionMaps& maps);
/// Of the friction coefficient: where shear over pressure reaches this share of it, a cell counts as
/// slipping.
inline constexpr double kSlippingShare = 0.9;

/// A finished frame. Its slot, with all that `surface` refers to, stays untouched as long as this lives; any
/// thread may end it. It does not keep the pipeline alive.
class PALPATE_API Result {
 public:
  Result() = default;
  Result(Result&& other) noexcept = default;
  Result& operator=(Result&& other) noexcept;
  ~Result() { give_back(); }

  Touch touch;
  SurfaceMap surface;  ///< buffer is null unless Output::Surface was asked for
  TractionMaps traction;
  uint32_t slot = 0;
  double turnaround_ms = 0;  ///< from `submit` to collection, host clock
  /// Times that the processor copied the frame's pixels from Frame::pixels() on (with skip_untouched: those
  /// of the window). 0: the device read them where they were.
  uint32_t copies = 0;

 private:
  friend class Pipeline;
  struct PALPATE_HIDDEN Hold;
  void give_back() noexcept;

  std::shared_ptr<Hold> hold_;
};

/// Not thread safe: one thread submits and collects; finished maps may be read by another while their
/// Result lives.
class PALPATE_API Pipeline {
 public:
  /// Throws Error where sensor, format and options do not fit, or the device cannot hold the buffers.
  Pipeline(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
           const PipelineOptions& options);
  /// On a device that outlives the pipeline; throws as above.
  Pipeline(Device& device, const Sensor& sensor, const FrameFormat& format, const PipelineOptions& options);
  ~Pipeline();
  Pipeline(Pipeline&&) noexcept;

  /// The untouched image; needed before the first frame. Waits for frames in flight. With
  /// BackgroundKind::None it is not needed and can only be black.
  void set_background(const Frame& background);

  /// Starts a frame; false when every slot is in flight or held (the caller decides whether to wait or to
  /// drop). The lease of a frame that is copied is not kept; that of one which the device reads in place is
  /// until `wait` or `poll` finds it finished.
  bool submit(const Frame& frame);
  /// The oldest frame in flight if it is finished; never waits, but where the surface is solved
  /// here: SurfaceSolver::Exact, and once more with weights where a frame turns out to have unknown pixels.
  std::optional<Result> poll();
  /// The oldest frame in flight, waiting for it; nullopt when none is.
  std::optional<Result> wait();

  /// submit and wait: for tests and single images.
  Touch process(const Frame& frame);

  /// Depth map of a result: height x width floats, mm below rest level.
  std::vector<float> read_depth_mm(const Result& result) const;

  /// Confidence of a result: height x width pixels of 16 bits, confidence 0 to 255
  /// in the lower half and the reasons (shaders/shared/confidence.h) in the upper. Empty unless
  /// Touch::confidence.
  std::vector<uint16_t> read_confidence(const Result& result) const;

  /// GPU time of each named stage of a finished frame (empty unless the context has timers on).
  std::vector<gpu::ScopeTime> times(const Result& result) const;
  /// What each named stage reads and writes with every frame.
  std::vector<gpu::ScopeTraffic> traffic() const;
  /// Bytes of GPU memory that this pipeline holds.
  uint64_t memory_bytes() const;

  const FrameFormat& format() const;
  /// What SurfaceSolver::Auto has become; any other as it was asked for.
  SurfaceSolver solver() const;
  const Sensor& sensor() const;

 private:
  struct PALPATE_HIDDEN Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
