// What an input without a sensor file is taken for: colour, gray, gray of 16 bits.
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "capture/run/input.h"
#include "palpate/error.h"
#include "tests/support/test_folder.h"

namespace palpate {
namespace {

class BareSensor : public testing::Test {
 protected:
  BareSensor() : folder_(test_folder("bare")) {}
  ~BareSensor() override { std::filesystem::remove_all(folder_); }

  /// Channels and bits of an image of that type and colour.
  std::pair<uint32_t, uint32_t> of_image(int type, const cv::Scalar& colour) {
    const std::string file = folder_ / "image.png";
    cv::imwrite(file, cv::Mat(20, 30, type, colour));
    const Sensor sensor = bare_sensor(file);
    EXPECT_EQ(sensor.saturation_gray, (1u << sensor.bit_depth) - 1);
    return {sensor.channels, sensor.bit_depth};
  }
  using Format = std::pair<uint32_t, uint32_t>;
  std::filesystem::path folder_;
};

TEST_F(BareSensor, TakesImagesAsTheyAre) {
  EXPECT_EQ(of_image(CV_8UC1, {90}), Format(1, 8));
  EXPECT_EQ(of_image(CV_8UC3, {90, 120, 30}), Format(3, 8));
  EXPECT_EQ(of_image(CV_8UC3, {90, 90, 90}), Format(1, 8)) << "colour without any is gray";
  EXPECT_EQ(of_image(CV_16UC1, {9000}), Format(1, 16));
  EXPECT_EQ(of_image(CV_16UC3, {9000, 100, 50}), Format(1, 16)) << "colour has 8 bits";
}

TEST_F(BareSensor, TakesAScenesFormat) {
  const Sensor gray = bare_sensor("synthetic:press?bits=12&size=64x48");
  EXPECT_EQ(gray.channels, 1u);
  EXPECT_EQ(gray.bit_depth, 12u);
  EXPECT_EQ(bare_sensor("synthetic:press?mode=gel&size=64x48").channels, 3u);
}

TEST_F(BareSensor, RefusesWhatIsNoImageByItsName) {
  try {
    bare_sensor(folder_ / "nothing.png");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::Input);
    EXPECT_NE(std::string(error.what()).find("nothing.png"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace palpate
