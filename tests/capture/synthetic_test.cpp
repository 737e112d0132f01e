// The synthetic sensor: its physics against theory, its camera against the stated noise, its truth against
// its images.
#include "capture/synthetic/synthetic.h"
#include "capture/open_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "palpate/error.h"

namespace palpate {
namespace {

SyntheticOptions scene_of(const std::string& text) {
  return parse_synthetic("synthetic:" + text);
}

/// The engine's measurement in double precision: 5x5 binomial filter of max(0, image - background),
/// threshold, moments.
struct Moments {
  double gray_sum = 0, x_px = 0, y_px = 0;
  uint64_t area_px = 0;
};

Moments measure(Frame frame, Frame background, double threshold_gray) {
  const FrameFormat& f = frame.format;
  const auto image = [&](Frame& of) {
    cv::Mat gray(static_cast<int>(f.height), static_cast<int>(f.width), f.bit_depth > 8 ? CV_16UC1 : CV_8UC1,
                 of.bytes.data());
    gray.convertTo(gray, CV_64F);
    return gray;
  };
  const cv::Mat taps = (cv::Mat_<double>(5, 1) << 1, 4, 6, 4, 1) / 16;
  cv::Mat g = cv::max(image(frame) - image(background), 0);
  cv::sepFilter2D(g, g, -1, taps, taps, {-1, -1}, 0, cv::BORDER_REPLICATE);
  g.setTo(0, g < threshold_gray);
  const cv::Moments sums = cv::moments(g);
  return {sums.m00, sums.m10 / sums.m00, sums.m01 / sums.m00, static_cast<uint64_t>(cv::countNonZero(g))};
}

TEST(SyntheticOptions, TextRoundTrip) {
  const SyntheticOptions o = scene_of(
      "slide?size=1392x1042&bits=12&mode=lambert&response=saturating&seed=77&rate=15&repeat=3&noise=off&"
      "falloff=0.1&force=2&radius=5");
  EXPECT_EQ(o.scene, "slide");
  EXPECT_EQ(o.width, 1392u);
  EXPECT_EQ(o.height, 1042u);
  EXPECT_EQ(o.bit_depth, 12u);
  EXPECT_EQ(o.mode, SyntheticMode::Lambert);
  EXPECT_EQ(o.seed, 77u);
  EXPECT_FALSE(o.noise);
  EXPECT_EQ(to_string(parse_synthetic(to_string(o))), to_string(o));
  EXPECT_EQ(scene_of("").scene, "palpation");
}

TEST(SyntheticOptions, BadWordsAreNamedWithWhatExists) {
  const auto line = [](const std::string& text) -> std::string {
    try {
      SyntheticSensor sensor(scene_of(text));
    } catch (const Error& e) {
      EXPECT_EQ(e.failure(), Failure::Input);
      return e.what();
    }
    return "accepted";
  };
  EXPECT_NE(line("pres").find("press"), std::string::npos);
  EXPECT_NE(line("press?colour=1").find("size=WxH"), std::string::npos);
  EXPECT_NE(line("press?mode=gell").find("waveguide"), std::string::npos);
  EXPECT_NE(line("press?seed=abc").find("'abc'"), std::string::npos);
  EXPECT_NE(line("press?seed=-1").find("'-1'"), std::string::npos);
  EXPECT_NE(line("press?size=640").find("640x480"), std::string::npos);
  EXPECT_NE(line("press?size=0x480").find("found 0;"), std::string::npos);
  EXPECT_NE(line("press?size=99999x480").find("16384"), std::string::npos);
  EXPECT_NE(line("press?bits=7").find("8 to 16"), std::string::npos);
  EXPECT_NE(line("press?bits=12&mode=gel").find("8 bits"), std::string::npos);
  EXPECT_NE(line("press?rate=nan").find("rate"), std::string::npos);
  EXPECT_NE(line("press?rate=0").find("rate"), std::string::npos);
  EXPECT_NE(line("press?force=1000").find("force"), std::string::npos);
  EXPECT_NE(line("press?radius=inf").find("radius"), std::string::npos);
}

TEST(SyntheticOptions, AnInputThatDoesNotFitTheSensorIsRefused) {
  const Sensor sensor = synthetic_sensor(scene_of("press"));
  EXPECT_NO_THROW(open_source("synthetic:press", sensor));
  EXPECT_THROW(open_source("synthetic:press?bits=12", sensor), Error);
  EXPECT_THROW(open_source("synthetic:press?mode=gel", sensor), Error);
  EXPECT_THROW(open_source("synthetic:press?size=641x480", sensor), Error);
}

TEST(Synthetic, AnyFrameComesAloneAndOnAnyThread) {
  for (const char* mode : {"waveguide", "gel", "lambert"}) {
    const SyntheticOptions o = scene_of(std::string("slide?size=160x120&mode=") + mode);
    SyntheticSensor all(o), other(o);
    std::vector<Frame> frames;
    for (Frame f; all.next(f);) frames.push_back(f);
    ASSERT_EQ(frames.size(), 180u);
    ASSERT_EQ(all.frame_count(), 180u);
    std::vector<Frame> alone(frames.size());
    std::thread backwards([&] {
      for (size_t k = frames.size(); k-- > 90;) other.render(k, alone[k]);
    });
    for (size_t k = 0; k < 90; ++k) other.render(k, alone[k]);
    backwards.join();
    for (size_t k = 0; k < frames.size(); ++k) {
      ASSERT_EQ(frames[k].bytes, alone[k].bytes) << mode << " frame " << k;
      EXPECT_EQ(frames[k].sequence, k);
      EXPECT_EQ(frames[k].time_ns, std::llround(static_cast<double>(k) / 30 * 1e9));
    }
    EXPECT_NE(frames[3].bytes, frames[4].bytes) << "noise must change from frame to frame";
    SyntheticOptions reseeded = o;
    reseeded.seed = 2;
    Frame f;
    SyntheticSensor(reseeded).render(0, f);
    EXPECT_NE(f.bytes, frames[0].bytes);
  }
}

TEST(Synthetic, RepeatPlaysAgainWithOtherNoise) {
  SyntheticSensor sensor(scene_of("slide?size=64x48&repeat=2"));
  EXPECT_EQ(sensor.frame_count(), 360u);
  Frame first, again;
  ASSERT_TRUE(sensor.render(60, first));
  ASSERT_TRUE(sensor.render(240, again));
  EXPECT_FALSE(sensor.render(360, again));
  EXPECT_FALSE(sensor.truth(360));
  EXPECT_NE(first.bytes, again.bytes);
  EXPECT_EQ(sensor.truth(60)->force_N, sensor.truth(240)->force_N);
  EXPECT_EQ(SyntheticSensor(scene_of("slide?size=64x48&repeat=0")).frame_count(), std::nullopt);
}

TEST(Synthetic, NoiseHasTheStatedVarianceAndNoMemory) {
  for (const char* text : {"still?size=160x120", "still?size=160x120&bits=12", "still?size=96x80&mode=gel"}) {
    SyntheticSensor sensor(scene_of(text));
    const Frame background = *sensor.own_background();
    const FrameFormat f = sensor.format();
    const size_t pixels = size_t{f.width} * f.height;
    const int frames = 120;
    std::vector<double> sum(pixels), squares(pixels), previous(pixels), lagged(pixels), beside(pixels);
    Frame frame;
    for (int k = 0; k < frames; ++k) {
      ASSERT_TRUE(sensor.render(static_cast<uint64_t>(k), frame));
      double left = 0;
      for (size_t i = 0; i < pixels; ++i) {
        const auto x = static_cast<uint32_t>(i % f.width), y = static_cast<uint32_t>(i / f.width);
        const double d = static_cast<double>(frame.at(0, x, y)) - background.at(0, x, y);
        sum[i] += d;
        squares[i] += d * d;
        lagged[i] += d * previous[i];
        beside[i] += d * left;
        previous[i] = left = d;
      }
    }
    double measured = 0, stated = 0, mean = 0, lag = 0, neighbour = 0;
    for (size_t i = 0; i < pixels; ++i) {
      const auto x = static_cast<uint32_t>(i % f.width), y = static_cast<uint32_t>(i / f.width);
      const double m = sum[i] / frames, sd = sensor.noise_sd_gray(background.at(0, x, y));
      measured += (squares[i] - frames * m * m) / (frames - 1);
      stated += sd * sd + 1 / 12.0;  // rounding
      mean += m;
      lag += lagged[i] / frames - m * m;
      neighbour += beside[i] / frames;
    }
    EXPECT_NEAR(measured / stated, 1, 0.02) << text;
    EXPECT_NEAR(mean / static_cast<double>(pixels), 0,
                0.01 * std::sqrt(stated / static_cast<double>(pixels)) + 0.02)
        << text;
    EXPECT_NEAR(lag / stated, 0, 0.02) << text;
    EXPECT_NEAR(neighbour / stated, 0, 0.1) << text;  // the background's rounding repeats from frame to frame
  }
}

TEST(Synthetic, BrightnessIntegratesToForce) {
  for (const char* text : {"press?noise=off&falloff=0&bits=12", "flat?noise=off&falloff=0&bits=12",
                           "press?noise=off&falloff=0&bits=12&size=1392x1042"}) {
    const SyntheticOptions o = scene_of(text);
    SyntheticSensor sensor(o);
    const Sensor calibration = synthetic_sensor(o);
    const Frame background = *sensor.own_background();
    Frame frame;
    for (const uint64_t k : {40u, 70u, 100u, 120u}) {
      const Truth truth = *sensor.truth(k);
      if (truth.force_N < 0.15) continue;
      ASSERT_TRUE(sensor.render(k, frame));
      double sum = 0;
      for (uint32_t y = 0; y < o.height; ++y)
        for (uint32_t x = 0; x < o.width; ++x)
          sum += static_cast<double>(frame.at(0, x, y)) - static_cast<double>(background.at(0, x, y));
      const double pitch = calibration.pitch_mm_per_px;
      EXPECT_NEAR(sum * pitch * pitch / gray_per_MPa(o) / truth.force_N, 1, 0.006) << text << " frame " << k;
    }
  }
}

TEST(Synthetic, TruthIsTheSolvedContact) {
  SyntheticSensor sensor(scene_of("press"));
  const double pitch = 27.84 / 640;
  for (const uint64_t k : {36u, 66u, 130u}) {
    const Truth truth = *sensor.truth(k);
    const LayerContact contact = sensor.contact(k);
    EXPECT_TRUE(truth.contact);
    EXPECT_NEAR(contact.summary().force_N, truth.force_N, 1e-9);
    EXPECT_NEAR(truth.radius_px * pitch, contact.summary().radius_mm, 1e-9);
    ASSERT_EQ(truth.depth_mm.size(), 640u * 480u);
    const float deepest = *std::max_element(truth.depth_mm.begin(), truth.depth_mm.end());
    EXPECT_NEAR(deepest, truth.indentation_mm, 1e-4);
    for (uint32_t y = 0; y < 480; y += 7) {
      for (uint32_t x = 0; x < 640; x += 7) {
        const double r = std::hypot(x - truth.center_x_px, y - truth.center_y_px) * pitch;
        const double wanted =
            r <= contact.summary().radius_mm ? truth.indentation_mm - r * r / 16 : contact.deflection_mm(r);
        ASSERT_NEAR(truth.depth_mm[y * 640 + x], wanted, 2e-4) << x << ' ' << y;
      }
    }
  }
  EXPECT_FALSE(sensor.truth(5)->contact);
  EXPECT_EQ(sensor.truth(5)->force_N, 0);
}

TEST(Synthetic, FlatEndMakesAFlatFloor) {
  SyntheticSensor sensor(scene_of("flat"));
  const Truth truth = *sensor.truth(40);
  ASSERT_GT(truth.force_N, 0.1);
  EXPECT_NEAR(truth.radius_px, 2.5 / (27.84 / 640), 1e-6);
  for (uint32_t y = 0; y < 480; ++y)
    for (uint32_t x = 0; x < 640; ++x) {
      if (std::hypot(x - truth.center_x_px, y - truth.center_y_px) < truth.radius_px - 1) {
        ASSERT_NEAR(truth.depth_mm[y * 640 + x], truth.indentation_mm, 1e-6);
      }
    }
}

TEST(Synthetic, ShearSticksThenSlipsAndNeverPassesFriction) {
  for (const char* text : {"slide?size=64x48&rate=120", "palpation?size=64x48&rate=60"}) {
    const SyntheticOptions o = scene_of(text);
    SyntheticSensor sensor(o);
    const double stiffness = shear_stiffness_N_per_mm(o), pitch = 27.84 / 64;
    bool stuck = false, slipped = false;
    Truth before = *sensor.truth(0);
    double onset_x = 0, onset_y = 0, travelled_slipping_mm = 0;
    bool ever_slipped = false;
    for (uint64_t k = 0; k < *sensor.frame_count(); ++k) {
      const Truth t = *sensor.truth(k);
      const double shear = std::hypot(t.shear_x_N, t.shear_y_N), limit = o.friction * t.force_N;
      ASSERT_LE(shear, limit * (1 + 1e-12)) << text << " frame " << k;
      if (t.slipping) {
        EXPECT_NEAR(shear, limit, 1e-12) << k;
      }
      if (t.contact && !before.contact) {
        onset_x = t.center_x_px;
        onset_y = t.center_y_px;
        ever_slipped = false;
      }
      ever_slipped |= t.slipping;
      if (t.contact && !ever_slipped) {
        // While it sticks the contact has moved by F_t / K since its onset (within what it moved before the
        // first frame).
        EXPECT_NEAR((t.center_x_px - onset_x) * pitch * stiffness, t.shear_x_N, 1e-9) << k;
        EXPECT_NEAR((t.center_y_px - onset_y) * pitch * stiffness, t.shear_y_N, 1e-9) << k;
        stuck |= shear > 0.1;
      }
      if (t.slipping && before.slipping) {
        travelled_slipping_mm +=
            std::hypot(t.center_x_px - before.center_x_px, t.center_y_px - before.center_y_px) * pitch;
        slipped |= travelled_slipping_mm > 3;
      }
      // Nothing jumps.
      EXPECT_LT(std::abs(t.force_N - before.force_N), 0.15) << k;
      if (t.contact && before.contact) {
        EXPECT_LT(std::hypot(t.center_x_px - before.center_x_px, t.center_y_px - before.center_y_px) * pitch,
                  0.2)
            << k;
        EXPECT_LT(std::hypot(t.shear_x_N - before.shear_x_N, t.shear_y_N - before.shear_y_N), 0.1) << k;
        EXPECT_LT(std::abs(t.indentation_mm - before.indentation_mm), 0.15) << k;
      }
      before = t;
    }
    EXPECT_TRUE(stuck) << text;
    EXPECT_TRUE(slipped) << text;
  }
}

TEST(Synthetic, SaturationClipsAtFullScale) {
  for (const char* text : {"press?force=6&size=320x240", "press?force=6&size=320x240&bits=12",
                           "press?force=6&size=320x240&bits=16"}) {
    SyntheticSensor sensor(scene_of(text));
    const uint32_t top = sensor.format().max_gray();
    Frame frame;
    ASSERT_TRUE(sensor.render(130, frame));
    const Truth truth = *sensor.truth(130);
    uint64_t clipped = 0;
    for (uint32_t y = 0; y < 240; ++y)
      for (uint32_t x = 0; x < 320; ++x) {
        ASSERT_LE(frame.at(0, x, y), top);
        clipped += frame.at(0, x, y) == top;
      }
    EXPECT_GT(clipped, 100u) << text;
    EXPECT_EQ(frame.at(0, static_cast<uint32_t>(truth.center_x_px), static_cast<uint32_t>(truth.center_y_px)),
              top);
    EXPECT_LT(frame.at(0, 0, 0), top / 4);
  }
}

TEST(Synthetic, TwelveBitsUseTheirRange) {
  SyntheticSensor sensor(scene_of("press?bits=12&size=320x240"));
  EXPECT_EQ(sensor.format().bytes_per_pixel(), 2u);
  Frame frame;
  ASSERT_TRUE(sensor.render(130, frame));
  uint32_t largest = 0;
  std::array<int, 16> last_digit{};
  for (uint32_t y = 0; y < 240; ++y)
    for (uint32_t x = 0; x < 320; ++x) {
      largest = std::max(largest, frame.at(0, x, y));
      ++last_digit[frame.at(0, x, y) % 16];
    }
  EXPECT_GT(largest, 2500u);
  EXPECT_LE(largest, 4095u);
  for (const int count : last_digit) EXPECT_NEAR(count, 320 * 240 / 16, 600);
}

TEST(Synthetic, SaturatingResponseBendsDownward) {
  const auto sum = [](const char* response, uint64_t k) {
    SyntheticSensor sensor(scene_of(std::string("press?noise=off&size=320x240&response=") + response));
    Frame frame;
    sensor.render(k, frame);
    return measure(frame, *sensor.own_background(), 4).gray_sum;
  };
  EXPECT_NEAR(sum("linear", 130) / sum("linear", 35), 1.5 / 0.2, 0.15);
  EXPECT_LT(sum("saturating", 130) / sum("saturating", 35), 0.9 * 1.5 / 0.2);
}

TEST(Synthetic, ForceWithinOnePercentAndCentroidWithinATenthOfAPixel) {
  for (const char* text : {"palpation", "palpation?size=1392x1042", "press?bits=12", "slide"}) {
    const SyntheticOptions o = scene_of(text);
    SyntheticSensor sensor(o);
    const Sensor calibration = synthetic_sensor(o);
    const Frame background = *sensor.own_background();
    std::vector<std::array<double, 2>> fit, judge;  // G, F
    Frame frame;
    size_t turn = 0;
    for (uint64_t k = 0; k < *sensor.frame_count(); k += 5) {
      const Truth truth = *sensor.truth(k);
      ASSERT_TRUE(sensor.render(k, frame));
      const Moments m = measure(frame, background, calibration.threshold_gray);
      if (!truth.contact) {
        EXPECT_EQ(m.area_px, 0u) << text << " frame " << k << ": noise taken for a contact";
      }
      if (truth.force_N < 0.05) continue;
      EXPECT_NEAR(m.x_px, truth.center_x_px, 0.1) << text << " frame " << k;
      EXPECT_NEAR(m.y_px, truth.center_y_px, 0.1) << text << " frame " << k;
      EXPECT_NEAR(m.gray_sum * calibration.force->c1_N_per_gray / truth.force_N, 1, 0.012)
          << text << " frame " << k;
      (turn++ % 2 ? judge : fit).push_back({m.gray_sum, truth.force_N});
    }
    ASSERT_GT(judge.size(), 8u);
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (const auto& [g, force] : fit) {
      n += 1;
      x += g;
      y += force;
      xx += g * g;
      xy += g * force;
    }
    const double slope = (n * xy - x * y) / (n * xx - x * x), offset = (y - slope * x) / n;
    for (const auto& [g, force] : judge)
      EXPECT_NEAR((slope * g + offset) / force, 1, 0.01) << text << " at " << force << " N";
  }
}

TEST(Synthetic, GelColoursAreTheGradientsOfTheTruth) {
  const SyntheticOptions o = scene_of("palpation?mode=gel&noise=off");
  SyntheticSensor sensor(o);
  const Sensor calibration = synthetic_sensor(o);
  const PhotometricCalibration& p = calibration.photometric;
  const Frame background = *sensor.own_background();
  Frame frame;
  for (const uint64_t k : {45u, 110u, 225u}) {
    ASSERT_TRUE(sensor.render(k, frame));
    const Truth truth = *sensor.truth(k);
    ASSERT_GT(truth.force_N, 0.5);
    double error = 0, signal = 0, along = 0, far_error = 0;
    for (uint32_t y = 1; y < 479; ++y)
      for (uint32_t x = 1; x < 639; ++x) {
        const double u = 2.0 * x / 639 - 1, v = 2.0 * y / 479 - 1;
        double nx = 0, ny = 0;
        for (uint32_t c = 0; c < 3; ++c) {
          const double change = (static_cast<double>(frame.at(c, x, y)) - background.at(c, x, y)) / 255;
          nx += (p.wx[c][0] + p.wx[c][1] * u + p.wx[c][2] * v) * change;
          ny += (p.wy[c][0] + p.wy[c][1] * u + p.wy[c][2] * v) * change;
        }
        const double nz = std::sqrt(1 - nx * nx - ny * ny);
        const auto depth = [&](uint32_t i, uint32_t j) { return double{truth.depth_mm[j * 640 + i]}; };
        const double pitch = calibration.pitch_mm_per_px;
        const double gx = (depth(x + 1, y) - depth(x - 1, y)) / (2 * pitch),
                     gy = (depth(x, y + 1) - depth(x, y - 1)) / (2 * pitch);
        // The rim's pixels mix the two sides of a bend.
        const double r = std::hypot(x - truth.center_x_px, y - truth.center_y_px);
        if (std::abs(r - truth.radius_px) < 3) continue;
        const double miss = std::pow(nx / nz - gx, 2) + std::pow(ny / nz - gy, 2);
        far_error = std::max(far_error, miss);
        if (r > truth.radius_px) continue;
        error += miss;
        signal += gx * gx + gy * gy;
        along += gx * nx / nz + gy * ny / nz;
      }
    // Frame and background are rounded to 8 bits, 0.41 gray together: 0.004 in slope, of slopes about 0.2.
    EXPECT_LT(std::sqrt(error / signal), 0.03) << k;
    EXPECT_NEAR(along / signal, 1, 0.004) << k;
    EXPECT_LT(std::sqrt(far_error), 0.025) << k;
  }
}

TEST(Synthetic, LambertGrayIsTheNormalOfTheTruth) {
  const SyntheticOptions o = scene_of("press?mode=lambert&noise=off&bits=12");
  SyntheticSensor sensor(o);
  const Sensor calibration = synthetic_sensor(o);
  const Frame background = *sensor.own_background();
  Frame frame;
  ASSERT_TRUE(sensor.render(130, frame));
  const Truth truth = *sensor.truth(130);
  for (uint32_t y = 0; y < 480; ++y)
    for (uint32_t x = 0; x < 640; ++x) {
      const double r = std::hypot(x - truth.center_x_px, y - truth.center_y_px);
      const double gray =
          static_cast<double>(frame.at(0, x, y)) - static_cast<double>(background.at(0, x, y));
      if (r > truth.radius_px + 1) {
        ASSERT_EQ(gray, 0) << x << ' ' << y;
      } else if (r < truth.radius_px - 1) {
        const double slope = r * calibration.pitch_mm_per_px / 8;
        ASSERT_NEAR(gray / calibration.shading.facing_gray, 1 / std::sqrt(1 + slope * slope), 6e-4)
            << x << ' ' << y;
      }
    }
}

TEST(Synthetic, OddSizesAndEveryScene) {
  for (const char* size : {"1x1", "2x1", "1x3", "17x5", "333x127"}) {
    for (const char* mode : {"waveguide", "gel", "lambert"}) {
      for (const auto& [scene, description] : synthetic_scenes()) {
        const SyntheticOptions o = scene_of(scene + "?rate=1&size=" + size + "&mode=" + mode);
        SyntheticSensor sensor(o);
        EXPECT_NO_THROW(validate(synthetic_sensor(o), scene)) << scene << mode;
        EXPECT_FALSE(description.empty());
        Frame frame;
        while (sensor.next(frame)) ASSERT_EQ(frame.bytes.size(), sensor.format().frame_bytes());
        ASSERT_EQ(sensor.own_background()->format, sensor.format());
        const Truth truth = *sensor.truth(*sensor.frame_count() / 2);
        for (const float depth : truth.depth_mm) ASSERT_TRUE(std::isfinite(depth));
      }
    }
  }
}

}  // namespace
}  // namespace palpate
