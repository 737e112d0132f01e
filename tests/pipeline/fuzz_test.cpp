// A few hundred random cases a run, within bounds of time; palpate_fuzz runs as many as one likes.
#include <unistd.h>

#include <chrono>

#include "tests/pipeline/fuzz_cases.h"
#include "tests/pipeline/fuzz_files.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/thorough.h"

namespace palpate::fuzz {
namespace {

using Clock = std::chrono::steady_clock;
const auto kLongest = std::chrono::seconds(of_sweep(12, 5));

class Fuzz : public GpuTest {
 protected:
  static void run(Stage stage, uint64_t cases) {
    const Tuning defaults = default_tuning(context());
    const auto start = Clock::now();
    uint64_t done = 0;
    for (uint64_t seed = 1; seed <= cases && Clock::now() - start < kLongest; ++seed, ++done) {
      const Case c = make_case(seed, defaults, stage);
      const std::string where = difference(context(), c);
      if (where.empty()) continue;
      const Case small = shrink(context(), c);
      FAIL() << describe(c) << "\n  " << where << "\nshrunk to " << describe(small) << "\n  "
             << difference(context(), small) << "\npalpate_fuzz --stage " << to_string(stage) << " --seed "
             << seed << " --cases 1";
    }
    std::printf("%llu of %llu cases\n", static_cast<unsigned long long>(done),
                static_cast<unsigned long long>(cases));
    EXPECT_GT(done, 3u) << "too slow to have tested anything";
  }
};

TEST_F(Fuzz, ContactEqualsPlainLoops) {
  run(Stage::Contact, 200);
}
TEST_F(Fuzz, SlopeEqualsPlainLoops) {
  run(Stage::Slope, 60);
}
TEST_F(Fuzz, SurfaceEqualsTheExactSolution) {
  run(Stage::Surface, 30);
}
TEST_F(Fuzz, PipelineEqualsPlainLoops) {
  run(Stage::Pipeline, 30);
}

TEST_F(Fuzz, AGelsPressIsToldFromSpecksDriftAndExposure) {
  run(Stage::Gel, 40);
}

TEST(FuzzFiles, DamagedFilesAreReadOrRefused) {
  const auto folder = std::filesystem::temp_directory_path() / ("palpate-fuzz-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  for (const Kind kind : kKinds) {
    const auto start = Clock::now();
    for (uint64_t seed = 1; seed <= 200 && Clock::now() - start < kLongest / 4; ++seed) {
      const std::string trouble = file_trouble(kind, seed, folder);
      ASSERT_EQ(trouble, "") << to_string(kind) << " seed " << seed << ", kept in " << folder;
    }
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace palpate::fuzz
