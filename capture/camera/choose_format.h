// Which of a camera's pixel formats serves a sensor.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "capture/camera/camera_options.h"
#include "capture/camera/formats.h"

namespace palpate {

struct Sensor;

/// A pixel format that a camera offers.
struct OfferedFormat {
  uint32_t fourcc = 0;  ///< V4L2's; 0: it has none
  std::string description;
  bool compressed = false;
  bool emulated = false;               ///< made by a library, not by the camera
  const PixelFormat* known = nullptr;  ///< null: cannot be read
};

/// Requirements of the frames. 0: as much as the camera has.
struct CameraNeeds {
  uint32_t channels = 0;
  uint32_t bit_depth = 0;
  std::array<uint32_t, 2> size_px{};
};

/// Of a sensor's frames before they are rectified.
CameraNeeds needs_of(const Sensor& sensor);

/// The formats that can serve, best first: those of the bits wanted, then of more; gray for gray, raw before
/// computed before compressed. Empty where none can.
std::vector<const PixelFormat*> fitting_formats(const std::vector<OfferedFormat>& offered,
                                                const CameraNeeds& needs);

/// The format that `options` name, else the best that fits. `where` names the camera in messages. Throws
/// Error(Failure::Device) where the camera has none that serves, Error(Failure::Usage) for a name that is
/// none.
const PixelFormat& choose_format(const std::vector<OfferedFormat>& offered, const std::string& where,
                                 const CameraOptions& options, const CameraNeeds& needs);

}  // namespace palpate
