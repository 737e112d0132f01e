// Opening of a source of frames by its name: file, folder, session, camera or built-in sensor.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "source.h"

namespace palpate {

/// Whether `input` names a file or folder, not a camera or a simulated scene.
bool is_recording(const std::string& input);

/// Opens a video file, an image file, a folder of images, "synthetic:SCENE" (see synthetic.h), or
/// "camera:NODE" (see camera/camera_options.h).
/// Throws Error(Failure::Input).
std::unique_ptr<Source> open_source(const std::string& input, const Sensor& sensor);

/// Format that the camera `input` ("camera:NODE") would deliver to an uncalibrated sensor: colour where it
/// has any, else gray of its most bits, unless a format is named. Opens the camera and closes it again.
/// Throws Error(Failure::Device).
FrameFormat camera_format(const std::string& input);

/// The untouched image to subtract: the sensor's background image, else the source's own, else the mean of
/// its first frames. For the last a recording is opened a second time, so that `source` loses no frame; a
/// camera cannot be, and gives its own next frames. Black where the sensor has none.
Frame load_background(const std::string& input, const Sensor& sensor, Source& source);
/// The background image that the sensor file names, rectified; none: it names none. Throws
/// Error(Failure::Input).
std::optional<Frame> background_image(const Sensor& sensor);

/// Whether the frames of `source` are separate presses: pictures without a rate (a folder of images, one
/// image), unless the caller says that they are `one_sequence` in their order, or at which rate they were
/// taken (`rate_Hz` above 0).
bool separate_presses(const Source& source, bool one_sequence, double rate_Hz = 0);

/// Where load_background() takes the untouched image from.
enum class BackgroundOrigin {
  None,         ///< nothing is subtracted
  File,         ///< the image that the sensor file or an option names
  Recording,    ///< the source's own
  FirstFrames,  ///< nobody has said that these are untouched
};
BackgroundOrigin background_origin(const Sensor& sensor, const Source& source);

}  // namespace palpate
