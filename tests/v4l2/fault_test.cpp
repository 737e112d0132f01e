// Faults of cameras: the driver injects them; the source reports, counts and continues.
#include <fcntl.h>
#include <grp.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "palpate/error.h"
#include "tests/v4l2/guest.h"

namespace palpate {
namespace {

constexpr const char* kSmall = "camera:0?format=GREY&size=320x180&fps=60&timeout=500ms";

/// The one line that opening `input` gives up with; empty where it opens.
std::string refusal(const std::string& input, const Sensor& sensor = gray_sensor(),
                    int* exit_code = nullptr) {
  try {
    Camera camera(parse_camera(input), sensor);
  } catch (const Error& error) {
    if (exit_code) *exit_code = error.exit_code();
    return error.what();
  }
  return {};
}

void expect_words(const std::string& text, const std::vector<std::string>& words) {
  EXPECT_EQ(text.find('\n'), std::string::npos);
  for (const std::string& word : words)
    EXPECT_NE(text.find(word), std::string::npos) << text << " lacks " << word;
}

class Fault : public Guest {
 protected:
  /// Takes `count` frames; the sequence may jump. Returns the frames that the jumps passed over.
  uint64_t take(Camera& camera, int count) {
    uint64_t passed = 0;
    for (int i = 0; i < count; ++i) {
      const uint64_t before = frame_.sequence;
      const int64_t before_ns = frame_.time_ns;
      if (!camera.next(frame_)) {
        ADD_FAILURE() << "no frame";
        return passed;
      }
      if (taken_++ > 0) {
        EXPECT_GT(frame_.sequence, before);
        EXPECT_GT(frame_.time_ns, before_ns);
        passed += frame_.sequence - before - 1;
      }
    }
    return passed;
  }
  /// Takes `count` frames. A busy machine may lose a few of them: every one is counted.
  void take_unharmed(Camera& camera, int count) {
    const uint64_t lost = camera.counts().lost;
    const uint64_t passed = take(camera, count);
    EXPECT_EQ(camera.counts().lost - lost, passed);
    EXPECT_LE(passed, uint64_t(count) / 5 + 2);
  }
  void finish(Row& r, const Camera& camera, const std::string& fault, const std::string& found) {
    fill_row(r, camera);
    r.frames = uint64_t(taken_);
    r.fault = fault;
    r.found = found;
  }

  Frame frame_;
  int taken_ = 0;
};

TEST_F(Fault, DroppedBuffersAreCountedAsLost) {
  Camera camera(parse_camera(kSmall), gray_sensor());
  Knobs(kFirst).turn("percentage_of_dropped_buffers", 30);
  const uint64_t passed = take(camera, 100);
  EXPECT_GT(passed, 10u);
  EXPECT_EQ(camera.counts().lost, passed);
  EXPECT_EQ(camera.counts().gaps, 0u);
  finish(row(), camera, "30 % of the buffers dropped", "every one counted as lost");
}

TEST_F(Fault, DamagedBuffersAreNotDelivered) {
  Camera camera(parse_camera(kSmall), gray_sensor());
  Knobs knobs(kFirst);
  uint64_t passed = take(camera, 5);
  for (int i = 0; i < 3; ++i) {
    knobs.turn("inject_v4l2_buf_flag_error", 1);
    passed += take(camera, 10);
  }
  EXPECT_EQ(camera.counts().damaged, 3u);
  EXPECT_EQ(passed, 3u + camera.counts().lost);
  EXPECT_LE(camera.counts().lost, 7u);
  finish(row(), camera, "3 buffers marked as faulty", "left out and counted; visible in the sequence");
}

TEST_F(Fault, SequenceNumbersWrap) {
  Knobs(kFirst).turn("wrap_sequence_number", 1);  // counts from 2^32 - 128 on
  Camera camera(parse_camera(kSmall), gray_sensor());
  take_unharmed(camera, 200);
  EXPECT_EQ(frame_.sequence, 199u + camera.counts().lost);
  finish(row(), camera, "sequence number wraps at 2^32", "sequence goes on");
}

TEST_F(Fault, TimeStampsWrap) {
  const v4l2::Control wrap = Knobs(kFirst).find("wrap_timestamp");
  for (const auto& [value, name] : wrap.items) {
    if (value == 0) continue;
    Knobs(kFirst).turn("wrap_timestamp", value);
    Camera camera(parse_camera(kSmall), gray_sensor());
    taken_ = 0;
    take(camera, 60);
    EXPECT_NEAR(double(frame_.time_ns), double(frame_.sequence) / 60 * 1e9, 200e6);
    EXPECT_EQ(frame_.exposed_ns, 0);
    expect_words(detail(camera, "clock"), {"delivery"});
    finish(row(), camera, "time stamps wrap (" + name + ")", "not believed: time of delivery");
  }
}

TEST_F(Fault, TimeStampsOfTheFutureAreNotBelieved) {
  Knobs(kFirst).turn("timestamp_source", 0);
  Camera camera(parse_camera("camera:0?format=GREY&size=320x180&fps=10"), gray_sensor());
  take(camera, 10);
  const bool believed = frame_.exposed_ns != 0;
  EXPECT_TRUE(frame_.exposed_ns <= frame_.delivered_ns);
  EXPECT_NEAR(double(frame_.time_ns), double(frame_.sequence) / 10 * 1e9, 200e6);
  finish(row(), camera, "stamp of the frame's end",
         believed ? "believed" : "ahead of delivery: not believed");
}

TEST_F(Fault, StreamingErrorsStartTheStreamAgain) {
  Camera camera(parse_camera(kSmall), gray_sensor());
  take(camera, 20);
  Frame held = frame_;
  const std::vector<uint8_t> copy(held.pixels(), held.pixels() + held.format.frame_bytes());
  Knobs knobs(kFirst);
  knobs.choose("test_pattern", "100% White");
  knobs.turn("inject_fatal_streaming_error", 1);
  bool marked = false;
  for (int i = 0; i < 30; ++i) {
    take(camera, 1);
    marked = marked || frame_.after_gap;
  }
  EXPECT_TRUE(marked);
  EXPECT_EQ(camera.counts().gaps, 1u);
  EXPECT_EQ(camera.state(), "");
  EXPECT_TRUE(std::equal(copy.begin(), copy.end(), held.pixels())) << "a lease was written to";
  finish(row(), camera, "fatal streaming error", "stream started again; gap marked; leases untouched");
}

TEST_F(Fault, RefusedBuffersComeBackLater) {
  Camera camera(parse_camera(kSmall), gray_sensor());
  take(camera, 5);
  for (int i = 0; i < 12; ++i) {  // more often than there are buffers: none may stay out
    Knobs(kFirst).turn("inject_vidioc_qbuf_error", 1);
    take(camera, 5);
  }
  EXPECT_EQ(camera.counts().gaps, 0u);
  finish(row(), camera, "QBUF refused 12 times", "buffers queued again; stream goes on");
}

TEST_F(Fault, RefusalsAtTheStart) {
  const std::pair<const char*, const char*> faults[] = {
      {"inject_vidioc_reqbufs_error", "REQBUFS refused"},
      {"inject_vidioc_qbuf_error", "QBUF refused at the start"},
      {"inject_vidioc_streamon_error", "STREAMON refused"}};
  for (const auto& [knob, name] : faults) {
    Row& r = row();
    r.fault = name;
    Knobs(kFirst).turn(knob, 1);
    int code = 0;
    r.found = "one line; exit code 5; the next try works";
    expect_words(refusal(kSmall, gray_sensor(), &code), {"/dev/video0", "invalid argument"});
    EXPECT_EQ(code, 5);
    Camera camera(parse_camera(kSmall), gray_sensor());
    taken_ = 0;
    take_unharmed(camera, 3);
    fill_row(r, camera);
    r.frames = 3;
  }
}

TEST_F(Fault, StalledStreamsAreNoticedAndGoOn) {
  Camera camera(parse_camera(kSmall), gray_sensor());
  take_unharmed(camera, 30);
  const uint64_t before = frame_.sequence, lost = camera.counts().lost;
  const int64_t before_ns = frame_.delivered_ns;
  std::string said;
  std::atomic<bool> stalled{false};
  Knobs knobs(kFirst);
  knobs.turn("percentage_of_dropped_buffers", 100);
  camera.watch([&] {
    const std::string state = camera.state();
    if (!state.empty() && !stalled) {
      said = state;
      stalled = true;
    }
    return false;
  });
  std::thread cure([&] {
    for (int i = 0; i < 400 && !stalled; ++i) sleep_ms(10);
    sleep_ms(700);
    knobs.turn("percentage_of_dropped_buffers", 0);
  });
  take(camera, 1);
  cure.join();
  expect_words(said, {"no frame for 0.5 s", "starting the stream again"});
  EXPECT_TRUE(frame_.after_gap);
  EXPECT_EQ(camera.counts().gaps, 1u);
  EXPECT_EQ(camera.counts().lost, lost) << "what passes in a gap is not lost";
  EXPECT_EQ(camera.state(), "");
  const double passed_s = double(frame_.delivered_ns - before_ns) * 1e-9;
  EXPECT_GT(passed_s, 1.1);
  EXPECT_NEAR(double(frame_.sequence - before), passed_s * 60, 12);
  take_unharmed(camera, 10);
  EXPECT_FALSE(frame_.after_gap);
  finish(row(), camera, "stall of 1.2 s", "said within 0.5 s; sequence goes on by the time passed");
}

TEST_F(Fault, WaitingEndsWhenCancelled) {
  Camera camera(parse_camera(kSmall), gray_sensor());
  take(camera, 2);
  Knobs(kFirst).turn("percentage_of_dropped_buffers", 100);
  const auto start = std::chrono::steady_clock::now();
  camera.watch([&] { return std::chrono::steady_clock::now() - start > std::chrono::milliseconds(200); });
  while (camera.next(frame_)) {
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(450))
      << "not the wait of 0.5 s";
  finish(row(), camera, "cancelled while waiting", "back at once");
}

void bind(bool there) {
  std::ofstream out(std::string("/sys/bus/platform/drivers/vivid/") + (there ? "bind" : "unbind"));
  out << "vivid.0" << std::flush;
  EXPECT_TRUE(out.good());
}

class Unplugged : public Fault {
 protected:
  /// A node that was held while its camera went has its number taken: once more, for the tests that follow.
  void TearDown() override {
    frame_ = {};
    bind(false);
    bind(true);
    Fault::TearDown();
  }
  /// Pulls the plug with `pull`, plugs in again once the source has said so for a while.
  void outage(const std::function<void()>& pull, uint64_t gaps, const std::string& fault) {
    Knobs(kFirst).choose("test_pattern", "100% White");
    Camera camera(parse_camera(std::string(kSmall) + "&control.contrast=100"), gray_sensor());
    take(camera, 20);
    const Frame held = frame_;
    ASSERT_NE(held.leased, nullptr);
    const std::vector<uint8_t> copy(held.pixels(), held.pixels() + held.format.frame_bytes());
    const uint64_t before = frame_.sequence;
    const int64_t before_ns = frame_.delivered_ns;
    std::mutex mutex;
    std::string said;
    camera.watch([&] {
      const std::lock_guard lock(mutex);
      if (said.empty()) said = camera.state();
      return false;
    });
    std::atomic<bool> done{false};
    std::thread hand([&] {
      pull();
      sleep_ms(900);
      bind(false);
      sleep_ms(300);
      bind(true);
      done = true;
    });
    uint64_t marked = 0;
    for (int i = 0; i < 500 && !(done && marked >= gaps); ++i) {
      take(camera, 1);
      marked += frame_.after_gap;
    }
    hand.join();
    EXPECT_EQ(marked, gaps);
    expect_words(said, {"unplugged", "waiting for the camera"});
    EXPECT_EQ(camera.counts().gaps, gaps);
    EXPECT_LE(camera.counts().lost, 12u) << "what passes in a gap is not lost";
    const double passed_s = double(frame_.delivered_ns - before_ns) * 1e-9;
    EXPECT_NEAR(double(frame_.sequence - before), passed_s * 60, 12);
    take_unharmed(camera, 30);
    EXPECT_EQ(camera.state(), "");
    // The knobs of a camera that was plugged in anew are its own; ours are back.
    EXPECT_EQ(detail(camera, "control.contrast"), "100");
    expect_words(detail(camera, "control.test_pattern"), {"100% White"});
    for (uint32_t x = 0; x < 320; ++x) ASSERT_EQ(frame_.at(0, x, 90), held.at(0, x, 90)) << x;
    EXPECT_TRUE(std::equal(copy.begin(), copy.end(), held.pixels())) << "a lease was written to";
    finish(row(), camera, fault,
           "said; opened again as " + detail(camera, "node") + " with its controls; gap marked");
  }
};

TEST_F(Unplugged, DisconnectedByItsBus) {
  outage([] { Knobs(kFirst).turn("disconnect", 1); }, 1, "disconnect; then plugged in anew");
}

TEST_F(Unplugged, DriverUnboundAndBound) {
  outage([] { bind(false), sleep_ms(300), bind(true); }, 2, "driver unbound and bound twice");
}

TEST_F(Fault, ABusyCameraNamesWhoHoldsIt) {
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    Camera camera(parse_camera(kSmall), gray_sensor());
    Frame frame;
    camera.next(frame);
    (void)!write(ready[1], "x", 1);
    sleep(60);
    _exit(0);
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  int code = 0;
  expect_words(refusal(kSmall, gray_sensor(), &code),
               {"another program using it", "palpate_v4l2", "(" + std::to_string(child) + ")"});
  EXPECT_EQ(code, 5);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  Row& r = row();
  r.fault = "another program streams";
  r.found = "one line that names it and its process; free again when it was killed";
  Camera camera(parse_camera(kSmall), gray_sensor());
  take(camera, 2);
  fill_row(r, camera);
  r.frames = 2;
}

TEST_F(Fault, ClosedNodesNameTheirGroup) {
  Row& r = row();
  r.fault = "node of group video; user not in it";
  r.found = "one line that names the group and how to join it";
  ASSERT_EQ(chmod(kFirst, 0660) + chown(kFirst, 0, 44), 0);
  int lines[2];
  ASSERT_EQ(pipe(lines), 0);
  const pid_t child = fork();
  if (child == 0) {
    if (setgroups(0, nullptr) + setgid(1000) + setuid(1000) != 0) _exit(1);
    const std::string line = refusal(kSmall);
    (void)!write(lines[1], line.data(), line.size());
    _exit(0);
  }
  close(lines[1]);
  std::string line(1000, 0);
  line.resize(size_t(std::max<ssize_t>(0, read(lines[0], line.data(), line.size()))));
  waitpid(child, nullptr, 0);
  expect_words(line, {"/dev/video0", "no permission", "group 'video'", "usermod -aG video"});
}

TEST_F(Fault, WhatACameraCannotDoIsListed) {
  struct Case {
    const char* fault;
    const char* input;
    std::vector<std::string> words;
    int code;
  };
  const Case cases[] = {
      {"format that it lacks",
       "camera:0?format=MJPEG",
       {"MJPEG", "/dev/video0 (vivid)", "GREY, Y10, Y12, Y16"},
       5},
      {"format that nobody knows", "camera:0?format=Y99", {"Y99", "GREY", "MJPEG"}, 2},
      {"size that it lacks", "camera:0?format=GREY&size=1392x1042", {"1392x1042", "640x480", "3840x2160"}, 5},
      {"rate that it lacks",
       "camera:0?format=GREY&size=640x480&fps=60",
       {"60 frames/s", "found 25", "12.5"},
       5},
      {"exposure that it lacks", "camera:0?exposure=8ms", {"exposure", "brightness", "gain"}, 5},
      {"gain beyond its range", "camera:0?gain=100000", {"gain at 100000", "0 to 255"}, 5},
      {"control that it lacks", "camera:0?control.focus=3", {"'focus'", "brightness"}, 5},
      {"no such device node",
       "camera:/dev/video77",
       {"/dev/video77", "no such device node", "/dev/video0 (vivid)"},
       5},
      {"node that takes frames",
       "camera:/dev/video3",
       {"/dev/video3", "delivers no frames", "/dev/video0"},
       5},
      {"node that is no camera", "camera:/dev/null", {"/dev/null", "something else"}, 5},
  };
  for (const Case& c : cases) {
    Row& r = row();
    r.fault = c.fault;
    r.found = "one line; exit code " + std::to_string(c.code);
    int code = 0;
    expect_words(refusal(c.input, gray_sensor(), &code), c.words);
    EXPECT_EQ(code, c.code) << c.input;
  }
  Row& r = row();
  r.fault = "gray format for a colour sensor";
  r.found = "one line; exit code 5";
  expect_words(refusal("camera:0?format=GREY", colour_sensor()), {"GREY", "gray", "YUYV"});
}

}  // namespace
}  // namespace palpate
