// The whole engine on the synthetic sensor: measurements against the ground truth, and the states where a
// quantity is not known.
#include "palpate/pipeline.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/calibrate/force/fit.h"
#include "tests/pipeline/pipeline_fixture.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/pipelines.h"
#include "tests/support/stage_run.h"

namespace palpate {
namespace {

// ---- Measurements against the truth

// Calibrated on every second frame of a press, judged on the others, each with its own noise. From 10 % of
// full scale (0.15 N of 1.5 N) the force is within 0.3 % of the truth and the centroid within 0.05 px; below,
// the force is within 0.5 mN.
TEST_F(PipelineTest, ForceAndPlaceHitTheTruth) {
  for (const char* text : {"press?size=640x480&bits=8", "press?size=1392x1042&bits=12"}) {
    SyntheticRun scene(text);
    const uint64_t step = scene.options.width > 1000 ? 6 : 3;
    Pipeline reading = scene.pipeline(context(), force_only());
    std::vector<double> gray, force;
    for (uint64_t k = 0; k < scene.count(); k += 2 * step) {
      const Touch t = reading.process(scene.frame(k)).touch;
      if (!t.contact) continue;
      gray.push_back(t.gray_sum);
      force.push_back(scene.truth(k).force_N);
    }
    scene.sensor.force = line_calibration(gray, force);
    Pipeline judged = scene.pipeline(context(), force_only());
    double worst = 0, worst_light_N = 0, worst_px = 0, squares = 0;
    int frames = 0;
    for (uint64_t k = step; k < scene.count(); k += 2 * step) {
      const Truth truth = scene.truth(k);
      const Touch t = judged.process(scene.frame(k)).touch;
      ASSERT_EQ(t.contact, truth.force_N > 0.002) << text << " frame " << k << ", " << truth.force_N << " N";
      if (!t.contact) continue;
      const double error_N = t.force_N.value - truth.force_N;
      if (truth.force_N < 0.15) {
        worst_light_N = std::max(worst_light_N, std::abs(error_N));
        continue;
      }
      ++frames;
      worst = std::max(worst, std::abs(error_N) / truth.force_N);
      worst_px = std::max({worst_px, std::abs(t.centroid_x_px - truth.center_x_px),
                           std::abs(t.centroid_y_px - truth.center_y_px)});
      squares += std::pow(error_N / t.force_N.standard_error, 2);
      EXPECT_TRUE(t.force_N.validity == Validity::Valid || truth.force_N > 1.49)
          << to_string(t.force_N.validity);
      EXPECT_LT(std::abs(t.ellipse.major_mm - t.ellipse.minor_mm), 0.03 * t.ellipse.major_mm);
      EXPECT_NEAR(t.ellipse.major_mm, 2 * truth.radius_px * scene.sensor.pitch_mm_per_px,
                  0.1 * t.ellipse.major_mm);
      EXPECT_EQ(t.saturated_px, 0u);
    }
    ASSERT_GT(frames, 12);
    std::printf(
        "%s: %d frames from 0.15 N: worst force error %.3f %%, worst centroid error %.3f px; below "
        "0.15 N worst %.2f mN; error over stated error %.2f RMS; R2 %.6f\n",
        text, frames, 100 * worst, worst_px, 1000 * worst_light_N, std::sqrt(squares / frames),
        scene.sensor.force->r_squared);
    EXPECT_LT(worst, 0.003) << text;
    EXPECT_LT(worst_light_N, 0.0005) << text;
    EXPECT_LT(worst_px, 0.05) << text;
  }
}

// The sensor file that fits by construction, at places all over the pad: the field is not quite even, and the
// stated error says so.
TEST_F(PipelineTest, ForceHoldsAllOverThePad) {
  SyntheticRun scene("palpation");
  Pipeline pipeline = scene.pipeline(context(), force_only());
  double worst = 0;
  int frames = 0, inside = 0;
  for (uint64_t k = 0; k < scene.count(); k += 7) {
    const Truth truth = scene.truth(k);
    const Touch t = pipeline.process(scene.frame(k)).touch;
    if (truth.force_N < 0.15) continue;
    ++frames;
    worst = std::max(worst, std::abs(t.force_N.value / truth.force_N - 1));
    inside += std::abs(t.force_N.value - truth.force_N) < 2 * t.force_N.standard_error;
  }
  std::printf("palpation: %d frames, worst force error %.2f %%, %d within two stated errors\n", frames,
              100 * worst, inside);
  ASSERT_GT(frames, 30);
  EXPECT_LT(worst, 0.008);
  EXPECT_GE(inside, 0.95 * frames);
}

// Stick, slip 7 mm, hold, lift: every frame in order.
TEST_F(PipelineTest, ShearFollowsTheTruthThroughStickAndSlip) {
  SyntheticRun scene("slide");
  Pipeline pipeline = scene.pipeline(context(), force_only());
  double worst_N = 0, squares = 0, largest_N = 0;
  int judged = 0, slip_frames = 0, wrong = 0, wrong_far = 0;
  for (uint64_t k = 0; k < scene.count(); ++k) {
    const Truth truth = scene.truth(k);
    const Touch t = pipeline.process(scene.frame(k)).touch;
    if (!t.contact) {
      EXPECT_EQ(t.slip, Slip::NoContact);
      EXPECT_LT(truth.force_N, 0.003);
      continue;
    }
    const double limit_N = scene.options.friction * truth.force_N;
    const double error_N =
        std::hypot(t.shear_x_N.value - truth.shear_x_N, t.shear_y_N.value - truth.shear_y_N);
    EXPECT_LE(std::hypot(t.shear_x_N.value, t.shear_y_N.value),
              scene.options.friction * t.force_N.value * (1 + 1e-9));
    EXPECT_EQ(t.shear_x_N.validity, Validity::Valid);
    if (truth.force_N < 0.15) continue;  // a light touch: see ForceAndPlaceHitTheTruth
    ++judged;
    worst_N = std::max(worst_N, error_N);
    squares += error_N * error_N;
    largest_N = std::max(largest_N, std::hypot(truth.shear_x_N, truth.shear_y_N));
    slip_frames += truth.slipping;
    if ((t.slip == Slip::Slip) != truth.slipping) {
      ++wrong;
      // At the very limit either word is right: count those where the pull is clearly below it.
      wrong_far += std::hypot(truth.shear_x_N, truth.shear_y_N) < 0.95 * limit_N;
    }
  }
  std::printf(
      "slide: %d frames, %d slipping; shear error worst %.1f mN, RMS %.1f mN of %.0f mN; stick and slip "
      "told wrong %d times, %d of them away from the limit\n",
      judged, slip_frames, 1000 * worst_N, 1000 * std::sqrt(squares / judged), 1000 * largest_N, wrong,
      wrong_far);
  EXPECT_GT(slip_frames, 20);
  EXPECT_LT(worst_N, 0.01 * largest_N);
  EXPECT_LT(std::sqrt(squares / judged), 0.005 * largest_N);
  EXPECT_LE(wrong, 3);
  EXPECT_EQ(wrong_far, 0);
}

// ---- What it says when it cannot know

TEST_F(PipelineTest, NothingTouchesNothingIsMeasured) {
  SyntheticRun scene("still");
  scene.sensor.force = SyntheticRun("press").sensor.force;
  for (const bool calibrated : {true, false}) {
    if (!calibrated) {
      scene.sensor.force.reset();
      scene.sensor.shear.reset();
    }
    Pipeline pipeline = scene.pipeline(context(), force_only());
    for (uint64_t k = 0; k < 40; ++k) {
      const Touch t = pipeline.process(scene.frame(k)).touch;
      EXPECT_FALSE(t.contact) << "noise of frame " << k << " taken for a contact";
      EXPECT_EQ(t.force_N.validity, calibrated ? Validity::NoContact : Validity::NotCalibrated);
      EXPECT_EQ(t.force_N.value, 0);
      EXPECT_TRUE(std::isnan(t.centroid_x_px) && std::isnan(t.centroid_y_px));
      EXPECT_EQ(t.area_px, 0u);
      EXPECT_EQ(t.gray_sum, 0);
      EXPECT_EQ(t.slip, calibrated ? Slip::NoContact : Slip::NotCalibrated);
      EXPECT_EQ(t.sequence, k);
    }
  }
}

TEST_F(PipelineTest, ForceOutsideTheCalibrationIsMarked) {
  SyntheticRun scene("press");
  const double gray_per_N = 1 / scene.sensor.force->c1_N_per_gray;
  scene.sensor.force->gray_min = 0.4 * gray_per_N;
  scene.sensor.force->gray_max = 1.2 * gray_per_N;
  Pipeline pipeline = scene.pipeline(context(), force_only());
  int seen[3] = {};
  for (uint64_t k = 0; k < scene.count(); k += 5) {
    const double force_N = scene.truth(k).force_N;
    const Touch t = pipeline.process(scene.frame(k)).touch;
    if (force_N < 0.05 || std::abs(force_N - 0.4) < 0.02 || std::abs(force_N - 1.2) < 0.03) continue;
    const Validity wanted = force_N < 0.4   ? Validity::BelowRange
                            : force_N > 1.2 ? Validity::AboveRange
                                            : Validity::Valid;
    EXPECT_EQ(t.force_N.validity, wanted) << force_N << " N";
    EXPECT_NEAR(t.force_N.value, force_N, 0.015 * force_N) << "the number is still the line's";
    ++seen[force_N < 0.4 ? 0 : force_N > 1.2 ? 2 : 1];
  }
  EXPECT_GT(seen[0], 3);
  EXPECT_GT(seen[1], 3);
  EXPECT_GT(seen[2], 3);
}

// Pressed so hard that the image clips: the force is marked, and is a lower bound.
TEST_F(PipelineTest, ClippedImagesAreMarked) {
  for (const char* text : {"press?force=6", "press?force=6&bits=12"}) {
    SyntheticRun scene(text);
    Pipeline pipeline = scene.pipeline(context(), force_only());
    int clipped = 0;
    for (uint64_t k = 30; k < scene.count(); k += 10) {
      const Frame& frame = scene.frame(k);
      uint64_t at_limit = 0;
      for (uint32_t y = 0; y < frame.format.height; ++y)
        for (uint32_t x = 0; x < frame.format.width; ++x)
          at_limit += frame.at(0, x, y) >= scene.sensor.saturation_gray;
      const Touch t = pipeline.process(frame).touch;
      EXPECT_EQ(t.saturated_px, at_limit) << text << " frame " << k;
      if (!t.contact) continue;
      // A few pixels widen the interval, many are said.
      if (at_limit == 0) {
        EXPECT_NE(t.force_N.validity, Validity::Saturated) << text << " frame " << k;
      }
      if (t.force_N.validity == Validity::Valid) {
        EXPECT_LT(scene.truth(k).force_N - t.force_N.value, 3 * t.force_N.standard_error)
            << text << " frame " << k << ", " << at_limit << " px at the limit";
      }
      if (t.force_N.validity != Validity::Saturated) continue;
      ++clipped;
      EXPECT_LT(t.force_N.value, scene.truth(k).force_N) << text << " frame " << k;
    }
    EXPECT_GT(clipped, 5) << text;
  }
}

// A gel that reads a slope of 90 degrees where its colour changes most.
Sensor steep_gel() {
  Sensor sensor;
  sensor.name = "steep gel";
  sensor.pitch_mm_per_px = 0.05;
  sensor.channels = 3;
  sensor.reading = SurfaceReading::Photometric;
  sensor.max_slope = 3;
  sensor.photometric.wx[0][0] = 255.0 / 100;  // red changes by 100 levels: n_x = 1
  sensor.photometric.wy[1][0] = 255.0 / 100;
  return sensor;
}

// A punch with walls along its left and right side, and the same punch with slopes of 10 degrees: clipped
// pixels are counted in both, to the pixel, and only the former's depth is doubted.
TEST_F(PipelineTest, WallsBeyondTheSteepestSlopeAreTold) {
  const FrameFormat format{160, 120, 3, 8};
  const Frame rest = uniform_frame(format, 100);
  const auto punch = [&](uint32_t change) {
    Frame frame = rest;
    for (uint32_t y = 40; y < 80; ++y) {
      for (uint32_t x = 50; x < 110; ++x) frame.set(2, x, y, 140);  // touched: blue gives no slope
      for (const uint32_t x : {50u, 51u}) frame.set(0, x, y, 100 + change);
      for (const uint32_t x : {108u, 109u}) frame.set(0, x, y, 100 - change);
    }
    return frame;
  };
  for (const Solve solve : {Solve::Live, Solve::Converged, Solve::Exact}) {
    for (const bool confidence : {false, true}) {
      Sensor sensor = steep_gel();
      PipelineOptions options = solved(solve);
      if (confidence) options.outputs = options.outputs | Output::Confidence;
      Pipeline pipeline(context(), sensor, format, options);
      pipeline.set_background(rest);
      const Touch wall = pipeline.process(punch(100)).touch, shallow = pipeline.process(punch(17)).touch;
      EXPECT_EQ(wall.surface->clipped_px, 160u);
      EXPECT_EQ(wall.surface->validity, Validity::Clipped);
      EXPECT_EQ(shallow.surface->clipped_px, 0u);
      EXPECT_EQ(shallow.surface->validity, Validity::Valid);
      // A few stray pixels, here 3 of 2600, do not make a depth doubtful.
      Frame stray = punch(17);
      for (const uint32_t x : {60u, 70u, 159u}) stray.set(1, x, 50, 200);
      const Touch few = pipeline.process(stray).touch;
      EXPECT_EQ(few.surface->clipped_px, 3u);
      EXPECT_EQ(few.surface->validity, Validity::Valid);
    }
  }
}

// SurfaceReading `shading`: the dark rim that the filter leaves is counted but trusted, a broad dark flank is
// not.
TEST_F(PipelineTest, DarkFlanksBeyondTheSteepestSlopeAreTold) {
  const FrameFormat format{160, 120, 1, 8};
  Sensor sensor;
  sensor.name = "shaded";
  sensor.pitch_mm_per_px = 0.05;
  sensor.reading = SurfaceReading::Shading;
  sensor.shading.facing_gray = 200;
  sensor.max_slope = 2;
  const Frame rest = uniform_frame(format, 5);
  const auto press = [&](double flank_px) {
    Frame frame = rest;
    for (uint32_t y = 0; y < format.height; ++y) {
      for (uint32_t x = 0; x < format.width; ++x) {
        const double r = std::hypot(x - 80.0, y - 60.0);
        frame.set(0, x, y, r < 30 ? 185 : r < 30 + flank_px ? 40 : 5);
      }
    }
    return frame;
  };
  Pipeline pipeline(context(), sensor, format, {});
  pipeline.set_background(rest);
  const Touch shallow = pipeline.process(press(0)).touch, steep = pipeline.process(press(12)).touch;
  EXPECT_GT(shallow.surface->clipped_px, 100u) << "the rim";
  EXPECT_EQ(shallow.surface->validity, Validity::Valid);
  EXPECT_GT(steep.surface->clipped_px, 2000u);
  EXPECT_EQ(steep.surface->validity, Validity::Clipped);
  sensor.max_slope = 100;
  Pipeline lenient(context(), sensor, format, {});
  lenient.set_background(rest);
  EXPECT_EQ(lenient.process(press(12)).touch.surface->clipped_px, 0u);
}

}  // namespace
}  // namespace palpate
