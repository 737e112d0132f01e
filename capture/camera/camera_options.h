// Requested settings of a camera, and their text on the command line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace palpate {

/// A control that the camera can rule by itself.
struct Automatic {
  bool automatic = false;       ///< the camera rules it; otherwise it is locked
  std::optional<double> value;  ///< to lock it at; none: where it is
};

/// Requested settings of a camera. Settings that are not given are chosen: the format that fits the sensor
/// best, the sensor's size (else the largest that comes at 25 frames/s), the highest rate up to 60 frames/s,
/// automatic controls off.
struct CameraOptions {
  /// /dev/videoN, or N; "genicam:ID" for a GenICam camera, "genicam:" for the first of them; empty: the first
  /// camera of Linux
  std::string node;
  std::string format;  ///< name of a PixelFormat
  uint32_t width = 0;  ///< px; 0: chosen
  uint32_t height = 0;
  double rate_Hz = 0;       ///< 0: chosen
  std::string trigger;      ///< what starts a frame of a GenICam camera (Line0, Software); empty: the rate
  Automatic exposure;       ///< s
  Automatic gain;           ///< in the camera's own steps
  Automatic white_balance;  ///< K
  std::vector<std::pair<std::string, int64_t>>
      controls;          ///< any others, by name, as palpate cameras lists them
  double timeout_s = 0;  ///< without a frame for so long the stream is started again; 0: 2 s or 5 periods
  uint32_t buffers = 8;  ///< of the driver, 3 to 32
};

/// "camera:NODE?key=value&..." with any of the keys format, size, fps, exposure (8ms, 500us, 0.01s, auto,
/// locked), gain (N, auto, locked), white_balance (4500, auto, locked), trigger (NAME), timeout (s), buffers,
/// and control.NAME. Throws Error(Failure::Usage) that lists what exists.
CameraOptions parse_camera(const std::string& input);
/// The inverse; only what differs from the default.
std::string to_string(const CameraOptions& options);
/// True for "camera:...".
bool is_camera(const std::string& input);

}  // namespace palpate
