// The photometric fit against renderings whose light and shape are known.
#include "engine/calibrate/photometric/fit.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "engine/calibrate/photometric/polynomial.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr FrameFormat kFormat{160, 120, 3, 16};
constexpr double kPitch_mm = 0.05;

PhotometricCalibration some_weights() {
  PhotometricCalibration w;
  w.wx = {{-0.56, 0.22, 0.01}, {0.04, 0.64, 0.07}, {0.55, 0.07, -0.02}};
  w.wy = {{0.35, 0.18, 0.31}, {-0.66, -0.06, 0.93}, {0.71, -0.26, 0.11}};
  return w;
}

PhotometricCalibration some_weights(const NormalOrder& order) {
  PhotometricCalibration w = some_weights();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> weight(-0.5, 0.5);
  const auto terms = [](int degree) { return static_cast<size_t>((degree + 1) * (degree + 2) / 2); };
  for (NormalWeights* of : {&w.wx, &w.wy}) {
    of->resize(order.products < 0 ? 3 : 9);
    for (size_t c = 0; c < of->size(); ++c) {
      std::vector<double>& row = (*of)[c];
      row.resize(terms(std::max(order.colours, order.products)), 0);
      for (size_t t = c < 3 ? 3 : 0; t < terms(c < 3 ? order.colours : order.products); ++t)
        row[t] = weight(random);
    }
  }
  return w;
}

// The formula of sensor.h, written out once more.
double normal(const NormalWeights& w, const Frame& image, const Frame& background, uint32_t x, uint32_t y) {
  const FrameFormat& f = image.format;
  const double across = 2 * (x + 0.5) / f.width - 1, down = 2 * (y + 0.5) / f.height - 1;
  const double place[10] = {1,
                            across,
                            down,
                            across * across,
                            across * down,
                            down * down,
                            across * across * across,
                            across * across * down,
                            across * down * down,
                            down * down * down};
  const auto change = [&](uint32_t c) {
    return (static_cast<double>(image.at(c, x, y)) - background.at(c, x, y)) / f.max_gray();
  };
  const double r = change(0), g = change(1), b = change(2);
  const double colour[9] = {r, g, b, r * r, r * g, r * b, g * g, g * b, b * b};
  double sum = 0;
  for (size_t c = 0; c < w.size(); ++c)
    for (size_t t = 0; t < w[c].size(); ++t) sum += w[c][t] * place[t] * colour[c];
  return sum;
}

Frame flat(uint32_t value, const FrameFormat& format = kFormat) {
  Frame f;
  f.reshape(format);
  for (uint32_t c = 0; c < format.channels; ++c)
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x) f.set(c, x, y, value);
  return f;
}

// A Lambertian pad lit by three low lamps, one a channel, at 0, 120 and 240 degrees; falloff across the
// frame.
struct Scene {
  FrameFormat format = kFormat;
  double noise_gray = 0;
  bool gray = false;  // all three lamps stand in one place
  std::mt19937 random{7};
  double follows = 1;  // share of the circle up to which the pad follows the ball; level at its edge

  Frame render(double cx, double cy, double contact_px, double ball_mm) {
    Frame f;
    f.reshape(format);
    std::normal_distribution<double> noise(0, 1);
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x) {
        double nx = 0, ny = 0;
        const double dx = x - cx, dy = y - cy;
        const double share = std::hypot(dx, dy) / contact_px;
        if (share < 1) {
          // Depth grows towards the centre: the inward normal's slope part points there.
          const double steep = share < follows ? 1 : (1 - share) / (1 - follows);
          nx = -dx * kPitch_mm / ball_mm * steep;
          ny = -dy * kPitch_mm / ball_mm * steep;
        }
        const double nz = std::sqrt(1 - nx * nx - ny * ny);
        for (uint32_t c = 0; c < 3; ++c) {
          const double azimuth = gray ? 0.3 : 2.0943951023932 * c + 0.3, elevation = 0.6;
          const double light = nx * std::cos(azimuth) * std::cos(elevation) +
                               ny * std::sin(azimuth) * std::cos(elevation) + nz * std::sin(elevation);
          const double falloff = 1 + 0.15 * (2 * (x + 0.5) / format.width - 1);
          const double value = format.max_gray() * 0.45 * falloff * std::max(0.0, light);
          f.set(c, x, y,
                static_cast<uint32_t>(std::clamp(value + noise_gray * noise(random) + 0.5, 0.0,
                                                 static_cast<double>(format.max_gray()))));
        }
      }
    return f;
  }
};

/// Presses of random colours whose normals a polynomial has made, with noise.
PhotometricFit random_presses(const PhotometricCalibration& truth, int presses, double noise) {
  std::mt19937 random(11);
  std::uniform_int_distribution<uint32_t> gray(2000, 60000);
  std::normal_distribution<double> error(0, 1);
  const Frame background = flat(30000);
  PhotometricFit fit(kFormat, kPitch_mm);
  for (int press = 0; press < presses; ++press) {
    Frame image;
    image.reshape(kFormat);
    std::vector<double> nx, ny;
    for (uint32_t y = 0; y < kFormat.height; ++y)
      for (uint32_t x = 0; x < kFormat.width; ++x) {
        for (uint32_t c = 0; c < 3; ++c) image.set(c, x, y, gray(random));
        nx.push_back(normal(truth.wx, image, background, x, y) + noise * error(random));
        ny.push_back(normal(truth.wy, image, background, x, y) + noise * error(random));
      }
    fit.add_normals(image, background, nx, ny, "random");
  }
  return fit;
}

TEST(PhotometricFit, RecoversTheWeightsOfEveryOrder) {
  for (const NormalOrder& order : kNormalOrders) {
    const PhotometricCalibration truth = some_weights(order);
    const PhotometricFitResult r = random_presses(truth, 3, 0).solve(1, order.model);
    ASSERT_EQ(r.calibration.wx.size(), truth.wx.size()) << order.name;
    ASSERT_EQ(r.calibration.wx.front().size(), truth.wx.front().size()) << order.name;
    for (size_t c = 0; c < truth.wx.size(); ++c)
      for (size_t t = 0; t < truth.wx[c].size(); ++t) {
        EXPECT_NEAR(r.calibration.wx[c][t], truth.wx[c][t], 1e-11) << order.name << " wx " << c << " " << t;
        EXPECT_NEAR(r.calibration.wy[c][t], truth.wy[c][t], 1e-11) << order.name << " wy " << c << " " << t;
      }
    EXPECT_EQ(r.ridge, 0) << order.name;
    EXPECT_LT(r.condition, 60) << order.name;
    EXPECT_LT(r.normal_rms_held_out, 1e-6) << order.name;
    // The program's own reading of the weights.
    const auto read = polynomial_normal(truth, {0.3, -0.2, 0.1}, -0.5, 0.75);
    const Frame background = flat(30000);
    Frame image = flat(30000);
    const std::array<double, 3> change{0.3, -0.2, 0.1};
    for (uint32_t c = 0; c < 3; ++c)
      image.set(c, 40, 105, static_cast<uint32_t>(std::lround(30000 + 65535 * change[c])));
    EXPECT_NEAR(read[0], normal(truth.wx, image, background, 40, 105), 0.02) << order.name;
    EXPECT_NEAR(read[1], normal(truth.wy, image, background, 40, 105), 0.02) << order.name;
  }
}

TEST(PhotometricFit, ChoosesTheOrderThatMadeTheData) {
  for (const NormalOrder& order : kNormalOrders) {
    const PhotometricFitResult r = random_presses(some_weights(order), 5, 0.05).solve(1, NormalModel::Best);
    EXPECT_EQ(r.candidates.size(), kNormalOrders.size());
    EXPECT_STREQ(r.model().order.name, order.name);
    EXPECT_NEAR(r.normal_rms_held_out, 0.05, 0.001) << order.name;
  }
}

TEST(PhotometricFit, BallsGiveTheirOwnShapeBack) {
  Scene scene;
  const Frame background = scene.render(0, 0, 0, 1);
  PhotometricFit fit(kFormat, kPitch_mm);
  for (const auto& [x, y] : {std::pair{40.0, 35.5}, {110.3, 40.0}, {75.0, 80.2}, {120.0, 85.0}, {35.0, 88.0}})
    fit.add_ball(scene.render(x, y, 20, 3), background, x, y, 20, 3, "ball");
  const PhotometricFitResult r = fit.solve();
  // A Lambertian pad is not linear in the colours (n_z falls where the pad tilts, lamps fall off like 1/(1 +
  // aX)): at slopes of up to 1/3 that costs about a percent.
  EXPECT_LT(r.normal_rms_held_out, 0.02);
  EXPECT_GT(r.explained_x, 0.98);
  EXPECT_GT(r.explained_y, 0.98);
  const double cap_mm = 3 - std::sqrt(9.0 - 1.0);
  EXPECT_LT(r.depth_rmse_mm, 0.03 * cap_mm);
  EXPECT_NEAR(r.depth_gain, 1, 0.03);
  ASSERT_EQ(r.presses.size(), 5u);

  // The sign: right of the centre depth falls, so d(depth)/dx < 0 there, and likewise below it.
  const Frame press = scene.render(80, 60, 20, 3);
  EXPECT_NEAR(normal(r.calibration.wx, press, background, 92, 60), -12 * kPitch_mm / 3, 0.02);
  EXPECT_NEAR(normal(r.calibration.wy, press, background, 80, 72), -12 * kPitch_mm / 3, 0.02);
  EXPECT_NEAR(normal(r.calibration.wx, press, background, 80, 72), 0, 0.02);
}

TEST(PhotometricFit, BallsOfSeveralSizesAreLeftOutWhole) {
  Scene scene;
  const Frame background = scene.render(0, 0, 0, 1);
  PhotometricFit fit(kFormat, kPitch_mm);
  const auto press = [&](double x, double y, double ball_mm) {
    fit.add_ball(scene.render(x, y, 20, ball_mm), background, x, y, 20, ball_mm, "ball");
  };
  for (const auto& [x, y] : {std::pair{40.0, 35.5}, {110.3, 40.0}, {75.0, 80.2}}) press(x, y, 3);
  EXPECT_FALSE(fit.solve().model().ball.has_value());
  for (const auto& [x, y] : {std::pair{120.0, 85.0}, {35.0, 88.0}}) press(x, y, 5);
  const PhotometricFitResult r = fit.solve();
  ASSERT_TRUE(r.model().ball.has_value());
  // The smaller ball is steeper than what the other has shown: its error grows, and is told.
  EXPECT_GT(r.model().ball->normal_rms, r.model().press.normal_rms);
  EXPECT_LT(r.model().ball->normal_rms, 0.03);
  EXPECT_NEAR(r.model().ball->depth_gain, 1, 0.05);
  EXPECT_EQ(r.model().press.depth_rmse_mm, r.depth_rmse_mm);
}

TEST(PhotometricFit, OnePlaceDoesNotJudgeWhatDependsOnPlace) {
  Scene scene;
  const Frame background = scene.render(0, 0, 0, 1);
  PhotometricFit fit(kFormat, kPitch_mm);
  for (const double contact_px : {14.0, 17.0, 20.0, 23.0})
    fit.add_ball(scene.render(80, 60, contact_px, 3), background, 80, 60, contact_px, 3, "ball");
  const PhotometricFitResult r = fit.solve(1, NormalModel::Best);
  for (const NormalCandidate& c : r.candidates) {
    EXPECT_LE(c.order.colours, 1);
    EXPECT_EQ(c.order.products, -1) << "colours elsewhere are others";
  }
  EXPECT_EQ(fit.solve(1, NormalModel::LinearProducts).model().order.products, 1) << "asked for";
}

TEST(PhotometricFit, SlopesAreFittedAsFarAsThePadFollowsTheBall) {
  for (const auto& [follows, noise_gray] : {std::pair{0.8, 0.0}, {1.0, 700.0}}) {
    Scene scene;
    scene.follows = follows;
    scene.noise_gray = noise_gray;
    const Frame background = Scene().render(0, 0, 0, 1);
    PhotometricFit fit(kFormat, kPitch_mm);
    for (const auto& [x, y] :
         {std::pair{40.0, 35.5}, {110.3, 40.0}, {75.0, 80.2}, {120.0, 85.0}, {35.0, 88.0}})
      fit.add_ball(scene.render(x, y, 30, 3), background, x, y, 30, 3, "ball");
    const PhotometricFitResult r = fit.solve();
    if (follows < 1) {
      EXPECT_LT(r.followed_share, 1);
      EXPECT_NEAR(r.depth_gain, 1, 0.02);
    } else {
      EXPECT_EQ(r.followed_share, 1);  // noise reads all slopes too flat; steep ones stand out of it
    }
  }
}

TEST(PhotometricFit, NoiseIsReportedAsItIs) {
  Scene scene;
  scene.format.bit_depth = 8;
  scene.noise_gray = 4;
  const Frame background = Scene{scene.format, 0, false, std::mt19937(1)}.render(0, 0, 0, 1);
  PhotometricFit fit(scene.format, kPitch_mm);
  for (const auto& [x, y] : {std::pair{40.0, 35.5}, {110.3, 40.0}, {75.0, 80.2}, {120.0, 85.0}, {35.0, 88.0}})
    fit.add_ball(scene.render(x, y, 20, 3), background, x, y, 20, 3, "ball");
  const PhotometricFitResult r = fit.solve();
  // The reported error against the scatter on presses that nobody has seen.
  double square = 0;
  size_t n = 0;
  for (const auto& [x, y] : {std::pair{60.0, 50.0}, {100.0, 70.0}}) {
    const Frame press = scene.render(x, y, 20, 3);
    for (uint32_t j = 0; j < scene.format.height; ++j)
      for (uint32_t i = 0; i < scene.format.width; ++i) {
        const double dx = i - x, dy = j - y;
        if (std::hypot(dx, dy) >= 20) continue;
        const double ex = normal(r.calibration.wx, press, background, i, j) + dx * kPitch_mm / 3;
        const double ey = normal(r.calibration.wy, press, background, i, j) + dy * kPitch_mm / 3;
        square += ex * ex + ey * ey;
        n += 2;
      }
  }
  const double fresh = std::sqrt(square / static_cast<double>(n));
  EXPECT_GT(fresh, 0.01);
  EXPECT_NEAR(r.calibration.normal_sd, fresh, 0.1 * fresh);
  EXPECT_NEAR(r.depth_gain, 1, 0.02);  // noise pulls least squares towards flat, which the weights are rid of
}

// Of two scenes alike but for their noise: what a frame's noise makes of the error is stated apart, and the
// rest goes along with itself over many pixels.
TEST(PhotometricFit, NoiseOfAFrameIsStatedApartFromThePad) {
  Scene scene;
  scene.format.bit_depth = 8;
  const auto fitted = [&](double noise_gray, bool told) {
    scene.noise_gray = noise_gray;
    scene.random.seed(5);
    const Frame background = Scene{scene.format, 0, false, std::mt19937(1)}.render(0, 0, 0, 1);
    PhotometricFit fit(scene.format, kPitch_mm);
    for (const auto& [x, y] :
         {std::pair{40.0, 35.5}, {110.3, 40.0}, {75.0, 80.2}, {120.0, 85.0}, {35.0, 88.0}})
      fit.add_ball(scene.render(x, y, 20, 3), background, x, y, 20, 3, "ball");
    const double sd = noise_gray / 255;
    if (told) fit.set_frame_noise({sd, sd, sd});
    return fit.solve().calibration;
  };
  const PhotometricCalibration noisy = fitted(4, true), calm = fitted(0, true);
  std::printf("error %.4f, noise %.4f; without noise %.4f; the rest over %.1f px\n", noisy.normal_sd,
              noisy.noise_sd, calm.normal_sd, noisy.pad_reach_px);
  const double rest = std::sqrt(std::pow(noisy.normal_sd, 2) - std::pow(noisy.noise_sd, 2));
  EXPECT_LT(rest, 0.5 * noisy.normal_sd);
  EXPECT_EQ(calm.noise_sd, 0);
  EXPECT_EQ(fitted(4, false).noise_sd, 0);
}

TEST(PhotometricFit, RestWeightKeepsDriftingLampsFromTiltingThePicture) {
  Scene scene;
  const Frame background = scene.render(0, 0, 0, 1);
  const auto drifted = [](Frame f) {  // the red lamp has grown brighter by 3 % since the background
    for (uint32_t y = 0; y < f.format.height; ++y)
      for (uint32_t x = 0; x < f.format.width; ++x) f.set(0, x, y, f.at(0, x, y) * 103 / 100);
    return f;
  };
  PhotometricFit fit(kFormat, kPitch_mm);
  for (const auto& [x, y] : {std::pair{40.0, 35.5}, {110.3, 40.0}, {75.0, 80.2}, {120.0, 85.0}, {35.0, 88.0}})
    fit.add_ball(drifted(scene.render(x, y, 15, 3)), background, x, y, 15, 3, "ball");
  const auto false_slope = [&](const PhotometricCalibration& w) {
    const Frame level = drifted(background);
    return std::hypot(normal(w.wx, level, background, 80, 60), normal(w.wy, level, background, 80, 60));
  };
  const double light = false_slope(fit.solve(0.1).calibration),
               heavy = false_slope(fit.solve(10).calibration);
  EXPECT_GT(light, 0.005);
  EXPECT_LT(heavy, 0.7 * light);
}

TEST(PhotometricFit, OneColourPairIsRegularisedAndSaysSo) {
  Scene scene;
  Frame background = scene.render(0, 0, 0, 1);
  PhotometricFit fit(kFormat, kPitch_mm);
  const auto copy_red_to_blue = [](Frame f) {
    for (uint32_t y = 0; y < f.format.height; ++y)
      for (uint32_t x = 0; x < f.format.width; ++x) f.set(2, x, y, f.at(0, x, y));
    return f;
  };
  background = copy_red_to_blue(background);
  for (const auto& [x, y] : {std::pair{40.0, 35.5}, {110.3, 40.0}, {75.0, 80.2}, {120.0, 85.0}})
    fit.add_ball(copy_red_to_blue(scene.render(x, y, 20, 3)), background, x, y, 20, 3, "ball");
  const PhotometricFitResult r = fit.solve();
  EXPECT_GT(r.condition, PhotometricFit::kWorstCondition);
  EXPECT_GT(r.ridge, 0);
  for (size_t c = 0; c < 3; ++c)
    for (size_t k = 0; k < 3; ++k) EXPECT_LT(std::abs(r.calibration.wx[c][k]), 20);
  EXPECT_LT(r.normal_rms_held_out, 0.05);
}

TEST(PhotometricFit, GrayImagesAreRefused) {
  Scene scene;
  scene.gray = true;
  scene.noise_gray = 20;
  const Frame background = scene.render(0, 0, 0, 1);
  PhotometricFit fit(kFormat, kPitch_mm);
  for (const auto& [x, y] : {std::pair{40.0, 35.5}, {110.3, 40.0}, {75.0, 80.2}})
    fit.add_ball(scene.render(x, y, 20, 3), background, x, y, 20, 3, "ball");
  EXPECT_THROW(fit.solve(), Error);
}

TEST(PhotometricFit, ImagesWithoutChangeAreRefused) {
  const Frame background = flat(30000);
  PhotometricFit fit(kFormat, kPitch_mm);
  fit.add_ball(background, background, 60, 60, 20, 3, "a");
  fit.add_ball(background, background, 90, 60, 20, 3, "b");
  EXPECT_THROW(fit.solve(), Error);
}

TEST(PhotometricFit, BadInputIsRefused) {
  EXPECT_THROW(PhotometricFit(FrameFormat{160, 120, 1, 8}, kPitch_mm), Error);
  EXPECT_THROW(PhotometricFit(kFormat, 0), Error);
  EXPECT_THROW(PhotometricFit(kFormat, NAN), Error);
  Scene scene;
  const Frame background = scene.render(0, 0, 0, 1);
  const Frame press = scene.render(80, 60, 20, 3);
  PhotometricFit fit(kFormat, kPitch_mm);
  EXPECT_THROW(fit.add_ball(press, flat(1, {160, 121, 3, 16}), 80, 60, 20, 3, "size"), Error);
  EXPECT_THROW(fit.add_ball(press, background, 80, 60, 61, 3, "larger than the ball"), Error);
  EXPECT_THROW(fit.add_ball(press, background, 80, 60, NAN, 3, "nan"), Error);
  EXPECT_THROW(fit.add_ball(press, background, -500, 60, 20, 3, "outside"), Error);
  EXPECT_THROW(fit.add_ball(flat(65535), background, 80, 60, 20, 3, "saturated"), Error);
  EXPECT_THROW(fit.add_normals(press, background, std::vector<double>(5), std::vector<double>(5), "short"),
               Error);
  EXPECT_THROW(fit.solve(), Error);  // nothing was added
  EXPECT_THROW(fit.solve(-1), Error);
  EXPECT_THROW(fit.solve(NAN), Error);
  fit.add_ball(press, background, 80, 60, 20, 3, "one");
  EXPECT_THROW(fit.solve(), Error);  // one press leaves none to judge by
}

TEST(IntegratePatch, ReturnsAParaboloidOverADisc) {
  constexpr uint32_t kSide = 41;
  constexpr double kPitch = 0.1;
  std::vector<double> sx(kSide * kSide), sy(kSide * kSide), truth(kSide * kSide);
  std::vector<uint8_t> inside(kSide * kSide);
  double mean = 0;
  int n = 0;
  for (uint32_t y = 0; y < kSide; ++y)
    for (uint32_t x = 0; x < kSide; ++x) {
      const double u = (x - 20.0) * kPitch, v = (y - 20.0) * kPitch;
      const size_t i = size_t{y} * kSide + x;
      // The mean slope of two neighbours is exact for a quadratic.
      sx[i] = 0.3 - 0.4 * u + 0.1 * v;
      sy[i] = -0.2 + 0.1 * u - 0.6 * v;
      truth[i] = 0.3 * u - 0.2 * u * u + 0.1 * u * v - 0.2 * v - 0.3 * v * v;
      inside[i] = std::hypot(u, v) < 1.9;
      if (inside[i]) mean += truth[i], ++n;
    }
  const std::vector<double> z = integrate_patch(sx, sy, inside, kSide, kPitch);
  for (size_t i = 0; i < z.size(); ++i) {
    if (inside[i])
      EXPECT_NEAR(z[i], truth[i] - mean / n, 1e-7) << i;
    else
      EXPECT_EQ(z[i], 0);
  }
}

}  // namespace
}  // namespace palpate
