// The volume of the dent, from the tiles of the height map, against the synthetic sensor's.
#include <gtest/gtest.h>

#include "tests/scenes/synthetic_run.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

class IndentedVolume : public GpuTest {};

TEST_F(IndentedVolume, FollowsTheTruth) {
  for (const char* input :
       {"press?mode=gel&size=320x240&noise=off", "press?mode=waveguide&size=320x240&noise=off"}) {
    SyntheticRun run(input);
    Pipeline pipeline =
        run.pipeline(context(), {.outputs = Output::Force | Output::Surface, .solver = SurfaceSolver::Best});
    int judged = 0;
    for (uint64_t i = 0; i < run.count(); i += 15) {
      const Touch t = pipeline.process(run.frame(i)).touch;
      const Truth truth = run.truth(i);
      if (!t.contact) {
        EXPECT_EQ(t.surface->volume_mm3, 0) << input << " frame " << i;
        continue;
      }
      if (truth.force_N < 0.2) continue;
      ++judged;
      // Touched tiles hold most of the dent, and of the bulge around it a part.
      EXPECT_GT(t.surface->volume_mm3, 0.7 * truth.volume_mm3) << input << " frame " << i;
      EXPECT_LT(t.surface->volume_mm3, 1.1 * truth.volume_mm3) << input << " frame " << i;
    }
    EXPECT_GT(judged, 3) << input;
  }
}

}  // namespace
}  // namespace palpate
