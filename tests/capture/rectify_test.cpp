// From a place of the rectified frame back to the camera's picture: the way that the pixels took.
#include "capture/rectify.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

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

}  // namespace
}  // namespace palpate
