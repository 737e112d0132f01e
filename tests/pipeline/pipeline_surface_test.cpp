// The depth maps of the whole engine against those of the synthetic sensor.
#include "palpate/pipeline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "tests/pipeline/pipeline_fixture.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/pipelines.h"

namespace palpate {
namespace {

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

Solved solve(gpu::Context& context, SyntheticRun& scene, uint64_t k, Solve way) {
  Pipeline pipeline = scene.pipeline(context, solved(way, {.slots = 1}));
  if (!pipeline.submit(scene.frame(k))) throw std::runtime_error("no free slot");
  const std::optional<Result> result = pipeline.wait();
  return {result->touch, depth_map(*result)};
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
    const std::array solvers{Solve::Live, Solve::Converged, Solve::Exact};
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
    const std::array solvers{Solve::Live, Solve::Converged, Solve::Exact};
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

}  // namespace
}  // namespace palpate
