// Options of a pipeline: what is computed of each frame, and how.
#pragma once

#include <cstdint>
#include <optional>

#include "palpate/tuning.h"

namespace palpate {

/// Outputs that the caller asks for. Others are not built: no kernels, no memory.
enum class Output : uint32_t {
  Force = 1,       ///< contact moments, force, shear
  Surface = 2,     ///< height map on the GPU, depth
  Confidence = 4,  ///< confidence of each pixel; the surface then weights each by it
  /// Several contacts separated and followed; with Force. A colour gel's (Reconstruction::Photometric, 8
  /// bits) are told by the change over its own noise, and its Surface is then at rest beside them.
  Contacts = 8,
  Skin = 16,      ///< how the skin moves along itself, where the sensor has a pattern on it; with Force
  Gradient = 32,  ///< Touch::gradient_sum, of frames of 8 bits
  /// Pressure and shear on the pad, and the wrench that they make; with Surface, which it needs, of sensors
  /// with a layer (layer_of). Pressure is looked for in contacts, which are found for it where Contacts was
  /// not asked for.
  Traction = 64,
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

/// How far the surface's equations are solved.
enum class SurfaceSolver {
  Live,       ///< full multigrid on cells of 2 x 2 px, interpolated: relative RMS error below 1e-3 on smooth
              ///< fields; what is narrower than 4 px is flattened
  Fine,       ///< that and one cycle on the pixels
  Converged,  ///< that and six cycles on the GPU: down to the rounding of single precision
  Auto,  ///< the faster one of Converged and Exact, which both come within 3e-6: a rule by the kind of device
         ///< and the frame's size, so that a recording gives the same digits each time (choose_solver.h)
  Exact,  ///< discrete cosine transform by FFTW on the CPU; Reconstruction::Elastic: zero-padded convolution
};

/// How pixels that lie in a camera driver's buffer (Frame::leased with Frame::pages) reach the device.
enum class Upload {
  Auto,    ///< Copy on the processor's own driver, where a copy costs less than another kernel; else Import
  Copy,    ///< the processor writes them into the device's memory
  Import,  ///< the device reads the driver's buffer itself, where it can; else as Copy
};

/// Who solves for the pressure of Output::Traction; its errors and shear are the host's.
enum class TractionBy {
  Auto,    ///< Host on the processor's own driver, and with SurfaceSolver::Exact; else Device
  Device,  ///< single precision, twelve iterations a frame from where the last one ended
  Host,    ///< double precision, to its tolerance
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
  /// would not do: Reconstruction::Elastic, Output::Gradient, a followed skin, confidence and weights,
  /// SurfaceSolver::Exact, threshold 0, and frames whose contacts lie too far apart. Each window is solved
  /// anew: warm_start is then not used.
  bool skip_untouched = false;
  /// Frames are compared with the untouched image as they are: what a camera or its lamps change by
  /// themselves is not taken out. Without it that is done for colour gels.
  bool fixed_light = false;
  /// Frames are pictures of separate presses: each is measured as the first one after the untouched image.
  /// Nothing is followed from one to the next: neither light nor noise, nor contacts (each has a new id),
  /// shift, shear and slip (Validity::NotFollowed), nor the skin (Output::Skin has no effect). A force with
  /// branches lies between them.
  bool separate = false;
  /// Pictures are measured whatever they look like; without it damaged ones are looked for (Touch::picture).
  bool any_picture = false;
  TractionBy traction = TractionBy::Auto;
  Upload upload = Upload::Auto;       ///< of leased frames; others are copied
  std::optional<Tuning> tuning = {};  ///< without one: what was measured for the device, or its defaults
};

}  // namespace palpate
