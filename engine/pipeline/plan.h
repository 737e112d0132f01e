// Plan of a pipeline: which stages exist for a sensor, a format and the options, decided once for all of
// them.
#pragma once

#include <cstdint>

#include "engine/stages/surface/solve.h"
#include "palpate/frame.h"
#include "palpate/options.h"
#include "palpate/sensor.h"

namespace palpate {

/// How a frame becomes heights (engine/pipeline/surface/surface_*.h).
enum class SurfaceKind {
  None,
  Gradient,  ///< slopes, integrated: SurfaceReading::Shading and Photometric
  Elastic,   ///< pressure to deflection
  Lookup,    ///< gray to depth, pixel by pixel
};

struct FramePlan {
  bool background = false;    ///< an untouched image is subtracted
  bool regions = false;       ///< contacts are told apart
  bool gel_contacts = false;  ///< by the change over its noise: colour gels
  bool specks = false;        ///< pixels that are saturated untouched are filled from around
  bool flaws = false;         ///< places where the untouched image no longer holds likewise
  bool steady_light = false;  ///< changes of light are taken out
  bool separate = false;      ///< nothing is followed from frame to frame
  bool gradient = false;
  bool skin = false;
  bool markers = false;  ///< printed ones are left out of colours, and filled
  bool confidence = false;
  bool keep_filtered = false;  ///< the surface is made of the contact stage's filtered image
  SurfaceKind surface = SurfaceKind::None;
  bool traction = false;  ///< by the layer
  bool motion = false;    ///< of the object
  bool traction_on_host = false, motion_on_host = false;
  bool weights = false;  ///< the surface counts each pixel by its confidence
  Solve solve = Solve::Live;
  Upload upload = Upload::Auto;
  uint32_t slots = 1;
};

/// `sensor` is valid, and fits format and outputs (check_fit).
/// `processor`: the device is the processor's own driver.
FramePlan make_plan(const Sensor& sensor, const FrameFormat& format, const PipelineOptions& options,
                    bool processor);

}  // namespace palpate
