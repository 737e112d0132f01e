// Known shapes that are pressed, as people type them.
#pragma once

#include <optional>
#include <string>

#include "engine/calibrate/ball/shape.h"
#include "palpate/error.h"

namespace palpate {

/// Spellings, for help and error lines.
inline constexpr const char* kShapeSpellings =
    "cylinder:radius=MM, cone:half-angle=DEG or cone:half-angle=DEG:tip-radius=MM, dots:radius=MM:apart=MM "
    "(a grid of equal balls), ball:radius=MM; or diameter=MM, angle=DEG";

/// "cylinder:radius=2.5", "cylinder:diameter=5", "cone:half-angle=60:tip-radius=0.3",
/// "dots:radius=0.5:apart=2", "ball:radius=3". Throws Error(`failure`) that names `where`.
PressedShape parse_shape(const std::string& typed, const std::string& where = "--shape",
                         Failure failure = Failure::Usage);

/// The shape pressed in a recording: "RECORDING=SHAPE", or "SHAPE" of the input itself.
struct ShapedRecording {
  std::optional<std::string> recording;
  PressedShape shape;
};
ShapedRecording parse_shaped_recording(const std::string& typed);

}  // namespace palpate
