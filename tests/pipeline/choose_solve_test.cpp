// Who solves: a rule that gives the same answer each time, and one that is exact enough.
#include "engine/pipeline/choose_solve.h"

#include <cmath>

#include "capture/synthetic/synthetic.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/pipelines.h"

namespace palpate {
namespace {

constexpr auto kBest = SurfaceSolver::Best;
constexpr SolveCase kSmooth{.transforms = true, .processor = true};

TEST(ChooseSolve, TakesTheFasterOneThatIsExactEnough) {
  EXPECT_EQ(choose_solve(kBest, SolveBy::Auto, kSmooth), Solve::Exact);
  SolveCase gpu = kSmooth;
  gpu.processor = false;
  EXPECT_EQ(choose_solve(kBest, SolveBy::Auto, gpu), Solve::Converged);
  SolveCase weighted = kSmooth;
  weighted.transforms = false;
  EXPECT_EQ(choose_solve(kBest, SolveBy::Auto, weighted), Solve::Converged) << "slow on the host";
}

TEST(ChooseSolve, AsAskedFor) {
  for (const SolveBy by : {SolveBy::Auto, SolveBy::Device, SolveBy::Host})
    EXPECT_EQ(choose_solve(SurfaceSolver::Live, by, kSmooth), Solve::Live);
  EXPECT_EQ(choose_solve(kBest, SolveBy::Device, kSmooth), Solve::Converged);
  EXPECT_EQ(choose_solve(kBest, SolveBy::Host, {}), Solve::Exact);
}

TEST(ChooseSolve, TractionGoesWhereItsSurfaceIs) {
  EXPECT_TRUE(traction_on_host(SolveBy::Auto, Solve::Live, true)) << "the processor's own driver";
  EXPECT_TRUE(traction_on_host(SolveBy::Auto, Solve::Exact, false));
  EXPECT_FALSE(traction_on_host(SolveBy::Auto, Solve::Converged, false));
  EXPECT_FALSE(traction_on_host(SolveBy::Device, Solve::Live, true));
  EXPECT_TRUE(traction_on_host(SolveBy::Host, Solve::Live, false));
}

TEST(ChooseSolve, MotionIsTheDevicesWhereItIsNoProcessor) {
  EXPECT_TRUE(motion_on_host(SolveBy::Auto, true));
  EXPECT_FALSE(motion_on_host(SolveBy::Auto, false));
  EXPECT_FALSE(motion_on_host(SolveBy::Device, true));
  EXPECT_TRUE(motion_on_host(SolveBy::Host, false));
}

using ChooseSolveOnDevice = GpuTest;

// Whichever it takes: the heights are those of the host.
TEST_F(ChooseSolveOnDevice, IsWithinAFewMillionths) {
  for (const auto& [width, height] : {std::pair{160u, 120u}, {158u, 118u}}) {
    SyntheticOptions scene;
    scene.width = width;
    scene.height = height;
    scene.mode = SyntheticMode::Lambert;
    const SyntheticSensor source(scene);
    Frame image;
    ASSERT_TRUE(source.render(*source.frame_count() / 2, image));
    const auto depth = [&](SolveBy by) {
      Pipeline pipeline(context(), synthetic_sensor(scene), image.format, {.solver = kBest, .solve_by = by});
      EXPECT_NE(pipeline.solved_by(), SolveBy::Auto);
      pipeline.set_background(*source.own_background());
      return depth_map(pipeline.process(image));
    };
    const std::vector<float> a = depth(SolveBy::Auto), b = depth(SolveBy::Host);
    double wrong = 0, whole = 0;
    for (size_t i = 0; i < a.size(); ++i) {
      wrong += std::pow(double{a[i]} - double{b[i]}, 2);
      whole += std::pow(double{b[i]}, 2);
    }
    EXPECT_GT(whole, 0);
    EXPECT_LE(std::sqrt(wrong / whole), 3e-6) << width << " x " << height;
  }
}

}  // namespace
}  // namespace palpate
