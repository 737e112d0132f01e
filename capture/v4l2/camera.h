// A camera of this machine (V4L2) as a source of frames.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/source.h"

namespace palpate {

/// A control that the camera can rule by itself.
struct Automatic {
  bool automatic = false;       ///< the camera rules it; otherwise it is locked
  std::optional<double> value;  ///< to lock it at; none: where it is
};

/// What is asked of a camera. What is not named is chosen: the format that fits the sensor best, the sensor's
/// size (else the largest that comes at 25 frames/s), the highest rate up to 60 frames/s, automatic controls
/// off.
struct CameraOptions {
  std::string node;    ///< /dev/videoN, or N; empty: the first camera
  std::string format;  ///< name of a PixelFormat
  uint32_t width = 0;  ///< px; 0: chosen
  uint32_t height = 0;
  double rate_Hz = 0;       ///< 0: chosen
  Automatic exposure;       ///< s
  Automatic gain;           ///< in the camera's own steps
  Automatic white_balance;  ///< K
  std::vector<std::pair<std::string, int64_t>>
      controls;          ///< any others, by name, as palpate cameras lists them
  double timeout_s = 0;  ///< without a frame for so long the stream is started again; 0: 2 s or 5 periods
  uint32_t buffers = 8;  ///< of the driver, 3 to 32
};

/// "camera:NODE?key=value&..." with any of the keys format, size, fps, exposure (8ms, 500us, 0.01s, auto,
/// locked), gain (N, auto, locked), white_balance (4500, auto, locked), timeout (s), buffers, and
/// control.NAME. Throws Error(Failure::Usage) that lists what exists.
CameraOptions parse_camera(const std::string& input);
/// The inverse; only what differs from the default.
std::string to_string(const CameraOptions& options);
/// True for "camera:...".
bool is_camera(const std::string& input);

/// What the camera would deliver to an uncalibrated sensor: colour where it has any, else gray of its most
/// bits, unless a format is named. Opens the camera and closes it again. Throws Error(Failure::Device).
FrameFormat camera_format(const CameraOptions& options);

/// Frames of a camera. It survives what happens to cameras: damaged buffers are left out and counted, lost
/// frames are counted and leave gaps in the sequence, a stream that stalls or fails is started again, a
/// camera that was unplugged is opened again when it is back in the same port. After such an outage the
/// sequence goes on by the time that passed.
///
/// Where the driver's buffer is the frame (one gray plane without padding, no crop or quad), no pixel is
/// copied: the frame leases the buffer. Two buffers always stay with the driver; a frame beyond that is
/// copied.
class Camera : public Source {
 public:
  /// Opens, sets up and starts the camera. Throws Error(Failure::Device) where it is missing, busy, closed to
  /// this user, or cannot do what is asked; Error(Failure::Input) where its frames do not fit the sensor.
  Camera(const CameraOptions& options, const Sensor& sensor);
  ~Camera() override;

  FrameFormat format() const override;
  double rate_Hz() const override;
  std::optional<uint64_t> frame_count() const override { return std::nullopt; }
  /// Waits for a frame as long as it takes; false only when cancelled. Throws Error(Failure::Input) where the
  /// first frames hold values above the format's bits.
  bool next(Frame& frame) override;
  bool live() const override { return true; }
  CaptureCounts counts() const override;
  std::string state() const override;
  void watch(const std::function<bool()>& cancelled) override;
  std::vector<std::pair<std::string, std::string>> details() const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
