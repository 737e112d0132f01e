// Sessions written and read back: to the last bit, with all that goes with the frames.
#include <sstream>

#include "capture/measurements.h"
#include "tests/session_fixture.h"

namespace palpate {
namespace {

struct Case {
  FrameFormat format;
  uint64_t frames;
};

class SessionFormats : public Sessions, public testing::WithParamInterface<Case> {};

TEST_P(SessionFormats, ComeBackBitForBit) {
  const auto& [format, frames] = GetParam();
  SessionInfo info = plain_info(format);
  info.background = noise_frame(format, 99);
  const fs::path session = record("s", info, frames);
  Session read(session);
  EXPECT_TRUE(read.complete());
  EXPECT_EQ(read.warning(), "");
  EXPECT_EQ(read.format(), format);
  EXPECT_EQ(read.frame_count(), frames);
  Frame frame;
  for (uint64_t n = 0; n < frames; ++n) {
    ASSERT_TRUE(read.next(frame)) << n;
    expect_same(frame, noise_frame(format, n));
  }
  EXPECT_FALSE(read.next(frame));
  EXPECT_EQ(read.counts().damaged, 0u);
  const std::optional<Frame> background = read.own_background();
  ASSERT_TRUE(background);
  EXPECT_TRUE(same_pixels(*background, *info.background));
}

INSTANTIATE_TEST_SUITE_P(
    Depths, SessionFormats,
    testing::Values(Case{{64, 48, 1, 8}, 9}, Case{{64, 48, 1, 9}, 9}, Case{{64, 48, 1, 10}, 9},
                    Case{{64, 48, 1, 11}, 9}, Case{{64, 48, 1, 12}, 9}, Case{{64, 48, 1, 13}, 9},
                    Case{{64, 48, 1, 14}, 9}, Case{{64, 48, 1, 15}, 9}, Case{{64, 48, 1, 16}, 9},
                    Case{{64, 48, 3, 8}, 9}, Case{{1, 1, 1, 8}, 3}, Case{{1, 1, 1, 16}, 3},
                    Case{{1, 1, 3, 8}, 3}, Case{{2, 1, 1, 12}, 3}, Case{{1, 700, 1, 8}, 3},
                    Case{{700, 1, 3, 8}, 3}, Case{{641, 479, 1, 8}, 4}, Case{{641, 479, 1, 12}, 4},
                    Case{{641, 479, 3, 8}, 4}, Case{{65, 1000, 1, 10}, 2}, Case{{1392, 1042, 1, 16}, 2}),
    [](const auto& one) {
      const FrameFormat& f = one.param.format;
      return std::to_string(f.width) + "x" + std::to_string(f.height) + "x" + std::to_string(f.channels) +
             "_" + std::to_string(f.bit_depth) + "_bits";
    });

}  // namespace
}  // namespace palpate
