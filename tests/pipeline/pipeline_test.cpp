// The whole engine on the synthetic sensor: what it measures against what was really there, what it says when
// it cannot know, and how it keeps its slots.
#include "palpate/pipeline.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "engine/calibrate/linear_fit.h"
#include "engine/gpu/commands.h"
#include "palpate/error.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/stage_run.h"

namespace palpate {
namespace {

constexpr auto kForceOnly = static_cast<uint32_t>(Output::Force);

PipelineOptions force_only(uint32_t slots = 1) {
  return {kForceOnly, SurfaceSolver::Live, slots};
}

/// Equal to the last bit: everything that comes from integer sums.
void expect_identical(const Touch& a, const Touch& b, const std::string& what) {
  const auto bits = [](double value) {
    uint64_t whole = 0;
    std::memcpy(&whole, &value, sizeof whole);
    return whole;
  };
  EXPECT_EQ(a.sequence, b.sequence) << what;
  EXPECT_EQ(a.time_ns, b.time_ns) << what;
  EXPECT_EQ(a.contact, b.contact) << what;
  EXPECT_EQ(bits(a.gray_sum), bits(b.gray_sum)) << what;
  EXPECT_EQ(bits(a.centroid_x_px), bits(b.centroid_x_px)) << what;
  EXPECT_EQ(bits(a.centroid_y_px), bits(b.centroid_y_px)) << what;
  EXPECT_EQ(a.area_px, b.area_px) << what;
  EXPECT_EQ(bits(a.ellipse.major_mm), bits(b.ellipse.major_mm)) << what;
  EXPECT_EQ(bits(a.ellipse.minor_mm), bits(b.ellipse.minor_mm)) << what;
  EXPECT_EQ(bits(a.ellipse.angle_rad), bits(b.ellipse.angle_rad)) << what;
  EXPECT_EQ(bits(a.peak_gray), bits(b.peak_gray)) << what;
  EXPECT_EQ(a.saturated_px, b.saturated_px) << what;
  EXPECT_EQ(bits(a.force_N.value), bits(b.force_N.value)) << what;
  EXPECT_EQ(a.force_N.validity, b.force_N.validity) << what;
  EXPECT_EQ(bits(a.shear_x_N.value), bits(b.shear_x_N.value)) << what;
  EXPECT_EQ(bits(a.shear_y_N.value), bits(b.shear_y_N.value)) << what;
  EXPECT_EQ(a.slip, b.slip) << what;
}

class PipelineTest : public GpuTest {};

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
      const Touch t = reading.process(scene.frame(k));
      if (!t.contact) continue;
      gray.push_back(t.gray_sum);
      force.push_back(scene.truth(k).force_N);
    }
    const ForceFit fit = fit_force(gray, force);
    scene.sensor.force = fit.calibration;
    Pipeline judged = scene.pipeline(context(), force_only());
    double worst = 0, worst_light_N = 0, worst_px = 0, squares = 0;
    int frames = 0;
    for (uint64_t k = step; k < scene.count(); k += 2 * step) {
      const Truth truth = scene.truth(k);
      const Touch t = judged.process(scene.frame(k));
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
        fit.r_squared);
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
    const Touch t = pipeline.process(scene.frame(k));
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
    const Touch t = pipeline.process(scene.frame(k));
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
      const Touch t = pipeline.process(scene.frame(k));
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
    const Touch t = pipeline.process(scene.frame(k));
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
      const Touch t = pipeline.process(frame);
      EXPECT_EQ(t.saturated_px, at_limit) << text << " frame " << k;
      if (!t.contact) continue;
      EXPECT_EQ(t.force_N.validity == Validity::Saturated, at_limit > 0) << text << " frame " << k;
      if (at_limit < 100) continue;
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
  sensor.reconstruction = Reconstruction::Photometric;
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
      for (uint32_t x = 50; x < 110; ++x) frame.set(2, x, y, 140);  // touched: blue tells no slope
      for (const uint32_t x : {50u, 51u}) frame.set(0, x, y, 100 + change);
      for (const uint32_t x : {108u, 109u}) frame.set(0, x, y, 100 - change);
    }
    return frame;
  };
  for (const SurfaceSolver solver : {SurfaceSolver::Live, SurfaceSolver::Fine, SurfaceSolver::Exact}) {
    for (const bool confidence : {false, true}) {
      Sensor sensor = steep_gel();
      PipelineOptions options;
      options.solver = solver;
      if (confidence) options.outputs = options.outputs | Output::Confidence;
      Pipeline pipeline(context(), sensor, format, options);
      pipeline.set_background(rest);
      const Touch wall = pipeline.process(punch(100)), shallow = pipeline.process(punch(17));
      EXPECT_EQ(wall.surface->clipped_px, 160u);
      EXPECT_EQ(wall.surface->validity, Validity::Clipped);
      EXPECT_EQ(shallow.surface->clipped_px, 0u);
      EXPECT_EQ(shallow.surface->validity, Validity::Valid);
      // A few stray pixels, here 3 of 2600, do not make a depth doubtful.
      Frame stray = punch(17);
      for (const uint32_t x : {60u, 70u, 159u}) stray.set(1, x, 50, 200);
      const Touch few = pipeline.process(stray);
      EXPECT_EQ(few.surface->clipped_px, 3u);
      EXPECT_EQ(few.surface->validity, Validity::Valid);
    }
  }
}

// Reconstruction `shading`: the dark rim that the filter leaves is counted but trusted, a broad dark flank is
// not.
TEST_F(PipelineTest, DarkFlanksBeyondTheSteepestSlopeAreTold) {
  const FrameFormat format{160, 120, 1, 8};
  Sensor sensor;
  sensor.name = "shaded";
  sensor.pitch_mm_per_px = 0.05;
  sensor.reconstruction = Reconstruction::Shading;
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
  const Touch shallow = pipeline.process(press(0)), steep = pipeline.process(press(12));
  EXPECT_GT(shallow.surface->clipped_px, 100u) << "the rim";
  EXPECT_EQ(shallow.surface->validity, Validity::Valid);
  EXPECT_GT(steep.surface->clipped_px, 2000u);
  EXPECT_EQ(steep.surface->validity, Validity::Clipped);
  sensor.max_slope = 100;
  Pipeline lenient(context(), sensor, format, {});
  lenient.set_background(rest);
  EXPECT_EQ(lenient.process(press(12)).surface->clipped_px, 0u);
}

// ---- Surface

struct Misfit {
  double rms_mm = 0, deepest_mm = 0, depth_max_mm = 0, correlation = 0;
};

/// Over the pixels that `inside` accepts; `deepest_mm` compares the two maps' largest values.
template <typename Inside>
Misfit compare(const std::vector<float>& got, const Touch& touch, const std::vector<float>& truth,
               uint32_t width, const Inside& inside) {
  double squares = 0, count = 0, top_got = -1e9, top_truth = -1e9;
  double sum_g = 0, sum_t = 0, gg = 0, gt = 0, tt = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    if (!inside(static_cast<double>(i % width), static_cast<double>(i / width))) continue;
    const double g = double{got[i]}, t = double{truth[i]};
    squares += (g - t) * (g - t);
    count += 1;
    sum_g += g;
    sum_t += t;
    gg += g * g;
    gt += g * t;
    tt += t * t;
    top_got = std::max(top_got, g);
    top_truth = std::max(top_truth, t);
  }
  const double correlation =
      (gt - sum_g * sum_t / count) / std::sqrt((gg - sum_g * sum_g / count) * (tt - sum_t * sum_t / count));
  return {std::sqrt(squares / count), top_got - top_truth, touch.surface->depth_max_mm - top_truth,
          correlation};
}

struct Solved {
  Touch touch;
  std::vector<float> depth_mm;
};

Solved solve(gpu::Context& context, SyntheticRun& scene, uint64_t k, SurfaceSolver solver) {
  Pipeline pipeline = scene.pipeline(context, {Output::Force | Output::Surface, solver, 1});
  if (!pipeline.submit(scene.frame(k))) throw std::runtime_error("no free slot");
  const std::optional<Result> result = pipeline.wait();
  return {result->touch, pipeline.read_depth_mm(*result)};
}

void expect_solvers_agree(const std::array<Solved, 3>& solved, double live_mm, double converged_mm,
                          const std::string& what) {
  for (const size_t other : {size_t{0}, size_t{1}}) {
    double worst = 0;
    for (size_t i = 0; i < solved[2].depth_mm.size(); ++i)
      worst = std::max(worst, std::abs(double{solved[other].depth_mm[i]} - double{solved[2].depth_mm[i]}));
    std::printf("  %s differs from exact by at most %.2f um, depth_max by %.2f um\n",
                other ? "converged" : "live", 1000 * worst,
                1000 * (solved[other].touch.surface->depth_max_mm - solved[2].touch.surface->depth_max_mm));
    EXPECT_LT(worst, other ? converged_mm : live_mm) << what;
    expect_identical(solved[other].touch, solved[2].touch, what);
  }
}

// Three lights see the slope everywhere: the whole depth map is comparable, the bulge around the contact
// included. What remains is noise, light clipped at steep slopes and the rest level, which the engine takes
// from the frame's border.
TEST_F(PipelineTest, PhotometricDepthIsTheTruth) {
  for (const char* text : {"press?mode=gel&force=0.5", "press?mode=gel&size=320x240&force=1"}) {
    SyntheticRun scene(text);
    constexpr uint64_t kDeepest = 130;
    const Truth truth = scene.truth(kDeepest);
    std::array<Solved, 3> solved;
    const std::array solvers{SurfaceSolver::Live, SurfaceSolver::Converged, SurfaceSolver::Exact};
    for (size_t i = 0; i < 3; ++i) {
      solved[i] = solve(context(), scene, kDeepest, solvers[i]);
      const Misfit m = compare(solved[i].depth_mm, solved[i].touch, truth.depth_mm, scene.options.width,
                               [](double, double) { return true; });
      std::printf("%s solver %zu: depth %.3f mm, RMS error %.1f um, depth_max error %.1f um\n", text, i,
                  truth.indentation_mm, 1000 * m.rms_mm, 1000 * m.depth_max_mm);
      EXPECT_TRUE(solved[i].touch.surface.has_value());
      EXPECT_TRUE(solved[i].touch.surface->rest_from_untouched);
      EXPECT_NEAR(m.deepest_mm, m.depth_max_mm, 1e-4) << "depth_max is the map's largest value";
      EXPECT_LT(m.rms_mm, 0.025 * truth.indentation_mm) << text;
      EXPECT_LT(std::abs(m.depth_max_mm), 0.025 * truth.indentation_mm) << text;
      EXPECT_GT(m.correlation, 0.999) << text;
    }
    expect_solvers_agree(solved, 0.005, 0.0005, text);
  }
}

// A single gray image shows the contact's own cap and nothing around it: the ball's sagitta over the contact
// radius, not the whole indentation. The filter blurs the rim, and the gray that falls there reads as a cliff
// of the steepest slope allowed: max_slope, here 0.5 for a ball whose slopes end at 0.4, times up to 3 px.
// The direction in which the gray falls comes from means over blocks, so a camera's noise does not turn it.
TEST_F(PipelineTest, ShadingDepthIsTheCapOfTheTruth) {
  for (const char* text :
       {"press?mode=lambert&noise=off", "press?mode=lambert&size=1392x1042&bits=12&noise=off",
        "press?mode=lambert", "press?mode=lambert&size=1392x1042&bits=12"}) {
    SyntheticRun scene(text);
    constexpr uint64_t kDeepest = 130;
    Truth truth = scene.truth(kDeepest);
    const double radius_px = truth.radius_px, pitch_mm = scene.sensor.pitch_mm_per_px;
    const double ball_mm = 8, sagitta_mm = std::pow(radius_px * pitch_mm, 2) / (2 * ball_mm);
    // Depth below the contact's rim, where the map's rest level lies.
    for (float& depth : truth.depth_mm) depth -= static_cast<float>(truth.indentation_mm - sagitta_mm);
    const auto inside = [&](double x, double y) {
      return std::hypot(x - truth.center_x_px, y - truth.center_y_px) < radius_px - 3;
    };
    std::array<Solved, 3> solved;
    const std::array solvers{SurfaceSolver::Live, SurfaceSolver::Converged, SurfaceSolver::Exact};
    for (size_t i = 0; i < 3; ++i) {
      solved[i] = solve(context(), scene, kDeepest, solvers[i]);
      const Misfit m =
          compare(solved[i].depth_mm, solved[i].touch, truth.depth_mm, scene.options.width, inside);
      std::printf(
          "%s solver %zu: cap %.3f mm, RMS error %.1f um, depth_max error %.1f um, correlation %.4f\n", text,
          i, sagitta_mm, 1000 * m.rms_mm, 1000 * m.depth_max_mm, m.correlation);
      const double cliff_mm = 3 * scene.sensor.max_slope * pitch_mm;
      EXPECT_LT(m.rms_mm, cliff_mm) << text;
      EXPECT_LT(std::abs(m.depth_max_mm), cliff_mm) << text;
      EXPECT_GT(m.correlation, 0.995) << text;
    }
    expect_solvers_agree(solved, 0.02 * sagitta_mm, 0.0005 * sagitta_mm, text);
  }
}

// ---- Outputs

TEST_F(PipelineTest, WhatIsNotAskedForIsNotBuilt) {
  SyntheticRun scene("press?mode=gel");
  Pipeline both = scene.pipeline(context(), {Output::Force | Output::Surface, SurfaceSolver::Live, 3});
  Pipeline force = scene.pipeline(context(), force_only(3));
  std::printf("memory with surface %.1f MiB, without %.1f MiB\n",
              static_cast<double>(both.memory_bytes()) / 1048576,
              static_cast<double>(force.memory_bytes()) / 1048576);
  // Three depth maps at the least.
  EXPECT_LT(force.memory_bytes() + 3 * 640 * 480 * sizeof(float), both.memory_bytes());
  EXPECT_LT(2 * force.memory_bytes(), both.memory_bytes());
  for (const uint64_t k : {uint64_t{0}, uint64_t{50}, uint64_t{130}}) {
    ASSERT_TRUE(both.submit(scene.frame(k)));
    ASSERT_TRUE(force.submit(scene.frame(k)));
    const Result with = *both.wait(), without = *force.wait();
    EXPECT_TRUE(with.touch.surface.has_value());
    EXPECT_NE(with.surface.buffer, nullptr);
    EXPECT_EQ(with.surface.width, 640u);
    EXPECT_FALSE(without.touch.surface.has_value());
    EXPECT_EQ(without.surface.buffer, nullptr);
    expect_identical(with.touch, without.touch, "frame " + std::to_string(k));
    std::vector<std::string> names;
    for (const gpu::ScopeTime& time : force.times(without)) names.push_back(time.name);
    EXPECT_EQ(std::count(names.begin(), names.end(), "surface"), 0);
    EXPECT_EQ(std::count(names.begin(), names.end(), "slope"), 0);
    EXPECT_EQ(std::count(names.begin(), names.end(), "contact"), 1);
  }
}

// ---- Slots

TEST_F(PipelineTest, FullSlotsRefuseAndResultsComeInOrder) {
  SyntheticRun scene("press?size=320x240");
  Pipeline pipeline = scene.pipeline(context(), force_only(3));
  EXPECT_FALSE(pipeline.poll());
  EXPECT_FALSE(pipeline.wait());
  for (const uint64_t k : {100u, 101u, 105u}) EXPECT_TRUE(pipeline.submit(scene.frame(k)));
  EXPECT_FALSE(pipeline.submit(scene.frame(106))) << "all in flight";
  std::vector<Result> held;
  for (const uint64_t k : {100u, 101u, 105u}) {
    held.push_back(*pipeline.wait());
    EXPECT_EQ(held.back().touch.sequence, k);
    EXPECT_EQ(held.back().touch.time_ns, scene.frame(k).time_ns);
    EXPECT_GT(held.back().turnaround_ms, 0);
  }
  EXPECT_FALSE(pipeline.wait());
  EXPECT_FALSE(pipeline.submit(scene.frame(106))) << "all held";
  const uint32_t freed = held[1].slot;
  held.erase(held.begin() + 1);
  EXPECT_TRUE(pipeline.submit(scene.frame(106)));
  EXPECT_FALSE(pipeline.submit(scene.frame(107)));
  const Result next = *pipeline.wait();
  EXPECT_EQ(next.slot, freed);
  EXPECT_EQ(next.touch.sequence, 106u);
}

TEST_F(PipelineTest, AResultGivesItsSlotBackWhereverItEnds) {
  SyntheticRun scene("press?size=320x240");
  std::optional<Result> last;
  {
    Pipeline pipeline = scene.pipeline(context(), force_only(1));
    ASSERT_TRUE(pipeline.submit(scene.frame(100)));
    Result result = *pipeline.wait();
    EXPECT_FALSE(pipeline.submit(scene.frame(101))) << "held";
    Result moved = std::move(result);
    result = {};
    EXPECT_FALSE(pipeline.submit(scene.frame(101))) << "held by the one that it went to";
    std::thread([ends = std::move(moved)] {}).join();
    EXPECT_TRUE(pipeline.submit(scene.frame(101)));
    last = pipeline.wait();
    last = std::nullopt;
    EXPECT_TRUE(pipeline.submit(scene.frame(102)));
    last = pipeline.wait();
  }
  EXPECT_EQ(last->touch.sequence, 102u) << "it may outlive the pipeline, with its numbers";
}

// One held result among many frames: its map must not change, its buffer must not be given to another.
TEST_F(PipelineTest, HeldMapStaysIntact) {
  for (const SurfaceSolver solver : {SurfaceSolver::Live, SurfaceSolver::Exact}) {
    SyntheticRun scene("press?mode=gel&size=320x240&force=0.5");
    Pipeline pipeline = scene.pipeline(context(), {Output::Force | Output::Surface, solver, 3});
    ASSERT_TRUE(pipeline.submit(scene.frame(130)));
    const Result held = *pipeline.wait();
    const std::vector<float> before = pipeline.read_depth_mm(held);
    uint64_t next = 30;
    for (int i = 0; i < 12; ++i) {
      while (pipeline.submit(scene.frame(next))) ++next;
      const Result passing = *pipeline.wait();
      EXPECT_NE(passing.slot, held.slot);
      EXPECT_NE(passing.surface.buffer, held.surface.buffer);
      EXPECT_EQ(pipeline.read_depth_mm(held), before) << "after frame " << passing.touch.sequence;
    }
  }
}

TEST_F(PipelineTest, PollNeverWaits) {
  SyntheticRun scene("press?size=1392x1042");
  Pipeline pipeline = scene.pipeline(context(), force_only(3));
  std::vector<Frame> frames;
  for (uint64_t k = 0; k < 6; ++k) frames.push_back(scene.frame(100 + k));
  uint64_t wanted = 100;
  int empty = 0;
  for (const Frame& frame : frames) {
    ASSERT_TRUE(pipeline.submit(frame));
    std::optional<Result> result;
    while (!(result = pipeline.poll())) {
      ++empty;
      std::this_thread::yield();
    }
    EXPECT_EQ(result->touch.sequence, wanted++);
  }
  EXPECT_GT(empty, 0) << "every poll found a finished frame: it waited for it";
}

TEST_F(PipelineTest, NumbersDoNotDependOnSlotsOrRuns) {
  SyntheticRun scene("slide?size=320x240");
  std::vector<Frame> frames;
  for (uint64_t k = 0; k < scene.count(); k += 4) frames.push_back(scene.frame(k));
  const auto run = [&](uint32_t slots) {
    Pipeline pipeline = scene.pipeline(context(), force_only(slots));
    std::vector<Touch> touches;
    const auto collect = [&] {
      const Result result = *pipeline.wait();
      touches.push_back(result.touch);
    };
    for (const Frame& frame : frames) {
      while (!pipeline.submit(frame)) collect();
    }
    while (touches.size() < frames.size()) collect();
    return touches;
  };
  const std::vector<Touch> first = run(1);
  for (const uint32_t slots : {1u, 3u, 5u}) {
    const std::vector<Touch> again = run(slots);
    ASSERT_EQ(again.size(), first.size());
    for (size_t i = 0; i < first.size(); ++i)
      expect_identical(again[i], first[i], std::to_string(slots) + " slots, frame " + std::to_string(i));
  }
}

TEST_F(PipelineTest, SurfaceIsTheSameInEveryRun) {
  SyntheticRun scene("press?mode=gel&size=333x251&force=0.5");
  const auto run = [&](uint32_t slots) {
    Pipeline pipeline =
        scene.pipeline(context(), {Output::Force | Output::Surface, SurfaceSolver::Live, slots});
    for (uint32_t i = 0; i < slots; ++i) EXPECT_TRUE(pipeline.submit(scene.frame(120 + 3 * (slots - 1 - i))));
    std::optional<Result> last;
    for (uint32_t i = 0; i < slots; ++i) last = pipeline.wait();
    EXPECT_EQ(last->touch.sequence, 120u);
    return pipeline.read_depth_mm(*last);
  };
  const std::vector<float> first = run(1);
  EXPECT_EQ(run(1), first);
  EXPECT_EQ(run(3), first);
}

// A new background counts from the next frame on, also while frames are under way.
TEST_F(PipelineTest, BackgroundCanBeTakenAnew) {
  SyntheticRun scene("press?size=320x240");
  Pipeline pipeline = scene.pipeline(context(), force_only(3));
  const Frame pressed = scene.frame(130);
  const double gray_sum = pipeline.process(pressed).gray_sum;
  ASSERT_TRUE(pipeline.submit(pressed));
  pipeline.set_background(pressed);
  ASSERT_TRUE(pipeline.submit(pressed));
  const Result before = *pipeline.wait(), after = *pipeline.wait();
  EXPECT_EQ(before.touch.gray_sum, gray_sum);
  EXPECT_FALSE(after.touch.contact);
}

// ---- Refusals

template <typename Act>
void expect_refused(Failure failure, const std::vector<std::string>& words, const Act& act) {
  try {
    act();
    ADD_FAILURE() << "accepted, wanted words: " << (words.empty() ? "" : words[0]);
  } catch (const Error& e) {
    EXPECT_EQ(e.failure(), failure) << e.what();
    for (const std::string& word : words)
      EXPECT_NE(std::string(e.what()).find(word), std::string::npos)
          << "no '" << word << "' in: " << e.what();
  }
}

TEST_F(PipelineTest, FramesOfAnotherFormatAreRefused) {
  SyntheticRun scene("press?size=320x240");
  Pipeline pipeline(context(), scene.sensor, scene.source.format(), force_only());
  expect_refused(Failure::Input, {"background"}, [&] { pipeline.submit(scene.frame(0)); });
  Frame other;
  for (const FrameFormat& wrong :
       {FrameFormat{321, 240, 1, 8}, FrameFormat{320, 240, 3, 8}, FrameFormat{320, 240, 1, 12}}) {
    other.reshape(wrong);
    expect_refused(Failure::Input, {"background", std::to_string(wrong.width)},
                   [&] { pipeline.set_background(other); });
  }
  pipeline.set_background(scene.background);
  for (const FrameFormat& wrong :
       {FrameFormat{320, 241, 1, 8}, FrameFormat{320, 240, 3, 8}, FrameFormat{320, 240, 1, 12}}) {
    other.reshape(wrong);
    expect_refused(Failure::Input, {"320 x " + std::to_string(wrong.height)},
                   [&] { pipeline.submit(other); });
  }
  // A refused frame costs no slot.
  EXPECT_TRUE(pipeline.process(scene.frame(130)).contact);
}

TEST_F(PipelineTest, SensorsThatDoNotFitAreRefused) {
  const SyntheticRun gray("press?size=320x240"), gel("press?mode=gel&size=320x240"),
      lambert("press?mode=lambert&size=320x240");
  const PipelineOptions surface;
  const auto make = [&](const Sensor& sensor, const FrameFormat& format, const PipelineOptions& options) {
    return [&context = context(), sensor, format, options] { Pipeline(context, sensor, format, options); };
  };
  const FrameFormat plain = gray.source.format(), color = gel.source.format();
  Sensor unread = gray.sensor;
  unread.reconstruction = Reconstruction::None;
  expect_refused(Failure::Sensor, {"surface reading"}, make(unread, plain, surface));
  expect_refused(Failure::Sensor, {"channels"}, make(gel.sensor, plain, surface));
  expect_refused(Failure::Sensor, {"channels"}, make(lambert.sensor, color, surface));
  expect_refused(Failure::Sensor, {"channels"}, make(gel.sensor, plain, force_only()));
  expect_refused(Failure::Sensor, {"bit"}, make(gray.sensor, {320, 240, 1, 12}, force_only()));
  expect_refused(Failure::Sensor, {"0 x 240"}, make(gray.sensor, {0, 240, 1, 8}, force_only()));
  expect_refused(Failure::Sensor, {"16384"}, make(gray.sensor, {16385, 1, 1, 8}, force_only()));
  expect_refused(Failure::Sensor, {"16384 x 16384"}, make(gray.sensor, {16384, 16384, 1, 8}, force_only()));
  Sensor odd = gray.sensor;
  odd.pitch_mm_per_px = 0;
  expect_refused(Failure::Sensor, {"pitch_mm_per_px"}, make(odd, plain, force_only()));
  odd = lambert.sensor;
  odd.channels = 3;
  expect_refused(Failure::Sensor, {"gray frames"}, make(odd, color, surface));
}

}  // namespace
}  // namespace palpate
