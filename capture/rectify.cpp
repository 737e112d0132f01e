#include "capture/rectify.h"

#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/files/images/images.h"
#include "palpate/error.h"

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

// Where a place of the image without distortion lies in the cropped image as the lens made it.
cv::Point2d through_lens(const Sensor& sensor, double x, double y) {
  if (!sensor.lens) return {x, y};
  const Lens& l = *sensor.lens;
  const auto [k1, k2, p1, p2, k3] = l.distortion;
  const double u = (x - l.cx_px) / l.fx_px, v = (y - l.cy_px) / l.fy_px, r2 = u * u + v * v;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {l.cx_px + l.fx_px * (u * radial + 2 * p1 * u * v + p2 * (r2 + 2 * u * u)),
          l.cy_px + l.fy_px * (v * radial + p1 * (r2 + 2 * v * v) + 2 * p2 * u * v)};
}

// From the rectified frame of a sensor with a quad to the image without distortion.
cv::Matx33d back_from_quad(const Sensor& sensor) {
  const int w = static_cast<int>(sensor.size_px[0]), h = static_cast<int>(sensor.size_px[1]);
  const auto right = static_cast<float>(w - 1), bottom = static_cast<float>(h - 1);
  std::array<cv::Point2f, 4> from, to = {{{0, 0}, {right, 0}, {right, bottom}, {0, bottom}}};
  for (size_t i = 0; i < 4; ++i) {
    const auto [x, y] = (*sensor.quad_px)[i];
    from[i] = {static_cast<float>(x), static_cast<float>(y)};
  }
  // A side of one pixel has no direction of its own; half a pixel either way stands for it.
  if (w == 1) to[1].x = to[2].x = 1;
  if (h == 1) to[2].y = to[3].y = 1;
  return cv::getPerspectiveTransform(to.data(), from.data());
}

// Without a copy where it is gray; of the image's lifetime.
cv::Mat mat_of(const Frame& image) {
  const FrameFormat& f = image.format;
  const auto plane = [&](uint32_t channel) {
    return cv::Mat(static_cast<int>(f.height), static_cast<int>(f.width), f.bit_depth > 8 ? CV_16U : CV_8U,
                   const_cast<uint8_t*>(image.row(channel, 0)));
  };
  if (f.channels != 3) return plane(0);
  const std::array<cv::Mat, 3> planes = {plane(2), plane(1), plane(0)};
  cv::Mat colours;
  cv::merge(planes.data(), planes.size(), colours);
  return colours;
}

}  // namespace

std::array<double, 2> camera_place(const Sensor& sensor, double x_px, double y_px) {
  if (sensor.quad_px) {
    const cv::Vec3d p = back_from_quad(sensor) * cv::Vec3d(x_px, y_px, 1);
    x_px = p[0] / p[2];
    y_px = p[1] / p[2];
  }
  const cv::Point2d seen = through_lens(sensor, x_px, y_px);
  const std::array<uint32_t, 4> crop = sensor.crop_px.value_or(std::array<uint32_t, 4>{});
  return {seen.x + crop[0], seen.y + crop[1]};
}

struct Rectifier::Impl {
  Sensor sensor;
  cv::Size input;
  int type = 0;
  cv::Rect crop;
  cv::Mat map_xy, map_fraction;  // empty without a quad and a lens
  cv::Mat gray, warped;
  cv::Mat flat;  // 16 bits, of the rectified size; empty without a flat field

  // The lens alone: the rectified frame has the size of the cropped image.
  void make_lens_maps() {
    cv::Mat map(crop.height, crop.width, CV_32FC2);
    for (int y = 0; y < map.rows; ++y)
      for (int x = 0; x < map.cols; ++x) {
        const cv::Point2d from = through_lens(sensor, x, y);
        map.at<cv::Vec2f>(y, x) = {static_cast<float>(from.x), static_cast<float>(from.y)};
      }
    cv::convertMaps(map, cv::noArray(), map_xy, map_fraction, CV_16SC2);
  }

  void load_flat(uint32_t width, uint32_t height) {
    const std::string& file = sensor.flat->image;
    flat = read_image(file);
    if (flat.type() != CV_16UC1 || flat.cols != static_cast<int>(width) ||
        flat.rows != static_cast<int>(height))
      throw Error(Failure::Input,
                  "a flat field of 16-bit gray, " +
                      size_text(static_cast<int>(width), static_cast<int>(height)) +
                      " as the rectified frame",
                  file + " of " + type_text(flat) + ", " + size_text(flat.cols, flat.rows),
                  "palpate calibrate flat for this camera mode");
  }

  // gray * gain * image, rounded and clipped; what is saturated stays as it is.
  template <class Value>
  void flatten(Frame& frame) const {
    const FrameFormat& f = frame.format;
    const auto gain = static_cast<float>(sensor.flat->gain), top = static_cast<float>(f.max_gray());
    const uint32_t saturated = sensor.saturation_gray;
    for (uint32_t c = 0; c < f.channels; ++c)
      for (uint32_t y = 0; y < f.height; ++y) {
        Value* row = reinterpret_cast<Value*>(frame.row(c, y));
        const auto* by = flat.ptr<uint16_t>(static_cast<int>(y));
        for (uint32_t x = 0; x < f.width; ++x) {
          const float value = static_cast<float>(row[x]) * gain * static_cast<float>(by[x]) + 0.5f;
          row[x] = row[x] >= saturated ? row[x] : static_cast<Value>(std::min(value, top));
        }
      }
  }

  void make_maps(const std::string& where) {
    const int w = static_cast<int>(sensor.size_px[0]), h = static_cast<int>(sensor.size_px[1]);
    for (const auto& [x, y] : *sensor.quad_px) {
      const cv::Point2d seen = through_lens(sensor, x, y);
      if (!(seen.x >= -1 && seen.y >= -1 && seen.x <= crop.width && seen.y <= crop.height))
        throw Error(Failure::Input, "images that hold the sensor's quad_px",
                    "corner " + std::to_string(x) + ", " + std::to_string(y) + " outside " + where +
                        " (cropped to " + size_text(crop.width, crop.height) + ")",
                    "the sensor file that belongs to this recording");
    }
    const cv::Matx33d back = back_from_quad(sensor);
    cv::Mat map(h, w, CV_32FC2);
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        const cv::Vec3d p = back * cv::Vec3d(x, y, 1);
        if (!(std::abs(p[2]) > 1e-12))
          throw Error(Failure::Sensor, "quad_px of four corners of a convex quadrangle",
                      "corners that fold over", "the order top left, top right, bottom right, bottom left");
        const cv::Point2d seen = through_lens(sensor, p[0] / p[2], p[1] / p[2]);
        map.at<cv::Vec2f>(y, x) = {static_cast<float>(seen.x), static_cast<float>(seen.y)};
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
  if (sensor.camera_px[0] != 0 && (static_cast<int>(sensor.camera_px[0]) != image.cols ||
                                   static_cast<int>(sensor.camera_px[1]) != image.rows))
    throw Error(Failure::Input,
                "images of " +
                    size_text(static_cast<int>(sensor.camera_px[0]), static_cast<int>(sensor.camera_px[1])) +
                    ", the sensor's camera_px",
                where + " of " + size_text(image.cols, image.rows),
                "the sensor file that was made with this camera mode");
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
  if (sensor.lens && !sensor.quad_px) m.make_lens_maps();
  if (sensor.flat) m.load_flat(width, height);
  const bool colour = image.channels() == 3 && image.depth() == CV_8U;
  format_ = {width, height,
             sensor.channels != 0 ? sensor.channels
             : colour             ? 3u
                                  : 1u,
             sensor.bit_depth != 0    ? sensor.bit_depth
             : image.depth() == CV_8U ? 8u
                                      : 16u};
}

Rectifier::Rectifier(const Sensor& sensor, const Frame& first_image, const std::string& where)
    : Rectifier(sensor, mat_of(first_image), where) {}

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
  if (!m.flat.empty()) {
    if (format_.bit_depth > 8)
      m.flatten<uint16_t>(frame);
    else
      m.flatten<uint8_t>(frame);
  }
}

void Rectifier::apply(const Frame& image, const std::string& where, Frame& frame) {
  apply(mat_of(image), where, frame);
  frame.sequence = image.sequence;
  frame.time_ns = image.time_ns;
  frame.exposed_ns = image.exposed_ns;
  frame.delivered_ns = image.delivered_ns;
  frame.after_gap = image.after_gap;
}

}  // namespace palpate
