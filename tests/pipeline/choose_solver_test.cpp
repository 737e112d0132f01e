// SurfaceSolver::Auto: a rule that gives the same solver each time, and one that is exact enough.
#include "engine/pipeline/choose_solver.h"

#include <cmath>

#include "capture/synthetic/synthetic.h"
#include "engine/pipeline/plan.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

constexpr bool kProcessor = true, kGpu = false;

TEST(ChooseSolver, TakesTheFasterOneThatIsExactEnough) {
  EXPECT_EQ(choose_solver(SurfaceSolver::Auto, kProcessor), SurfaceSolver::Exact);
  EXPECT_EQ(choose_solver(SurfaceSolver::Auto, kGpu), SurfaceSolver::Converged);
  EXPECT_EQ(choose_solver(SurfaceSolver::Live, kProcessor), SurfaceSolver::Live) << "as asked for";
}

TEST(ChooseSolver, NeverTheHostWhereItIsSlow) {
  FramePlan plan;
  plan.surface = SurfaceKind::Gradient;
  EXPECT_EQ(choose_solver(SurfaceSolver::Auto, plan, kProcessor), SurfaceSolver::Exact);
  for (bool FramePlan::*slow : {&FramePlan::weights, &FramePlan::windowed}) {
    FramePlan other = plan;
    other.*slow = true;
    EXPECT_EQ(choose_solver(SurfaceSolver::Auto, other, kProcessor), SurfaceSolver::Converged);
  }
  plan.surface = SurfaceKind::Elastic;
  EXPECT_EQ(choose_solver(SurfaceSolver::Auto, plan, kProcessor), SurfaceSolver::Converged);
}

using ChooseSolverOnDevice = GpuTest;

// Whichever it takes: the heights are those of the other one.
TEST_F(ChooseSolverOnDevice, IsWithinAFewMillionths) {
  for (const auto& [width, height] : {std::pair{160u, 120u}, {158u, 118u}}) {
    SyntheticOptions scene;
    scene.width = width;
    scene.height = height;
    scene.mode = SyntheticMode::Lambert;
    const SyntheticSensor source(scene);
    Frame image;
    ASSERT_TRUE(source.render(*source.frame_count() / 2, image));
    const auto depth = [&](SurfaceSolver solver, SurfaceSolver& taken) {
      Pipeline pipeline(context(), synthetic_sensor(scene), image.format, {.solver = solver});
      taken = pipeline.solver();
      pipeline.set_background(*source.own_background());
      pipeline.submit(image);
      return pipeline.read_depth_mm(*pipeline.wait());
    };
    SurfaceSolver of_auto{}, of_exact{};
    const std::vector<float> a = depth(SurfaceSolver::Auto, of_auto),
                             b = depth(SurfaceSolver::Exact, of_exact);
    EXPECT_NE(of_auto, SurfaceSolver::Auto);
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
