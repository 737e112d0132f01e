// Heights from images under several lights: calibrated on a known shape, then used to measure another, on the
// command line.
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "capture/files/npy.h"
#include "engine/calibrate/light_stack_check.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

constexpr uint32_t kPhotoWidth = 120, kPhotoHeight = 96, kLights = 6;
constexpr double kPitch_mm = 0.05;

/// Smooth bumps, mm.
std::vector<float> shape(uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(0, 1);
  std::vector<float> height_mm(size_t{kPhotoWidth} * kPhotoHeight);
  for (int bump = 0; bump < 12; ++bump) {
    const double x0 = place(random) * kPhotoWidth, y0 = place(random) * kPhotoHeight,
                 size_px = 6 + 10 * place(random), top_mm = 0.2 * (place(random) - 0.5);
    for (uint32_t y = 0; y < kPhotoHeight; ++y)
      for (uint32_t x = 0; x < kPhotoWidth; ++x)
        height_mm[size_t{y} * kPhotoWidth + x] += static_cast<float>(
            top_mm * std::exp(-((x - x0) * (x - x0) + (y - y0) * (y - y0)) / (2 * size_px * size_px)));
  }
  return height_mm;
}

/// Matt, under lights from all around, one image each.
void photograph(const std::vector<float>& height_mm, const fs::path& folder) {
  fs::create_directories(folder);
  for (uint32_t k = 0; k < kLights; ++k) {
    const double turn = 2 * M_PI * k / kLights, lx = 0.6 * std::cos(turn), ly = 0.6 * std::sin(turn);
    cv::Mat image(kPhotoHeight, kPhotoWidth, CV_16U);
    for (uint32_t y = 0; y < kPhotoHeight; ++y)
      for (uint32_t x = 0; x < kPhotoWidth; ++x) {
        const auto at = [&](uint32_t u, uint32_t v) {
          return static_cast<double>(
              height_mm[size_t{std::min(v, kPhotoHeight - 1)} * kPhotoWidth + std::min(u, kPhotoWidth - 1)]);
        };
        const double p = (at(x + 1, y) - at(x > 0 ? x - 1 : 0, y)) / (2 * kPitch_mm),
                     q = (at(x, y + 1) - at(x, y > 0 ? y - 1 : 0)) / (2 * kPitch_mm);
        const double light = (0.8 - lx * p - ly * q) / std::sqrt(1 + p * p + q * q);
        image.at<uint16_t>(static_cast<int>(y), static_cast<int>(x)) =
            static_cast<uint16_t>(40000 * std::max(light, 0.0));
      }
    cv::imwrite((folder / ("light" + std::to_string(k + 1) + ".png")).string(), image);
  }
}

std::vector<std::string> images_of(const fs::path& folder, uint32_t lights = kLights) {
  std::vector<std::string> files;
  for (uint32_t k = 0; k < lights; ++k)
    files.push_back((folder / ("light" + std::to_string(k + 1) + ".png")).string());
  return files;
}

std::vector<std::string> command(std::vector<std::string> words, const std::vector<std::string>& images,
                                 const std::vector<std::string>& options) {
  words.insert(words.end(), images.begin(), images.end());
  words.insert(words.end(), options.begin(), options.end());
  return words;
}

class Lights : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    for (const uint32_t seed : {1u, 2u}) {
      const std::string name = std::to_string(seed);
      photograph(shape(seed), folder_ / name);
      write_npy(folder_ / (name + ".npy"), shape(seed), {kPhotoHeight, kPhotoWidth});
    }
  }
  Ended calibrated() {
    return run(command(
        {"calibrate", "lights"}, images_of(folder_ / "1"),
        {"--height", folder_ / "1.npy", "--pitch", "0.05", "--out", folder_ / "lights.json", "--json"}));
  }
};

TEST_F(Lights, AnotherShapeIsMeasured) {
  const Ended made = calibrated();
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Json said = parse_json(made.out);
  EXPECT_EQ(said.at("lights"), kLights);
  EXPECT_EQ(said.at("orders").size(), 3u);
  EXPECT_GT(said.at("explained_x").get<double>(), 0.97);
  const Ended measured = run(command({"integrate"}, images_of(folder_ / "2"),
                                     {"--lights", folder_ / "lights.json", "--truth", folder_ / "2.npy",
                                      "--out", folder_ / "out", "--json"}));
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  const Json value = parse_json(measured.out);
  const NpyArray height = read_npy(folder_ / "out" / "height.npy");
  ASSERT_EQ(height.shape, (std::vector<size_t>{kPhotoHeight, kPhotoWidth}));
  const std::vector<float> truth = shape(2);
  const auto [low, high] = std::minmax_element(truth.begin(), truth.end());
  const double range_mm = static_cast<double>(*high - *low);
  const std::vector<uint8_t> all(truth.size(), 1);
  const double error_mm = levelled_error(height.values, truth, all, kPhotoWidth).rms_mm;
  EXPECT_NEAR(value.at("rms_error_mm").get<double>(), error_mm, 1e-9);
  // Fractions are linear in the slope to first order only, and the light is evened over a fifth of the frame.
  EXPECT_LT(error_mm, 0.08 * range_mm);
  EXPECT_GT(error_mm, 1e-6) << "not the truth itself";
  // Without truth the heights are the same.
  const Ended blind = run(command({"integrate"}, images_of(folder_ / "2"),
                                  {"--lights", folder_ / "lights.json", "--out", folder_ / "blind"}));
  EXPECT_EQ(blind.exit_code, 0) << blind.err;
  EXPECT_EQ(slurp(folder_ / "out" / "height.npy"), slurp(folder_ / "blind" / "height.npy"));
}

TEST_F(Lights, RefusesWhatDoesNotFit) {
  const auto calibrate = [&](const std::vector<std::string>& images, const fs::path& height,
                             const std::string& pitch) {
    return command({"calibrate", "lights"}, images,
                   {"--height", height, "--pitch", pitch, "--out", folder_ / "l.json"});
  };
  const std::vector<std::string> images = images_of(folder_ / "1");
  expect_refusal(calibrate(images_of(folder_ / "1", 2), folder_ / "1.npy", "0.05"), 3, {"3 to 64 images"});
  expect_refusal(calibrate(images, folder_ / "none.npy", "0.05"), 3, {"no such file"});
  expect_refusal(calibrate(images, folder_ / "1.npy", "-1"), 2, {"pitch"});
  write_npy(folder_ / "small.npy", std::vector<float>(12), {3, 4});
  expect_refusal(calibrate(images, folder_ / "small.npy", "0.05"), 3, {"96 x 120", "3 x 4"});
  write_npy(folder_ / "unknown.npy", std::vector<float>(size_t{kPhotoWidth} * kPhotoHeight, NAN),
            {kPhotoHeight, kPhotoWidth});
  expect_refusal(calibrate(images, folder_ / "unknown.npy", "0.05"), 3, {"pixels of known height"});
  spill(folder_ / "cut.tmd", "Binary TrueMap Data File v2.0\r\n");
  expect_refusal(calibrate(images, folder_ / "cut.tmd", "0.05"), 3, {"cut.tmd", "cut short"});
  EXPECT_FALSE(fs::exists(folder_ / "l.json"));

  ASSERT_EQ(calibrated().exit_code, 0);
  const auto integrate = [&](const std::vector<std::string>& files, const fs::path& lights) {
    return command({"integrate"}, files, {"--lights", lights, "--out", folder_ / "o"});
  };
  expect_refusal(integrate(images_of(folder_ / "1", 5), folder_ / "lights.json"), 3, {"6 images", "5"});
  expect_refusal(integrate(images, folder_ / "none.json"), 4, {"none.json"});
  spill(folder_ / "bad.json", "{\"palpate_lights\": 2}");
  expect_refusal(integrate(images, folder_ / "bad.json"), 4, {"version 1"});
  expect_refusal(command({"integrate"}, images, {"--out", folder_ / "o"}), 2, {"6 files", "--lights"});
  expect_refusal(command({"integrate"}, images,
                         {"--lights", folder_ / "lights.json", "--kinks", "--out", folder_ / "o"}),
                 2, {"--kinks"});
  EXPECT_FALSE(fs::exists(folder_ / "o" / "height.npy"));
}

}  // namespace
}  // namespace palpate
