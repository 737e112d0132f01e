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

/// Pressure and shear of one finished frame, rows of cells of cell_px x cell_px px from the frame's first
/// pixel on; empty unless Output::Traction was asked for, and without contact.
struct TractionMaps {
  uint32_t width = 0;  ///< cells
  uint32_t height = 0;
  uint32_t cell_px = 0;
  std::span<const float> pressure_kPa = {};                   ///< >= 0
  std::span<const float> shear_x_kPa = {}, shear_y_kPa = {};  ///< on the pad; empty where no skin is followed
};

/// Dented cells of one finished frame whose place or colour calibration never saw, from the frame's first
/// pixel on; empty where SurfaceSummary::extrapolated_px is.
struct ExtrapolatedCells {
  uint32_t width = 0;  ///< cells
  uint32_t height = 0;
  uint32_t cell_px = 0;
  std::span<const uint8_t> cells = {};  ///< 1: extrapolated
};

/// Shear over pressure of each cell, >= 0; 0 where the pressure is below a twentieth of the largest, which is
/// too little to divide by. Empty where shear is not known or nothing touches.
PALPATE_API std::vector<float> friction_ratios(const TractionMaps& maps);
/// Share of the friction coefficient: where shear over pressure reaches it, a cell counts as
/// slipping.
inline constexpr double kSlippingShare = 0.9;

/// A finished frame. Its slot stays its own as long as this lives; any thread may end it. It does not keep
/// the pipeline alive.
class PALPATE_API Result {
 public:
  Result() = default;
  Result(Result&& other) noexcept = default;
  Result& operator=(Result&& other) noexcept;
  ~Result() { give_back(); }

  Touch touch;
  TractionMaps traction;
  ExtrapolatedCells extrapolated;
  double turnaround_ms = 0;  ///< from `submit` to collection, host clock
  /// Times that the processor copied the frame's pixels from Frame::pixels() on. 0: the device read them
  /// where they were.
  uint32_t copies = 0;

  /// Height x width depths, mm below rest level; empty unless Output::Surface was asked for. Read back from
  /// the device when first asked for, and kept as long as the result lives; not by two threads at once, and
  /// not after the pipeline's end.
  std::span<const float> depth_mm() const;
  /// Height x width pixels of 16 bits: confidence 0 to 255 in the lower half, the reasons
  /// (shaders/shared/confidence.h) in the upper; empty unless Touch::confidence. As depth_mm() otherwise.
  std::span<const uint16_t> confidence() const;

 private:
  friend class Pipeline;
  friend struct PipelineAccess;
  struct PALPATE_HIDDEN Hold;
  void give_back() noexcept;

  std::shared_ptr<Hold> hold_;
};

/// Not thread safe: one thread submits and collects; finished maps may be read by another while their
/// Result lives.
class PALPATE_API Pipeline {
 public:
  /// On a device that outlives the pipeline. Throws Error where sensor, format and options do not fit, or the
  /// device cannot hold the buffers.
  Pipeline(Device& device, const Sensor& sensor, const FrameFormat& format,
           const PipelineOptions& options = {});
  ~Pipeline();
  Pipeline(Pipeline&&) noexcept;

  /// The untouched image; needed before the first frame. Waits for frames in flight. With
  /// BackgroundKind::None it is not needed and can only be black.
  void set_background(const Frame& background);

  /// Starts a frame; false when every slot is in flight or held (the caller decides whether to wait or to
  /// drop). The lease of a frame that is copied is not kept; that of one which the device reads in place is
  /// until `wait` or `poll` finds it finished.
  bool submit(const Frame& frame);
  /// The oldest frame in flight if it is finished; never waits, but where the surface is solved here
  /// (SolveBy::Host), and once more with weights where a frame turns out to have unknown pixels.
  std::optional<Result> poll();
  /// The oldest frame in flight, waiting for it; nullopt when none is.
  std::optional<Result> wait();

  /// submit and wait, where no frame is in flight: for tests and single images.
  Result process(const Frame& frame);

  /// The object's motion (Output::Motion) counts anew: the next frame that is collected and that something
  /// touches begins a track.
  void restart_motion();

  /// Bytes of device memory that this pipeline holds.
  uint64_t memory_bytes() const;

  const FrameFormat& format() const;
  /// Who solves the surface's equations: Device or Host, never Auto.
  SolveBy solved_by() const;
  const Sensor& sensor() const;

 private:
  friend struct PipelineAccess;
  struct PALPATE_HIDDEN Impl;
  PALPATE_HIDDEN explicit Pipeline(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
