// One frame, start to end: pixels in, Touch and height map out. pipeline.cpp is the architecture in one
// function.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"
#include "palpate/tuning.h"

namespace palpate {
namespace gpu {
class Context;
class DeviceBuffer;
struct ScopeTime;
struct ScopeTraffic;
}  // namespace gpu

/// What the caller wants computed. What is not asked for is not built: no kernels, no memory.
enum class Output : uint32_t {
  Force = 1,       ///< contact moments, force, shear
  Surface = 2,     ///< height map on the GPU, depth
  Confidence = 4,  ///< what is known of each pixel; the surface then counts each by it
  Contacts = 8,    ///< several contacts told apart and followed; with Force
  Skin = 16,       ///< how the skin moves along itself, where the sensor has a pattern on it; with Force
  Gradient = 32,   ///< Touch::gradient_sum, of frames of 8 bits
};
constexpr uint32_t operator|(Output a, Output b) {
  return static_cast<uint32_t>(a) | static_cast<uint32_t>(b);
}
constexpr uint32_t operator|(uint32_t a, Output b) {
  return a | static_cast<uint32_t>(b);
}
constexpr bool wants(uint32_t outputs, Output output) {
  return (outputs & static_cast<uint32_t>(output)) != 0;
}
/// Whether pixels' confidence is computed: where it is asked for, and where a surface may have to do without
/// some of them.
inline bool needs_confidence(const Sensor& sensor, uint32_t outputs) {
  return wants(outputs, Output::Confidence) ||
         (wants(outputs, Output::Surface) && (sensor.pad || sensor.shadow_gray));
}

/// Whether the sum of the change's gradients is computed: where it is asked for, and where the force is read
/// from it.
inline bool needs_gradient(const Sensor& sensor, uint32_t outputs) {
  return sensor.bit_depth == 8 &&
         (wants(outputs, Output::Gradient) ||
          (wants(outputs, Output::Force) && sensor.force && sensor.force->signal == ForceSignal::Gradient));
}

enum class SurfaceSolver {
  Live,       ///< full multigrid on cells of 2 x 2 px, interpolated: relative RMS error below 1e-3 on smooth
              ///< fields; what is narrower than 4 px is flattened
  Fine,       ///< that and one cycle on the pixels
  Converged,  ///< that and six cycles on the GPU: down to the rounding of single precision
  Exact,      ///< discrete cosine transform by FFTW on the CPU; Reading::Elastic: zero-padded convolution
};

/// How pixels that lie in a camera driver's buffer (Frame::leased with Frame::pages) reach the device.
enum class Upload {
  Auto,    ///< Copy on the processor's own driver, where a copy costs less than another kernel; else Import
  Copy,    ///< the processor writes them into the device's memory
  Import,  ///< the device reads the driver's buffer itself, where it can; else as Copy
};

struct PipelineOptions {
  uint32_t outputs = Output::Force | Output::Surface;
  SurfaceSolver solver = SurfaceSolver::Live;
  uint32_t slots = 3;  ///< frames in flight: recording, finishing, shown
  /// SurfaceSolver::Converged starts from the last submitted frame's heights and makes one cycle instead of
  /// six: a quarter of the time, relative RMS error below 1e-6 (odd sizes: 2e-5) where a smooth contact moves
  /// by up to 3 px a frame. A frame's heights then depend, that closely, on those before it.
  bool warm_start = false;
  /// Only a window around the touched tiles is computed; beyond it depth is 0, and without contact
  /// everywhere. Sums and force are those of the whole frame, to the last bit. Has no effect where the window
  /// would not do: Reading::Elastic, Output::Gradient, a followed skin, confidence and weights,
  /// SurfaceSolver::Exact, threshold 0, and frames whose contacts lie too far apart. Each window is solved
  /// anew: warm_start is then not used.
  bool skip_untouched = false;
  Upload upload = Upload::Auto;       ///< of leased frames; others are copied
  std::optional<Tuning> tuning = {};  ///< without one: what was measured for the device, or its defaults
};

class Skipping;

/// The height map of one finished frame, on the GPU: rows x pitch floats, mm, positive into the pad, up to
/// the constant Touch::depth_datum_mm.
struct SurfaceMap {
  const gpu::DeviceBuffer* buffer = nullptr;
  uint32_t width = 0;   ///< px
  uint32_t height = 0;  ///< px
  uint32_t pitch = 0;   ///< floats from one row to the next
  /// What is known of each pixel (shaders/shared/confidence.h), in host memory, rows confidence_pitch apart;
  /// empty unless Touch::has_confidence.
  std::span<const uint16_t> confidence = {};
  uint32_t confidence_pitch = 0;
  /// With PipelineOptions::skip_untouched: the buffer holds this part of the frame only, its first row and
  /// column first; beyond it depth is 0, whatever the constant.
  std::optional<PixelRect> window = {};
};

/// A finished frame. The slot stays untouched until `release`.
struct Result {
  Touch touch;
  SurfaceMap surface;  ///< buffer is null unless Output::Surface was asked for
  uint32_t slot = 0;
  double turnaround_ms = 0;  ///< from `submit` to collection, host clock
  /// Times that the processor copied the frame's pixels from Frame::pixels() on (with skip_untouched: those
  /// of the window). 0: the device read them where they were.
  uint32_t copies = 0;
};

/// Not thread safe: one thread submits and collects; finished maps may be read by another until released.
class Pipeline {
 public:
  /// Throws Error where sensor, format and options do not fit, or the device cannot hold the buffers.
  Pipeline(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
           const PipelineOptions& options);
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
  /// Gives a result's slot back.
  void release(const Result& result);

  /// submit, wait, release: for tests and single images.
  Touch process(const Frame& frame);

  /// Depth map of a result that is not released yet: height x width floats, mm below rest level.
  std::vector<float> read_depth_mm(const Result& result) const;

  /// Confidence of a result that is not released yet: height x width pixels of 16 bits, confidence 0 to 255
  /// in the lower half and the reasons (shaders/shared/confidence.h) in the upper. Empty unless
  /// Touch::has_confidence.
  std::vector<uint16_t> read_confidence(const Result& result) const;

  /// GPU time of each named stage of a finished frame (empty unless the context has timers on).
  std::vector<gpu::ScopeTime> times(const Result& result) const;
  /// What each named stage reads and writes with every frame.
  std::vector<gpu::ScopeTraffic> traffic() const;
  /// Bytes of GPU memory that this pipeline holds.
  uint64_t memory_bytes() const;

  const FrameFormat& format() const;
  const Sensor& sensor() const;

 private:
  friend class Skipping;
  /// Frames submitted from here on are parts of larger ones: centroids are theirs, and weights that vary over
  /// the frame.
  void place(const FramePlace& place);
  /// Touch::contacts are a frame's regions with their shapes, small ones too: the caller follows them.
  void leave_unfollowed();

  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::unique_ptr<Skipping> skipping_;  ///< in place of impl_ with PipelineOptions::skip_untouched
};

}  // namespace palpate
