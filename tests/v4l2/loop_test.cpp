// Known palpation frames put out on one node and taken in on another: every pixel and every measurement is
// the same.
#include <fcntl.h>
#include <linux/v4l2-dv-timings.h>
#include <linux/videodev2.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <set>
#include <thread>

#include "capture/synthetic/synthetic.h"
#include "engine/base/text.h"
#include "tests/reference/contact.h"
#include "tests/v4l2/guest.h"

namespace palpate {
namespace {

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#ifdef __clang__
#pragma GCC diagnostic ignored "-Wc99-designator"
#endif
const v4l2_dv_timings kTimings = V4L2_DV_BT_DMT_640X480P60;  // the kernel's C
#pragma GCC diagnostic pop

class Loop : public Guest {
 protected:
  /// The output as a grabber's source: 640 x 480 at 60 frames/s on both ends.
  void open_output(uint32_t fourcc) {
    out_ = open(kLoopOut, O_RDWR);
    ASSERT_GE(out_, 0);
    const int in = open(kLoopIn, O_RDWR);
    ASSERT_GE(in, 0);
    v4l2_dv_timings timings = kTimings;
    EXPECT_EQ(v4l2::call(out_, VIDIOC_S_DV_TIMINGS, &timings), 0);
    timings = kTimings;
    EXPECT_EQ(v4l2::call(in, VIDIOC_S_DV_TIMINGS, &timings), 0);
    close(in);
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    format.fmt.pix.width = 640;
    format.fmt.pix.height = 480;
    format.fmt.pix.pixelformat = fourcc;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    ASSERT_EQ(v4l2::call(out_, VIDIOC_S_FMT, &format), 0);
    ASSERT_EQ(format.fmt.pix.pixelformat, fourcc);
    Knobs in_knobs(kLoopIn);
    in_knobs.turn("osd_text_mode", 2);
    in_knobs.turn("timestamp_source", 1);
    v4l2::Device in_device(kLoopIn);
    for (const v4l2::Control& c : in_device.controls())
      if (c.name == "loop_video") in_device.set(c.id, 1);
    set_on_output("loop_video", 1);
  }
  void TearDown() override {
    if (out_ >= 0) close(out_);
    Guest::TearDown();
  }
  void set_on_output(const std::string& name, int value) const {
    v4l2_query_ext_ctrl about{};
    for (about.id = V4L2_CTRL_FLAG_NEXT_CTRL; v4l2::call(out_, VIDIOC_QUERY_EXT_CTRL, &about) == 0;
         about.id |= V4L2_CTRL_FLAG_NEXT_CTRL) {
      if (v4l2::control_name(about.name) != name) continue;
      v4l2_control control{about.id, value};
      EXPECT_EQ(v4l2::call(out_, VIDIOC_S_CTRL, &control), 0);
    }
  }

  int out_ = -1;
};

/// Puts frames out on a node, at its pace.
class Player {
 public:
  explicit Player(int out) : out_(out) {
    v4l2_requestbuffers request{};
    request.count = 4;
    request.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    request.memory = V4L2_MEMORY_MMAP;
    EXPECT_EQ(v4l2::call(out_, VIDIOC_REQBUFS, &request), 0);
    for (uint32_t i = 0; i < request.count; ++i) {
      v4l2_buffer buffer = about(i);
      EXPECT_EQ(v4l2::call(out_, VIDIOC_QUERYBUF, &buffer), 0);
      void* begin = mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, out_, buffer.m.offset);
      EXPECT_NE(begin, MAP_FAILED);
      memory_.push_back({static_cast<uint8_t*>(begin), buffer.length});
    }
  }
  ~Player() {
    uint32_t type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    v4l2::call(out_, VIDIOC_STREAMOFF, &type);
    for (const auto& m : memory_) munmap(m.data(), m.size());
  }
  void show(const Frame& frame) {
    uint32_t i = shown_;
    if (shown_ >= memory_.size()) {
      v4l2_buffer done = about(0);
      EXPECT_EQ(v4l2::call(out_, VIDIOC_DQBUF, &done), 0);
      i = done.index;
    }
    const size_t bytes = frame.format.frame_bytes();
    ASSERT_LE(bytes, memory_[i].size());
    std::memcpy(memory_[i].data(), frame.pixels(), bytes);
    v4l2_buffer buffer = about(i);
    buffer.bytesused = static_cast<uint32_t>(bytes);
    buffer.field = V4L2_FIELD_NONE;
    EXPECT_EQ(v4l2::call(out_, VIDIOC_QBUF, &buffer), 0);
    uint32_t type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    if (++shown_ == memory_.size()) {
      EXPECT_EQ(v4l2::call(out_, VIDIOC_STREAMON, &type), 0);
    }
  }

 private:
  static v4l2_buffer about(uint32_t index) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    return buffer;
  }

  int out_;
  std::vector<std::span<uint8_t>> memory_;
  uint32_t shown_ = 0;
};

/// Numbers of the frames sent that arrived, in the order of their arrival.
void play(int out, const std::vector<Frame>& sent, const Sensor& sensor, const char* format, Row& row,
          std::vector<std::pair<size_t, Frame>>& arrived) {
  Camera camera(parse_camera(std::string("camera:2?size=640x480&format=") + format), sensor);
  std::atomic<bool> ended{false};
  std::thread player([&] {
    Player show(out);
    for (int round = 0; round < 3; ++round)
      for (const Frame& shown : sent) show.show(shown);
    ended = true;
    sleep_ms(100);
  });
  Frame frame;
  uint64_t strange = 0;
  while (!ended && camera.next(frame)) {
    ++row.frames;
    size_t k = 0;
    while (k < sent.size() && std::memcmp(sent[k].pixels(), frame.pixels(), frame.format.frame_bytes()) != 0)
      ++k;
    if (k == sent.size()) {
      EXPECT_TRUE(arrived.empty()) << format << ": a frame that was never sent, after " << arrived.size();
      ++strange;  // before the first arrives, the grabber shows a test picture
    } else if (arrived.empty() || arrived.back().first != k) {
      Frame kept;
      kept.reshape(frame.format);
      std::memcpy(kept.bytes.data(), frame.pixels(), frame.format.frame_bytes());
      arrived.emplace_back(k, std::move(kept));
    }
  }
  player.join();
  EXPECT_LT(strange, 10u) << format;
  fill_row(row, camera);
}

TEST_F(Loop, PalpationFramesArriveBitForBitAndMeasureTheSame) {
  const std::pair<const char*, uint32_t> cases[] = {{"GREY", 8}, {"Y10", 10}, {"Y12", 12}, {"Y16", 16}};
  for (const auto& [format, bits] : cases) {
    Row& r = row();
    r.camera = "grabber fed with palpation";
    SyntheticOptions options;
    options.bit_depth = bits;
    const SyntheticSensor synthetic(options);
    const Sensor sensor = synthetic_sensor(options);
    const Frame rest = *synthetic.own_background();
    std::vector<Frame> sent(8);
    const uint64_t count = *synthetic.frame_count();
    for (size_t k = 0; k < sent.size(); ++k) ASSERT_TRUE(synthetic.render(count * k / sent.size(), sent[k]));
    open_output(find_pixel_format(std::string_view(format))->fourcc);
    std::vector<std::pair<size_t, Frame>> arrived;
    play(out_, sent, sensor, format, r, arrived);
    close(out_);
    out_ = -1;

    std::set<size_t> seen;
    double worst = 0;
    for (const auto& [k, frame] : arrived) {
      if (!seen.insert(k).second) continue;
      const ContactMoments found = reference::moments(frame, rest, sensor),
                           wanted = reference::moments(sent[k], rest, sensor);
      EXPECT_TRUE(found == wanted) << format << " frame " << k;
      const Truth truth = *synthetic.truth(count * k / sent.size());
      if (!truth.contact) continue;
      const double force_N =
          sensor.force->c1_N_per_gray * (static_cast<double>(found.gray) / 256) + sensor.force->c0_N;
      worst = std::max(worst, std::abs(force_N / truth.force_N - 1));
    }
    EXPECT_GE(seen.size(), 3u) << format;  // a slow guest is shown some of the frames only
    EXPECT_LT(worst, 0.02) << format;
    r.found =
        text("%zu different frames bit for bit; force within %.2f %% of the truth", seen.size(), 100 * worst);
  }
}

}  // namespace
}  // namespace palpate
