// Frames of a virtual camera in every format and size, through the driver's own buffers.
#include "tests/v4l2/guest.h"

namespace palpate {
namespace {

TEST_F(Guest, FramesComeInOrder) {
  Row& r = row();
  Camera camera(parse_camera("camera:0?format=GREY&size=640x360"), gray_sensor());
  Frame frame;
  uint64_t last = 0;
  int64_t last_ns = -1;
  for (int i = 0; i < 30; ++i) {
    ASSERT_TRUE(camera.next(frame));
    EXPECT_EQ(frame.sequence, i == 0 ? 0 : last + 1);
    EXPECT_GT(frame.time_ns, last_ns);
    EXPECT_GT(frame.exposed_ns, 0);
    EXPECT_LE(frame.exposed_ns, frame.delivered_ns);
    last = frame.sequence;
    last_ns = frame.time_ns;
  }
  r.frames = 30;
  fill(r, camera);
  for (const auto& [k, v] : camera.details()) std::printf("%s: %s\n", k.c_str(), v.c_str());
  EXPECT_EQ(r.counts.lost, 0u);
}

}  // namespace
}  // namespace palpate
