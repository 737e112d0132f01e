// Plan of a pipeline: which stages exist for a sensor, a format and the options. Decided here once; nothing
// else asks the options again.
#pragma once

#include <cstdint>
#include <vector>

#include "palpate/frame.h"
#include "palpate/options.h"
#include "palpate/sensor.h"

namespace palpate {

/// How a frame becomes heights (engine/pipeline/surface_*.h).
enum class SurfaceKind {
  None,
  Gradient,  ///< slopes, integrated: Reconstruction::Shading and Photometric
  Elastic,   ///< pressure to deflection
  Lookup,    ///< gray to depth, pixel by pixel
};

struct FramePlan {
  bool windowed = false;      ///< WindowedFrame, else WholeFrame
  bool background = false;    ///< an untouched image is subtracted
  bool regions = false;       ///< contacts are told apart
  bool gel_contacts = false;  ///< by the change over its noise: colour gels
  bool specks = false;        ///< pixels that are saturated untouched are filled from around
  bool steady_light = false;  ///< changes of light are taken out
  bool separate = false;      ///< nothing is followed from frame to frame
  bool gradient = false;
  bool skin = false;
  bool markers = false;  ///< printed ones are left out of colours, and filled
  bool confidence = false;
  bool keep_filtered = false;  ///< the surface is made of the contact stage's filtered image
  SurfaceKind surface = SurfaceKind::None;
  bool traction = false;  ///< by the layer
  TractionBy traction_by = TractionBy::Auto;
  bool weights = false;  ///< the surface counts each pixel by its confidence
  SurfaceSolver solver = SurfaceSolver::Live;
  bool warm_start = false;
  Upload upload = Upload::Auto;
  uint32_t slots = 1;
};

/// `sensor` is valid, and fits format and outputs (check_fit).
FramePlan make_plan(const Sensor& sensor, const FrameFormat& format, const PipelineOptions& options);

/// Whether a window gives what the whole frame would: not where a pixel's depth depends on pressure far away
/// (Reconstruction::Elastic) or is absolute (Reconstruction::Lookup), where pixels are weighted, where
/// heights are solved on the host, and where everything is contact (a threshold of 0) or nothing is
/// subtracted or filtered.
bool can_window(const Sensor& sensor, const FrameFormat& format, const PipelineOptions& options);

/// Windows begin at multiples of it.
inline constexpr uint32_t kWindowStep_px = 8;

/// Sizes of windows for frames of one format, smallest first: squares of growing shares of the shorter side.
std::vector<PixelRect> window_sizes(const FrameFormat& format);

}  // namespace palpate
