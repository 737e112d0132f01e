// A hundred random cases a run; palpate_fuzz runs as many as one likes.
#include "tests/pipeline/fuzz_cases.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/thorough.h"

namespace palpate::fuzz {
namespace {

class Fuzz : public GpuTest {
 protected:
  static void run(Stage stage, uint64_t cases) {
    const Tuning defaults = default_tuning(context());
    for (uint64_t seed = 1; seed <= cases; ++seed) {
      const Case c = make_case(seed, defaults, stage);
      const std::string where = difference(context(), c);
      if (where.empty()) continue;
      const Case small = shrink(context(), c);
      FAIL() << describe(c) << "\n  " << where << "\nshrunk to " << describe(small) << "\n  "
             << difference(context(), small) << "\npalpate_fuzz --stage " << to_string(stage) << " --seed "
             << seed << " --cases 1";
    }
  }
};

TEST_F(Fuzz, ContactEqualsPlainLoops) {
  run(Stage::Contact, of_sweep(200, 24));
}
TEST_F(Fuzz, SlopeEqualsPlainLoops) {
  run(Stage::Slope, of_sweep(60, 16));
}
TEST_F(Fuzz, SurfaceEqualsTheExactSolution) {
  run(Stage::Surface, 30);
}
TEST_F(Fuzz, PipelineEqualsPlainLoops) {
  run(Stage::Pipeline, of_sweep(30, 24));
}

TEST_F(Fuzz, AGelsPressIsToldFromSpecksDriftAndExposure) {
  run(Stage::Gel, of_sweep(40, 8));
}

}  // namespace
}  // namespace palpate::fuzz
