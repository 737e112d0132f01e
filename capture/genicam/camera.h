// A GenICam camera (USB3 Vision, GigE Vision) as a source of frames.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/camera/camera_options.h"
#include "capture/source.h"

namespace palpate {

/// True where the options name a GenICam camera: "genicam:ID", "genicam:" for the first one.
bool is_genicam(const CameraOptions& options);

/// Format that the camera would deliver to an uncalibrated sensor. Opens the camera and closes it again.
/// Throws Error(Failure::Device).
FrameFormat genicam_format(const CameraOptions& options);

/// Frames of a GenICam camera, as those of a camera of Linux (v4l2/camera.h): damaged frames are left out and
/// counted, lost ones are counted and leave gaps in the sequence, a stream that stalls is started again, and
/// a camera that was unplugged is opened again once it answers. Times are the camera's own, on the host's
/// clock by the shortest way that a frame took.
///
/// A gray frame without crop, quad, lens and flat field is not copied: it leases the buffer.
class GenicamCamera : public Source {
 public:
  /// Opens, sets up and starts the camera. Throws Error(Failure::Device) where it is missing, held by another
  /// program, or cannot do what is asked; Error(Failure::Input) where its frames do not fit the sensor.
  GenicamCamera(const CameraOptions& options, const Sensor& sensor);
  ~GenicamCamera() override;

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
