#include "capture/camera/camera_picture.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <utility>

#include "capture/rectify.h"

namespace palpate {

struct CameraPicture::Impl {
  cv::Mat image;
  Rectifier rectifier;

  Impl(const Sensor& sensor, cv::Mat first, const std::string& where)
      : image(std::move(first)), rectifier(sensor, image, where) {}
};

CameraPicture::CameraPicture(const Sensor& sensor, const PixelFormat& format, uint32_t channels,
                             uint32_t width, uint32_t height, std::string where)
    : pixels_(format),
      channels_(channels),
      where_(std::move(where)),
      straight_(!sensor.crop_px && !sensor.quad_px && !sensor.lens && !sensor.flat && channels == 1) {
  const int type = CV_MAKETYPE(format.bit_depth > 8 ? CV_16U : CV_8U, static_cast<int>(channels));
  impl_ = std::make_unique<Impl>(sensor, cv::Mat(static_cast<int>(height), static_cast<int>(width), type),
                                 where_);
  frame_ = impl_->rectifier.format();
  if (straight_) impl_->image.release();
}

CameraPicture::~CameraPicture() = default;

bool CameraPicture::is_frame(uint32_t stride_bytes) const {
  return straight_ && (pixels_.layout == PixelLayout::Gray8 || pixels_.layout == PixelLayout::Gray16) &&
         stride_bytes == least_stride_bytes(pixels_, frame_.width);
}

const char* CameraPicture::copies(uint32_t stride_bytes) const {
  return is_frame(stride_bytes) ? "0 (leased)" : straight_ ? "1 (decoded)" : "2 (decoded, rectified)";
}

// Values of two bytes that neither the format nor the sensor has.
CameraPicture::Fault CameraPicture::too_bright(const RawImage& raw) const {
  const uint32_t bits = std::min(pixels_.bit_depth, frame_.bit_depth);
  if (pixels_.bit_depth <= 8 || bits >= 16) return {};
  const uint32_t largest = largest_value(raw);
  if (largest >> bits == 0) return {};
  return {"a value of " + std::to_string(largest) + " in " + std::to_string(bits) + " bits", true};
}

CameraPicture::Fault CameraPicture::look_at(const RawImage& raw) const {
  if (const size_t needed = needed_bytes(pixels_, raw); raw.bytes.size() < needed)
    return {std::to_string(raw.bytes.size()) + " bytes in place of " + std::to_string(needed)};
  return too_bright(raw);
}

CameraPicture::Fault CameraPicture::fill(const RawImage& raw, Frame& frame) {
  cv::Mat& image = impl_->image;
  frame.reshape(frame_);
  if (straight_)
    image = cv::Mat(static_cast<int>(frame_.height), static_cast<int>(frame_.width),
                    frame_.bit_depth > 8 ? CV_16UC1 : CV_8UC1, frame.row(0, 0));
  Fault fault{decode(pixels_, raw, channels_, image)};
  const size_t bytes = static_cast<size_t>(image.rows) * image.step;
  if (fault.words.empty())
    fault = too_bright({{image.data, bytes},
                        static_cast<uint32_t>(image.cols),
                        static_cast<uint32_t>(image.rows),
                        static_cast<uint32_t>(image.step)});
  if (!fault.words.empty()) return fault;
  if (straight_)
    image.release();
  else
    impl_->rectifier.apply(image, where_, frame);
  return {};
}

}  // namespace palpate
