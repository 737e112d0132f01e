// From a camera's buffer to the pixels of a frame.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "capture/camera/formats.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

class CameraPicture {
 public:
  /// Pictures have one format and size, and are decoded to `channels`. `where` names the camera in messages.
  /// Throws Error(Failure::Input) where they do not fit the sensor.
  CameraPicture(const Sensor& sensor, const PixelFormat& format, uint32_t channels, uint32_t width,
                uint32_t height, std::string where);
  ~CameraPicture();

  FrameFormat format() const { return frame_; }
  /// "0 (leased)" where buffers with rows so far apart are frames as they are, "1 (decoded)", or "2 (decoded,
  /// rectified)".
  const char* copies(uint32_t stride_bytes) const;
  bool is_frame(uint32_t stride_bytes) const;

  /// Fault of pixels; without words there is none.
  struct Fault {
    std::string words;
    bool of_format = false;  ///< values that the format does not have
  };
  /// Fault of a buffer that is a frame as it is.
  Fault look_at(const RawImage& raw) const;
  /// Decodes and rectifies into `frame`.
  Fault fill(const RawImage& raw, Frame& frame);

 private:
  struct Impl;
  Fault too_bright(const RawImage& raw) const;

  const PixelFormat& pixels_;
  uint32_t channels_;
  std::string where_;
  FrameFormat frame_;
  bool straight_;  // the camera's pixels are the frame's: no crop, no perspective, one plane
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
