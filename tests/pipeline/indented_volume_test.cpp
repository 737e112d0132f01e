// The volume of the dent, from the tiles of the height map, against the synthetic sensor's.
#include <gtest/gtest.h>

#include "capture/synthetic/synthetic.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

class IndentedVolume : public GpuTest {};

TEST_F(IndentedVolume, FollowsTheTruth) {
  for (const char* input : {"synthetic:press?mode=gel&size=320x240&noise=off",
                            "synthetic:press?mode=waveguide&size=320x240&noise=off"}) {
    const SyntheticOptions options = parse_synthetic(input);
    const SyntheticSensor source(options);
    Pipeline pipeline(context(), synthetic_sensor(options), source.format(),
                      {.outputs = Output::Force | Output::Surface, .solver = SurfaceSolver::Converged});
    pipeline.set_background(*source.own_background());
    Frame frame;
    int judged = 0;
    for (uint64_t i = 0; i < *source.frame_count(); i += 15) {
      ASSERT_TRUE(source.render(i, frame));
      const Touch t = pipeline.process(frame);
      const std::optional<Truth> truth = source.truth(i);
      if (!t.contact) {
        EXPECT_EQ(t.volume_mm3, 0) << input << " frame " << i;
        continue;
      }
      if (truth->force_N < 0.2) continue;
      ++judged;
      // Touched tiles hold most of the dent, and of the bulge around it a part.
      EXPECT_GT(t.volume_mm3, 0.7 * truth->volume_mm3) << input << " frame " << i;
      EXPECT_LT(t.volume_mm3, 1.1 * truth->volume_mm3) << input << " frame " << i;
    }
    EXPECT_GT(judged, 3) << input;
  }
}

}  // namespace
}  // namespace palpate
