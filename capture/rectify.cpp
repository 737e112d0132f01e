#include "capture/rectify.h"

#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "engine/error.h"

namespace palpate {
namespace {

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height) + " px";
}

std::string type_text(const cv::Mat& image) {
  const std::string bits = image.depth() == CV_8U    ? "8-bit "
                           : image.depth() == CV_16U ? "16-bit "
                                                     : "floating-point ";
  return bits + (image.channels() == 1 ? "gray" : "colour");
}

cv::Rect crop_of(const Sensor& sensor, const cv::Mat& image, const std::string& where) {
  if (!sensor.crop_px) return {0, 0, image.cols, image.rows};
  const auto [x, y, w, h] = *sensor.crop_px;
  if (w == 0 || h == 0 || uint64_t{x} + w > static_cast<uint64_t>(image.cols) ||
      uint64_t{y} + h > static_cast<uint64_t>(image.rows))
    throw Error(
        Failure::Input,
        "images that hold the sensor's crop_px (" + size_text(static_cast<int>(w), static_cast<int>(h)) +
            " at " + std::to_string(x) + ", " + std::to_string(y) + ")",
        where + " of " + size_text(image.cols, image.rows), "the sensor file that belongs to this recording");
  return {static_cast<int>(x), static_cast<int>(y), static_cast<int>(w), static_cast<int>(h)};
}

}  // namespace

struct Rectifier::Impl {
  Sensor sensor;
  cv::Size input;
  int type = 0;
  cv::Rect crop;
  cv::Mat map_xy, map_fraction;  // empty without a quad
  cv::Mat gray, warped;

  void make_maps(const std::string& where) {
    const int w = static_cast<int>(sensor.size_px[0]), h = static_cast<int>(sensor.size_px[1]);
    const auto right = static_cast<float>(w - 1), bottom = static_cast<float>(h - 1);
    std::array<cv::Point2f, 4> from, to = {{{0, 0}, {right, 0}, {right, bottom}, {0, bottom}}};
    for (int i = 0; i < 4; ++i) {
      const auto [x, y] = (*sensor.quad_px)[i];
      if (!(x >= -1 && y >= -1 && x <= crop.width && y <= crop.height))
        throw Error(Failure::Input, "images that hold the sensor's quad_px",
                    "corner " + std::to_string(x) + ", " + std::to_string(y) + " outside " + where +
                        " (cropped to " + size_text(crop.width, crop.height) + ")",
                    "the sensor file that belongs to this recording");
      from[i] = {static_cast<float>(x), static_cast<float>(y)};
    }
    // A side of one pixel has no direction of its own; half a pixel either way stands for it.
    if (w == 1) to[1].x = to[2].x = 1;
    if (h == 1) to[2].y = to[3].y = 1;
    const cv::Matx33d back = cv::getPerspectiveTransform(to.data(), from.data());
    cv::Mat map(h, w, CV_32FC2);
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        const cv::Vec3d p = back * cv::Vec3d(x, y, 1);
        if (!(std::abs(p[2]) > 1e-12))
          throw Error(Failure::Sensor, "quad_px of four corners of a convex quadrangle",
                      "corners that fold over", "the order top left, top right, bottom right, bottom left");
        map.at<cv::Vec2f>(y, x) = {static_cast<float>(p[0] / p[2]), static_cast<float>(p[1] / p[2])};
      }
    }
    cv::convertMaps(map, cv::noArray(), map_xy, map_fraction, CV_16SC2);
  }
};

Rectifier::Rectifier(const Sensor& sensor, const cv::Mat& image, const std::string& where)
    : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  m.sensor = sensor;
  m.input = image.size();
  m.type = image.type();
  if (image.depth() != CV_8U && image.depth() != CV_16U)
    throw Error(Failure::Input, "images of 8 or 16 bits", where + " of " + type_text(image) + " pixels",
                "converting them to 16 bits");
  if (image.channels() != 1 && image.channels() != 3)
    throw Error(Failure::Input, "images of one or three channels",
                where + " of " + std::to_string(image.channels()), "converting them to gray or colour");
  if (image.depth() == CV_8U && sensor.bit_depth > 8)
    throw Error(Failure::Input,
                "16-bit images (the sensor has " + std::to_string(sensor.bit_depth) + " bits)",
                where + " of " + type_text(image) + " pixels",
                "\"bit_depth\": 8 in the sensor file, or 16-bit image files");
  if (image.depth() == CV_16U && sensor.bit_depth == 8)
    throw Error(Failure::Input, "8-bit images (the sensor has 8 bits)",
                where + " of " + type_text(image) + " pixels",
                "\"bit_depth\": 16 (or the camera's own) in the sensor file");
  if (sensor.channels == 3 && image.channels() == 1)
    throw Error(Failure::Input, "colour images (the sensor has 3 channels)", where + " of gray pixels",
                "\"channels\": 1 in the sensor file, or the colour recording");
  m.crop = crop_of(sensor, image, where);
  uint32_t width = static_cast<uint32_t>(m.crop.width), height = static_cast<uint32_t>(m.crop.height);
  if (sensor.quad_px) {
    width = sensor.size_px[0];
    height = sensor.size_px[1];
    m.make_maps(where);
  } else if (sensor.size_px[0] != 0 && (sensor.size_px[0] != width || sensor.size_px[1] != height)) {
    throw Error(Failure::Input,
                "images of the sensor's size_px " +
                    size_text(static_cast<int>(sensor.size_px[0]), static_cast<int>(sensor.size_px[1])),
                where + " of " + size_text(m.crop.width, m.crop.height),
                "the sensor file that belongs to this recording");
  }
  if (width > kMaxSide_px || height > kMaxSide_px)
    throw Error(Failure::Input, "sides of at most " + std::to_string(kMaxSide_px) + " px",
                where + " of " + size_text(static_cast<int>(width), static_cast<int>(height)),
                "a crop in the sensor file");
  format_ = {width, height, sensor.channels, sensor.bit_depth};
}

Rectifier::~Rectifier() = default;
Rectifier::Rectifier(Rectifier&&) noexcept = default;

void Rectifier::apply(const cv::Mat& image, const std::string& where, Frame& frame) {
  Impl& m = *impl_;
  if (image.size() != m.input)
    throw Error(Failure::Input,
                "images of one size, " + size_text(m.input.width, m.input.height) + " as the first",
                where + " of " + size_text(image.cols, image.rows), "recordings of one size each");
  if (image.depth() != CV_MAT_DEPTH(m.type) || (image.channels() == 1 && format_.channels == 3))
    throw Error(Failure::Input, "images of one kind, as the first",
                where + " of " + type_text(image) + " pixels", "recordings of one kind each");
  frame.reshape(format_);
  cv::Mat source = image(m.crop);
  if (format_.channels == 1 && source.channels() == 3) {
    cv::cvtColor(source, m.gray, cv::COLOR_BGR2GRAY);
    source = m.gray;
  }
  const int depth = CV_MAT_DEPTH(m.type);
  std::array<cv::Mat, 3> planes;
  for (uint32_t c = 0; c < format_.channels; ++c)
    planes[c] =
        cv::Mat(static_cast<int>(format_.height), static_cast<int>(format_.width), depth, frame.row(c, 0));
  cv::Mat rectified = source;
  if (!m.map_xy.empty()) {
    if (format_.channels == 1) m.warped = planes[0];  // straight into the frame
    cv::remap(source, m.warped, m.map_xy, m.map_fraction, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    rectified = m.warped;
  }
  if (format_.channels == 3) {
    constexpr int kBgrToPlanes[] = {2, 0, 1, 1, 0, 2};
    cv::mixChannels(&rectified, 1, planes.data(), 3, kBgrToPlanes, 3);
  } else if (rectified.data != planes[0].data) {
    rectified.copyTo(planes[0]);
  }
  if (format_.channels == 1) m.warped.release();  // it may point into the caller's frame
  if (format_.bit_depth > 8 && format_.bit_depth < 16) {
    for (uint32_t c = 0; c < format_.channels; ++c) {
      double largest = 0;
      cv::minMaxLoc(planes[c], nullptr, &largest);
      if (largest > format_.max_gray())
        throw Error(Failure::Input,
                    "pixel values up to " + std::to_string(format_.max_gray()) + " (the sensor has " +
                        std::to_string(format_.bit_depth) + " bits)",
                    where + " with " + std::to_string(static_cast<int>(largest)),
                    "\"bit_depth\": 16 in the sensor file (some cameras write 12 bits in the high bits)");
    }
  }
}

}  // namespace palpate
