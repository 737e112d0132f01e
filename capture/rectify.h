// Rectification: from an image as stored to the frame that the engine measures: crop, lens, perspective,
// channels, bit depth, flat field.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace cv {
class Mat;
}

namespace palpate {

/// Built for images of one size; `apply` allocates nothing new from the second image on. One thread at a
/// time.
class Rectifier {
 public:
  /// `where` names the input in messages. Channels or bits of the sensor that are 0 are those of the images,
  /// in colour of 8 bits only. Throws Error(Failure::Input) where the images cannot serve the
  /// sensor: crop or quad outside the image, another size than size_px, gray images for a colour sensor,
  /// 8-bit images for more bits, a flat field of another size.
  Rectifier(const Sensor& sensor, const cv::Mat& first_image, const std::string& where);
  ~Rectifier();
  Rectifier(Rectifier&&) noexcept;

  /// The same of an image whose planes a Frame has, of the camera's size and bit depth.
  Rectifier(const Sensor& sensor, const Frame& first_image, const std::string& where);

  FrameFormat format() const { return format_; }
  /// Fills the pixels of `frame`. Throws Error(Failure::Input) that names `where` when the image differs from
  /// the first in size or type, or holds values above the sensor's bit depth.
  void apply(const cv::Mat& image, const std::string& where, Frame& frame);
  /// And its number and times.
  void apply(const Frame& image, const std::string& where, Frame& frame);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  FrameFormat format_;
};

/// Where a place of the rectified frame lies in the camera's picture, px from the centre of its upper left
/// pixel: through quad, lens and crop. For sensors that a Rectifier was built for.
std::array<double, 2> camera_place(const Sensor& sensor, double x_px, double y_px);

}  // namespace palpate
