// The cell change stage: its sums are those of plain loops, to the last unit.
#include "engine/stages/frame/cell_change.h"

#include <gtest/gtest.h>

#include <cstring>

#include "tests/reference/cell_change.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/stage_run.h"

namespace palpate {
namespace {

class CellChangeStageTest : public GpuTest {
 protected:
  static std::vector<shared::CellChange> run(const Frame& image, const Frame& rest) {
    const CellChangeStage stage(context(), image.format);
    FrameOnGpu images(context(), image.format);
    const gpu::DeviceBuffer cells(context(), "cells", stage.bytes(), gpu::Memory::Readback);
    gpu::Commands commands(context());
    commands.begin();
    images.record(commands);
    stage.record(commands, images.frame, images.background, cells);
    commands.host_barrier();
    commands.end();
    images.write(image, rest);
    commands.submit();
    commands.wait();
    cells.invalidate();
    const auto found = cells.as<const shared::CellChange>();
    return {found.begin(),
            found.begin() + static_cast<std::ptrdiff_t>(stage.bytes() / sizeof(shared::CellChange))};
  }
};

TEST_F(CellChangeStageTest, EqualsPlainLoops) {
  std::mt19937 random(5);
  constexpr std::array<std::array<uint32_t, 2>, 7> kSizes{
      {{379, 277}, {1, 1}, {3, 5}, {16, 4}, {17, 33}, {64, 64}, {5, 90}}};
  for (const auto& [width, height] : kSizes)
    for (const bool extreme : {false, true}) {
      const FrameFormat format{width, height, 3, 8};
      const Frame image = extreme ? uniform_frame(format, 255) : random_frame(format, 90, 160, random);
      const Frame rest = extreme ? uniform_frame(format, 0) : random_frame(format, 0, 255, random);
      const std::vector<shared::CellChange> wanted = reference::cell_changes(image, rest),
                                            got = run(image, rest);
      ASSERT_EQ(got.size(), wanted.size());
      EXPECT_EQ(std::memcmp(got.data(), wanted.data(), got.size() * sizeof got[0]), 0)
          << width << " x " << height;
    }
}

}  // namespace
}  // namespace palpate
