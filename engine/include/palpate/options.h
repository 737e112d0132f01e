// Options of a pipeline: what is computed of each frame, and how.
#pragma once

#include <cstdint>

namespace palpate {

/// One thing that the caller may ask for.
enum class Output : uint32_t {
  Force = 1,       ///< contact moments, force, shear
  Surface = 2,     ///< height map on the GPU, depth
  Confidence = 4,  ///< confidence of each pixel; the surface then weights each by it
  /// Several contacts separated and followed; with Force. A colour gel's (SurfaceReading::Photometric, 8
  /// bits) are found by the change over its own noise, and its Surface is then at rest around them.
  Contacts = 8,
  Skin = 16,      ///< how the skin moves along itself, where the sensor has a pattern on it; with Force
  Gradient = 32,  ///< Touch::gradient_sum, of frames of 8 bits
  /// Pressure and shear on the pad, and the wrench that they make; with Surface, which it needs, of sensors
  /// with a layer (layer_of). Pressure is looked for in contacts, which are found for it where Contacts was
  /// not asked for.
  Traction = 64,
  /// The rigid motion of the object that touches the pad (Touch::object), from the surface inside its
  /// contact; with Surface, which it needs, of sensors with a scale. Contacts are found for it where they
  /// were not asked for. Of several the one that is followed is the largest at the track's beginning.
  Motion = 128,
};

/// A set of outputs: Output::Force | Output::Surface. Others are not built: no kernels, no memory.
class Outputs {
 public:
  constexpr Outputs() = default;
  constexpr Outputs(Output one) : bits_(static_cast<uint32_t>(one)) {}

  constexpr bool empty() const { return bits_ == 0; }
  constexpr Outputs& operator|=(Outputs more) {
    bits_ |= more.bits_;
    return *this;
  }
  friend constexpr Outputs operator|(Outputs a, Outputs b) { return a |= b; }
  friend constexpr bool wants(Outputs outputs, Output one) {
    return (outputs.bits_ & static_cast<uint32_t>(one)) != 0;
  }
  constexpr bool operator==(const Outputs&) const = default;

 private:
  uint32_t bits_ = 0;
};
constexpr Outputs operator|(Output a, Output b) {
  return Outputs(a) | Outputs(b);
}

/// How far the surface's equations are solved.
enum class SurfaceSolver {
  Live,  ///< full multigrid on cells of 2 x 2 px, interpolated: relative RMS error below 1e-3 on smooth
         ///< fields; what is narrower than 4 px is flattened
  Best,  ///< to 3e-6: on the device or the host, as SolveBy says
};

/// Who computes what both can: the surface's equations (SurfaceSolver::Best), the pressure of
/// Output::Traction (its errors and shear are always the host's) and the sums over pixels of Output::Motion.
enum class SolveBy {
  Auto,    ///< the faster one, by a rule: a recording gives the same digits each time
  Device,  ///< single precision: six cycles of multigrid at full resolution; pressure by twelve iterations a
           ///< frame from where the last one ended, and by the host where those do not converge
  Host,    ///< double precision: a discrete cosine transform; pressure to its tolerance
};

/// How pixels that lie in a camera driver's buffer (Frame::leased with Frame::pages) reach the device.
enum class Upload {
  Auto,    ///< Copy on the processor's own driver, where a copy costs less than another kernel; else Import
  Copy,    ///< the processor writes them into the device's memory
  Import,  ///< the device reads the driver's buffer itself, where it can; else as Copy
};

struct PipelineOptions {
  Outputs outputs = Output::Force | Output::Surface;
  SurfaceSolver solver = SurfaceSolver::Live;
  uint32_t slots = 3;  ///< frames in flight: recording, finishing, shown
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
  SolveBy solve_by = SolveBy::Auto;
  Upload upload = Upload::Auto;  ///< of leased frames; others are copied
};

}  // namespace palpate
