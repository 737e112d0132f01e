// A recording that ends in the worst way: killed at any moment, or with no room left on the disk.
#include <fcntl.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "tests/session_fixture.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

int64_t now_ns() {
  return Clock::now().time_since_epoch().count();
}

/// What the child tells through a pipe, whole as pipes write it.
struct Told {
  uint64_t sequence;  ///< that record() has accepted
  int64_t time_ns;    ///< when; the children's clock is ours
};

constexpr FrameFormat kFormat{160, 120, 1, 8};
constexpr auto kInterval = std::chrono::microseconds(8333);  // 120 frames/s

/// Records until it is killed, and tells each frame. Frame n is noise_frame of n % 16 with number n.
[[noreturn]] void record_until_killed(const fs::path& folder, int pipe) {
  std::vector<Frame> frames;
  for (uint64_t n = 0; n < 16; ++n) frames.push_back(noise_frame(kFormat, n));
  SessionInfo info = plain_info(kFormat);
  info.outputs = static_cast<uint32_t>(Output::Force);
  SessionWriter writer(folder, info);
  auto next = Clock::now();
  for (uint64_t n = 0;; ++n) {
    Frame& frame = frames[n % frames.size()];
    frame.sequence = n;
    frame.time_ns = static_cast<int64_t>(n) * 8'333'333;
    if (!writer.record(frame)) _exit(3);
    Touch touch;
    touch.sequence = n;
    touch.gray_sum = static_cast<double>(n);
    writer.measured(touch);
    const Told told{n, now_ns()};
    if (write(pipe, &told, sizeof told) != sizeof told) _exit(4);
    next += kInterval;
    std::this_thread::sleep_until(next);
  }
}

class SessionCrash : public Sessions {};

TEST_F(SessionCrash, KilledAtRandomMomentsLosesNothingOlderThanASecond) {
  const char* wanted = std::getenv("PALPATE_KILLS");
  const int kills = wanted ? std::atoi(wanted) : 20;
  std::mt19937 random(std::random_device{}());
  std::vector<Frame> pixels;
  for (uint64_t n = 0; n < 16; ++n) pixels.push_back(noise_frame(kFormat, n));
  int64_t youngest_lost_ns = 0, most_lost = 0;
  uint64_t recorded = 0;
  for (int kill_number = 0; kill_number < kills; ++kill_number) {
    const fs::path folder = folder_ / std::to_string(kill_number);
    int ends[2];
    ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
    ASSERT_GE(fcntl(ends[1], F_SETPIPE_SZ, 1 << 20), 0);
    const pid_t child = fork();
    if (child == 0) record_until_killed(folder, ends[1]);
    close(ends[1]);
    // The first frame is told once the folder stands; the moment counts from there.
    Told told{};
    ASSERT_EQ(read(ends[0], &told, sizeof told), static_cast<ssize_t>(sizeof told));
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 1'500'000));
    const int64_t killed_ns = now_ns();
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the child ended by itself: " << status;
    uint64_t accepted = 1, old = told.time_ns < killed_ns - 1'000'000'000 ? 1 : 0;
    std::vector<int64_t> times_ns = {told.time_ns};
    while (read(ends[0], &told, sizeof told) == static_cast<ssize_t>(sizeof told)) {
      times_ns.push_back(told.time_ns);
      ++accepted;
      old += told.time_ns < killed_ns - 1'000'000'000 ? 1 : 0;
    }
    close(ends[0]);
    uint64_t found = 0;
    const Refusal refused = refusal([&] {
      Session session(folder);
      EXPECT_FALSE(session.complete());
      EXPECT_NE(session.warning().find("cut short"), std::string::npos);
      Frame frame;
      while (session.next(frame)) {
        ASSERT_EQ(frame.sequence, found);  // none was dropped
        ASSERT_TRUE(same_pixels(frame, pixels[found % pixels.size()]));
        ++found;
      }
      EXPECT_EQ(*session.frame_count(), found);
      EXPECT_EQ(session.counts().damaged, 0u);
      // A row tells of a frame that is there; what was measured is in it.
      const std::vector<uint64_t> measured = session.measured_sequences();
      EXPECT_LE(measured.size(), found);
      EXPECT_GE(measured.size(), old);
      for (const uint64_t n : measured) {
        const std::string cells = *session.recorded(n);
        EXPECT_EQ(cells.substr(0, cells.find(',', 2)), "0," + std::to_string(n));
      }
    });
    if (refused.exit_code != 0) {
      expect_one_line(refused, 3);  // no frame got out
      EXPECT_EQ(old, 0u) << refused.line;
    }
    EXPECT_GE(found, old) << "kill " << kill_number;
    if (found < accepted) {
      youngest_lost_ns = std::max(youngest_lost_ns, killed_ns - times_ns[found]);
      most_lost = std::max(most_lost, static_cast<int64_t>(accepted - found));
    }
    recorded += accepted;
    if (!HasFailure()) fs::remove_all(folder);
  }
  std::printf(
      "%d kills, %llu frames recorded; at most %lld lost, the oldest of them %.1f ms before the kill\n",
      kills, static_cast<unsigned long long>(recorded), static_cast<long long>(most_lost),
      static_cast<double>(youngest_lost_ns) / 1e6);
}

/// Records frames of noise into `folder` until the writer gives up, and checks what it says and leaves.
void expect_full_disk_is_survived(const fs::path& folder, const char* why) {
  constexpr FrameFormat kLarge{200, 150, 1, 8};
  uint64_t written = 0, offered = 0;
  {
    SessionWriter writer(folder, plain_info(kLarge), {.no_drop = true});
    while (writer.record(noise_frame(kLarge, offered))) {
      ++offered;
      ASSERT_LT(offered, 1000u) << "the disk is not full";
    }
    EXPECT_FALSE(writer.record(noise_frame(kLarge, offered + 1)));
    const SessionStatus status = writer.close();
    EXPECT_NE(status.error.find(why), std::string::npos) << status.error;
    EXPECT_EQ(status.error.find('\n'), std::string::npos);
    EXPECT_EQ(status.dropped, 2u);
    EXPECT_EQ(status.recorded, offered);
    written = status.written;
  }
  EXPECT_GT(written, 5u);
  Session session(folder);
  EXPECT_FALSE(session.complete());
  EXPECT_EQ(*session.frame_count(), written);
  Frame frame;
  for (uint64_t n = 0; n < written; ++n) {
    ASSERT_TRUE(session.next(frame));
    expect_same(frame, noise_frame(kLarge, n));
  }
  EXPECT_FALSE(session.next(frame));
  EXPECT_EQ(session.counts().damaged, 0u);
}

TEST_F(SessionCrash, ALimitOnFileSizesEndsTheRecordingOnly) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1'000'000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  expect_full_disk_is_survived(folder_ / "s", "File too large");
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, handler);
}

TEST_F(SessionCrash, AFullDiskEndsTheRecordingOnly) {
  const fs::path disk = folder_ / "disk";
  fs::create_directories(disk);
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=1m") != 0)
    GTEST_SKIP() << "a small disk cannot be mounted here: " << std::strerror(errno);
  expect_full_disk_is_survived(disk / "s", "No space left");
  EXPECT_EQ(umount(disk.c_str()), 0);
}

TEST_F(SessionCrash, WhatCannotBeginLeavesNoSession) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  SessionInfo info = plain_info(kFormat);
  info.background = noise_frame(kFormat, 1);
  for (const rlim_t most : {rlim_t{100}, rlim_t{4000}}) {  // the video's head; the background
    const rlimit small{most, before.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    const Refusal refused = refusal([&] { SessionWriter(folder_ / "s", info); });
    setrlimit(RLIMIT_FSIZE, &before);
    expect_one_line(refused, 7);
    EXPECT_TRUE(fs::is_empty(folder_ / "s")) << most;
  }
  EXPECT_EQ(refusal([&] { SessionWriter(folder_ / "s", info); }).exit_code, 0);
  signal(SIGXFSZ, handler);
}

TEST_F(SessionCrash, AFolderThatCannotBeWrittenIsRefused) {
  const Refusal refused = refusal([] { SessionWriter("/proc/nothing", plain_info(kFormat)); });
  expect_one_line(refused, 7);
}

}  // namespace
}  // namespace palpate
