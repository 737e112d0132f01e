// A camera of this machine (V4L2) as a source of frames.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/camera/camera_options.h"
#include "capture/source.h"

namespace palpate {

/// Format that the camera would deliver to an uncalibrated sensor. Opens the camera and closes it again.
/// Throws Error(Failure::Device).
FrameFormat linux_camera_format(const CameraOptions& options);

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
  /// An exposure that does not fit the rate, or frames that come at another. Any thread, at any time.
  std::string warning() const override;
  void watch(const std::function<bool()>& cancelled) override;
  std::vector<std::pair<std::string, std::string>> details() const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
