// Long runs: what is carried from frame to frame (the shear's anchor, the slots) must not creep.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <random>

#include "engine/measure/motion/shear.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/pipelines.h"
#include "tests/support/stage_run.h"

namespace palpate {
namespace {

constexpr int kTurns = 1000000;
constexpr double kElasticPitch_mm = 0.0435;

ShearCalibration springs(double friction) {
  ShearCalibration c;
  c.kx_N_per_mm = 0.98;
  c.ky_N_per_mm = 1.07;
  c.friction = friction;
  return c;
}

Touch touching(double x_px, double y_px, double force_N) {
  Touch t;
  t.contact = true;
  t.centroid_x_px = x_px;
  t.centroid_y_px = y_px;
  t.force_N = {force_N, 0.001, Validity::Valid};
  return t;
}

// A million noisy frames of one sticking contact, far from the frame's origin: the last one is as good as the
// second.
TEST(Drift, ShearOfAStickingContact) {
  const ShearCalibration c = springs(10);
  ShearTracker tracker(kElasticPitch_mm);
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.05);
  constexpr double kX = 16000.25, kY = 4000.75;
  Touch t = touching(kX, kY, 1);
  tracker.update(&c, t);
  double worst_N = 0;
  for (int i = 1; i < kTurns; ++i) {
    const double x = kX + noise(random), y = kY + noise(random);
    t = touching(x, y, 1);
    tracker.update(&c, t);
    worst_N = std::max({worst_N, std::abs(t.shear_x_N.value - c.kx_N_per_mm * kElasticPitch_mm * (x - kX)),
                        std::abs(t.shear_y_N.value - c.ky_N_per_mm * kElasticPitch_mm * (y - kY))});
    ASSERT_EQ(t.slip, Slip::Stick) << i;
  }
  std::printf("worst error after %d frames %.1e N\n", kTurns, worst_N);
  RecordProperty("worst_N", std::to_string(worst_N));
  EXPECT_LT(worst_N, 1e-11);
}

// To and fro, slipping twice a turn: a million frames later a turn gives what the second one gave.
TEST(Drift, ShearOfASlippingContact) {
  const ShearCalibration c = springs(0.5);
  ShearTracker tracker(kElasticPitch_mm);
  constexpr int kTurn = 400;
  std::vector<double> second(kTurn), slips(kTurn);
  double worst_N = 0;
  for (int i = 0; i < kTurns; ++i) {
    const double phase = 2 * std::numbers::pi * (i % kTurn) / kTurn;
    Touch t = touching(700 + 60 * std::sin(phase), 500 + 40 * std::cos(phase), 1);
    tracker.update(&c, t);
    EXPECT_LE(std::hypot(t.shear_x_N.value, t.shear_y_N.value), 0.5 * (1 + 1e-12));
    const auto at = static_cast<size_t>(i % kTurn);
    if (i / kTurn == 1) {
      second[at] = t.shear_x_N.value;
      slips[at] = t.slip == Slip::Slip;
    }
    if (i / kTurn > 1) {
      worst_N = std::max(worst_N, std::abs(t.shear_x_N.value - second[at]));
      ASSERT_EQ(t.slip == Slip::Slip, slips[at] > 0) << "frame " << i;
    }
  }
  std::printf("worst difference from the second turn after %d frames %.1e N\n", kTurns, worst_N);
  RecordProperty("worst_N", std::to_string(worst_N));
  EXPECT_LT(worst_N, 1e-9);
}

// A wandering, slipping contact against the same rule in extended precision.
TEST(Drift, ShearOfAWanderingContact) {
  const ShearCalibration c = springs(0.3);
  ShearTracker tracker(kElasticPitch_mm);
  std::mt19937 random(2);
  std::normal_distribution<double> step(0, 0.3);
  double x = 700, y = 500, worst_N = 0;
  long double anchor_x = 0, anchor_y = 0;
  uint64_t slips = 0;
  for (int i = 0; i < kTurns; ++i) {
    const double force_N = 1 + 0.5 * std::sin(0.001 * i);
    Touch t = touching(x, y, force_N);
    tracker.update(&c, t);
    const long double at_x = static_cast<long double>(x) * kElasticPitch_mm,
                      at_y = static_cast<long double>(y) * kElasticPitch_mm;
    if (i == 0) anchor_x = at_x, anchor_y = at_y;
    long double fx = c.kx_N_per_mm * (at_x - anchor_x), fy = c.ky_N_per_mm * (at_y - anchor_y);
    const long double size = std::hypot(fx, fy), limit = static_cast<long double>(c.friction) * force_N;
    if (size >= limit) {
      fx *= limit / size;
      fy *= limit / size;
      anchor_x = at_x - fx / c.kx_N_per_mm;
      anchor_y = at_y - fy / c.ky_N_per_mm;
      ++slips;
    }
    worst_N = std::max({worst_N, std::abs(t.shear_x_N.value - static_cast<double>(fx)),
                        std::abs(t.shear_y_N.value - static_cast<double>(fy))});
    // Back towards the middle, so that it stays in the frame.
    x += step(random) - 0.0005 * (x - 700);
    y += step(random) - 0.0005 * (y - 500);
  }
  std::printf("%llu slips, worst difference from extended precision after %d frames %.1e N\n",
              static_cast<unsigned long long>(slips), kTurns, worst_N);
  RecordProperty("worst_N", std::to_string(worst_N));
  EXPECT_GT(slips, 10000u);
  EXPECT_LT(worst_N, 1e-10);
}

// Contacts that come and go a million times start from zero each.
TEST(Drift, EveryOnsetIsNew) {
  const ShearCalibration c = springs(0.5);
  ShearTracker tracker(kElasticPitch_mm);
  for (int i = 0; i < kTurns / 2; ++i) {
    Touch t = touching(i % 1000, i % 700, 1);
    tracker.update(&c, t);
    ASSERT_EQ(t.shift_x_mm, 0);
    ASSERT_EQ(t.shear_x_N.value, 0);
    Touch gone;
    gone.centroid_x_px = gone.centroid_y_px = NAN;
    tracker.update(&c, gone);
    ASSERT_EQ(gone.shear_x_N.value, 0);
    ASSERT_EQ(gone.slip, Slip::NoContact);
  }
}

// Stiffness and friction at the ends of their range: bounded, never NaN.
TEST(Drift, ExtremeSprings) {
  for (const double k : {1e-9, 1e6}) {
    for (const double friction : {0.0, 1e-12, 100.0}) {
      for (const double force_N : {-1.0, 0.0, 1e-12, 1e6}) {
        ShearCalibration c = springs(friction);
        c.kx_N_per_mm = k;
        c.ky_N_per_mm = 1 / k;
        ShearTracker tracker(kElasticPitch_mm);
        for (int i = 0; i < 50; ++i) {
          Touch t = touching(16384.0 * (i % 2), 8192.0 * (i % 3), force_N);
          tracker.update(&c, t);
          ASSERT_TRUE(std::isfinite(t.shear_x_N.value) && std::isfinite(t.shear_y_N.value))
              << k << " " << friction;
          ASSERT_TRUE(std::isfinite(t.shear_x_N.standard_error));
          ASSERT_LE(std::hypot(t.shear_x_N.value, t.shear_y_N.value),
                    friction * std::max(force_N, 0.0) * (1 + 1e-9));
        }
      }
    }
  }
}

// Its reading makes heights, its force a limit for the shear.
Sensor shaded_sensor() {
  Sensor sensor;
  sensor.name = "drift";
  sensor.pitch_mm_per_px = kElasticPitch_mm;
  sensor.reading = SurfaceReading::Shading;
  sensor.shading.facing_gray = 200;
  sensor.force = ForceCalibration{1e-4, 0, 1e-3, {}, 0, 1e9};
  return sensor;
}

// The same frames thousands of times through the slots of one pipeline: the same bits each time.
using DriftOnGpu = GpuTest;
TEST_F(DriftOnGpu, TheSameFramesGiveTheSameBits) {
  const FrameFormat format{64, 48, 1, 8};
  const Sensor sensor = shaded_sensor();
  Pipeline pipeline(context(), sensor, format, {});
  pipeline.set_background(uniform_frame(format, 10));
  std::vector<Frame> frames;
  for (uint32_t k = 0; k < 4; ++k) {
    Frame frame = uniform_frame(format, 10);
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x)
        frame.set(
            0, x, y,
            static_cast<uint32_t>(
                10 + 180 * std::exp(-(std::pow(x - 30.0 - k, 2) + std::pow(y - 24.0, 2)) / (40.0 + 30 * k))));
    frames.push_back(frame);
  }
  std::vector<Touch> first;
  std::vector<std::vector<float>> depths;
  constexpr uint64_t kRuns = 4000;
  for (uint64_t i = 0; i < kRuns; ++i) {
    ASSERT_TRUE(pipeline.submit(frames[i % 4]));
    const Result result = *pipeline.wait();
    const bool look = i < 4 || i + 40 > kRuns || i % 97 == 0;
    if (i < 4) first.push_back(result.touch);
    const Touch& wanted = first[i % 4];
    ASSERT_EQ(result.touch.gray_sum, wanted.gray_sum) << i;
    ASSERT_EQ(result.touch.centroid_x_px, wanted.centroid_x_px) << i;
    ASSERT_EQ(result.touch.surface->depth_max_mm, wanted.surface->depth_max_mm) << i;
    if (look) {
      std::vector<float> depth = depth_map(result);
      if (i < 4) depths.push_back(depth);
      ASSERT_EQ(depth, depths[i % 4]) << i;
    }
  }
}

}  // namespace
}  // namespace palpate
