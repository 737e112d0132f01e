// From a place of the rectified frame back to the camera's picture: the way that the pixels took.
#include "capture/rectify.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "palpate/error.h"

namespace palpate {
namespace {

/// Bright spot of a picture of 200 x 150 px at `place`, as it lies in the rectified frame.
std::array<double, 2> spot_in_frame(const Sensor& sensor, const std::array<double, 2>& place) {
  cv::Mat picture(150, 200, CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x)
      picture.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(
          200 * std::exp(-0.05 * (std::pow(x - place[0], 2) + std::pow(y - place[1], 2))));
  Rectifier rectifier(sensor, picture, "a picture");
  Frame frame;
  rectifier.apply(picture, "a picture", frame);
  double sum = 0, sum_x = 0, sum_y = 0;
  for (uint32_t y = 0; y < frame.format.height; ++y)
    for (uint32_t x = 0; x < frame.format.width; ++x) {
      const double value = frame.at(0, x, y);
      sum += value;
      sum_x += value * x;
      sum_y += value * y;
    }
  return {sum_x / sum, sum_y / sum};
}

TEST(CameraPlace, IsWhereThePixelsCameFrom) {
  Sensor plain;
  Sensor cropped = plain;
  cropped.crop_px = {20, 10, 160, 120};
  Sensor straightened = cropped;
  straightened.quad_px = {{{15, 12}, {140, 20}, {150, 110}, {8, 100}}};
  straightened.size_px = {130, 95};
  Sensor through_lens = straightened;
  through_lens.lens = Lens{.fx_px = 150, .fy_px = 150, .cx_px = 80, .cy_px = 60};
  through_lens.lens->distortion = {-0.15, 0.02, 0, 0, 0};
  for (const Sensor& sensor : {plain, cropped, straightened, through_lens})
    for (const auto& [x, y] : {std::pair{40.0, 30.0}, {100.0, 40.0}, {65.0, 70.0}}) {
      const auto found = spot_in_frame(sensor, camera_place(sensor, x, y));
      EXPECT_NEAR(found[0], x, 0.35);
      EXPECT_NEAR(found[1], y, 0.35);
    }
}

// Pixels that somebody else's camera has delivered.
TEST(Rectifier, TakesFramesAsPictures) {
  for (const uint32_t bits : {8u, 12u})
    for (const uint32_t channels : {1u, 3u}) {
      Sensor sensor;
      sensor.channels = channels;
      sensor.bit_depth = bits;
      sensor.crop_px = {3, 2, 40, 30};
      sensor.quad_px = {{{2, 1}, {35, 3}, {36, 27}, {1, 25}}};
      sensor.size_px = {32, 24};
      Frame image, from_frame, from_picture;
      image.reshape({48, 36, channels, bits});
      image.sequence = 7;
      image.time_ns = 9;
      cv::Mat picture(36, 48, CV_MAKETYPE(bits > 8 ? CV_16U : CV_8U, static_cast<int>(channels)));
      for (uint32_t c = 0; c < channels; ++c)
        for (uint32_t y = 0; y < 36; ++y)
          for (uint32_t x = 0; x < 48; ++x) {
            const uint32_t value = 5 * x + 2 * y + 20 * c;
            image.set(c, x, y, value);
            const size_t at = x * channels + (channels - 1 - c);  // OpenCV's colours begin with blue
            if (bits > 8)
              picture.ptr<uint16_t>(static_cast<int>(y))[at] = static_cast<uint16_t>(value);
            else
              picture.ptr<uint8_t>(static_cast<int>(y))[at] = static_cast<uint8_t>(value);
          }
      Rectifier(sensor, image, "a frame").apply(image, "a frame", from_frame);
      Rectifier(sensor, picture, "a picture").apply(picture, "a picture", from_picture);
      EXPECT_EQ(from_frame.format, from_picture.format);
      EXPECT_EQ(from_frame.bytes, from_picture.bytes) << channels << " channels of " << bits << " bits";
      EXPECT_NE(from_frame.at(channels - 1, 3, 4), from_frame.at(0, 20, 4));
      EXPECT_EQ(from_frame.sequence, 7u);
      EXPECT_EQ(from_frame.time_ns, 9);
      Frame other;
      other.reshape({48, 35, channels, bits});
      EXPECT_THROW(Rectifier(sensor, image, "a frame").apply(other, "another", from_frame), Error);
    }
}

}  // namespace
}  // namespace palpate
