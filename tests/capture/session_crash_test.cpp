// Crash of a recording: killed at any moment, or with no room left on the disk.
#include <fcntl.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "tests/support/session_fixture.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

int64_t now_ns() {
  return Clock::now().time_since_epoch().count();
}

/// Message of the child through a pipe, written as a whole.
struct Told {
  uint64_t sequence;  ///< that record() has accepted
  uint64_t written;   ///< frames that the writer had handed to the file by then
  int64_t asked_ns;   ///< before record(); the children's clock is ours
  int64_t taken_ns;   ///< after it
};

constexpr FrameFormat kFormat{160, 120, 1, 8};
constexpr FrameFormat kLargeFormat{640, 480, 1, 16};         // of noise: 60 ms each to encode
constexpr auto kInterval = std::chrono::microseconds(8333);  // 120 frames/s
constexpr uint64_t kPictures = 8;

/// Records until it is killed, and reports each frame. Frame n is noise_frame of n % kPictures with number n.
[[noreturn]] void record_until_killed(const fs::path& folder, const FrameFormat& format, int pipe) {
  std::vector<Frame> frames;
  for (uint64_t n = 0; n < kPictures; ++n) frames.push_back(noise_frame(format, n));
  SessionInfo info = plain_info(format);
  info.outputs = Output::Force;
  SessionWriter writer(folder, info);
  auto next = Clock::now();
  for (uint64_t n = 0;; ++n) {
    Frame& frame = frames[n % frames.size()];
    frame.sequence = n;
    frame.time_ns = static_cast<int64_t>(n) * 8'333'333;
    const int64_t asked_ns = now_ns();
    const bool taken = writer.record(frame);
    const int64_t taken_ns = now_ns();
    if (taken) {
      Touch touch;
      touch.sequence = n;
      touch.gray_sum = static_cast<double>(n);
      writer.measured(touch);
    }
    const Told told{n, writer.status().written, asked_ns, taken_ns};
    if (taken && write(pipe, &told, sizeof told) != sizeof told) _exit(4);
    next += kInterval;
    std::this_thread::sleep_until(next);
  }
}

class SessionCrash : public Sessions {
 protected:
  /// What the writer called written may not be lost, nor the rows of all but the last of it, nor a frame that
  /// was taken longer before the last one than frames may wait. How long before the kill all that was depends
  /// on the machine; it is printed.
  void kill_recordings(const FrameFormat& format, int kills);
};

/// The child's reports until it was killed, and the time of that.
struct Life {
  std::vector<Told> told;
  int64_t killed_ns = 0;
};
Life live_and_die(const fs::path& folder, const FrameFormat& format, std::chrono::microseconds after_first) {
  Life life;
  int ends[2];
  EXPECT_EQ(pipe2(ends, O_CLOEXEC), 0);
  EXPECT_GE(fcntl(ends[1], F_SETPIPE_SZ, 1 << 20), 0);
  const pid_t child = fork();
  if (child == 0) record_until_killed(folder, format, ends[1]);
  close(ends[1]);
  Told told{};
  const auto next = [&] { return read(ends[0], &told, sizeof told) == static_cast<ssize_t>(sizeof told); };
  if (next()) life.told.push_back(told);  // the folder stands
  std::this_thread::sleep_for(after_first);
  life.killed_ns = now_ns();
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status)) << "the child ended by itself: " << status;
  while (next()) life.told.push_back(told);
  close(ends[0]);
  return life;
}

void SessionCrash::kill_recordings(const FrameFormat& format, int kills) {
  std::mt19937 random(std::random_device{}());
  std::vector<Frame> pixels;
  for (uint64_t n = 0; n < kPictures; ++n) pixels.push_back(noise_frame(format, n));
  double oldest_lost_ms = 0, longest_ms = 0;
  size_t most_lost = 0, recorded = 0;
  for (int kill_number = 0; kill_number < kills; ++kill_number) {
    const fs::path folder = folder_ / std::to_string(kill_number);
    const Life life = live_and_die(folder, format, std::chrono::microseconds(random() % 1'800'000));
    const uint64_t written = life.told.empty() ? 0 : life.told.back().written;
    size_t found = 0;
    const Refusal refused = refusal([&] {
      Session session(folder);
      EXPECT_FALSE(session.complete());
      EXPECT_NE(session.warning().find("cut short"), std::string::npos);
      Frame frame;
      for (; session.next(frame); ++found) {
        // The last frame may be in the file though the child had no time to report it.
        ASSERT_TRUE(found >= life.told.size() || frame.sequence == life.told[found].sequence);
        ASSERT_TRUE(same_pixels(frame, pixels[frame.sequence % kPictures]));
      }
      EXPECT_EQ(*session.frame_count(), found);
      EXPECT_EQ(session.counts().damaged, 0u);
      const std::vector<uint64_t> measured = session.measured_sequences();
      EXPECT_LE(measured.size(), found);  // a row belongs to a frame that is there
      // A row follows its frame and its measurement, which the child gives after the frame.
      EXPECT_GE(measured.size() + 2, written);
      for (const uint64_t n : measured) {
        const std::string cells = *session.recorded(n);
        EXPECT_EQ(cells.substr(0, cells.find(',', 2)), "0," + std::to_string(n));
      }
    });
    if (refused.exit_code != 0) expect_one_line(refused, 3);  // no frame got out
    EXPECT_GE(found, written) << "kill " << kill_number << ": " << refused.line;
    if (found < life.told.size()) {
      const size_t lost = life.told.size() - found;
      const double waited_ms =
          1e-6 * static_cast<double>(life.told.back().asked_ns - life.told[found].taken_ns);
      // The writer takes the next frame while it encodes one, however long that takes.
      EXPECT_TRUE(lost <= 2 || waited_ms <= 1e3 * SessionOptions{}.most_behind_s)
          << "kill " << kill_number << ": " << lost << " frames of " << waited_ms << " ms";
      oldest_lost_ms =
          std::max(oldest_lost_ms, 1e-6 * static_cast<double>(life.killed_ns - life.told[found].taken_ns));
      most_lost = std::max(most_lost, lost);
      longest_ms = std::max(longest_ms, waited_ms);
    }
    recorded += life.told.size();
    if (!HasFailure()) fs::remove_all(folder);
  }
  std::printf(
      "%d kills, %zu frames recorded; at most %zu lost, which span %.1f ms; the oldest was taken %.1f "
      "ms before the kill\n",
      kills, recorded, most_lost, longest_ms, oldest_lost_ms);
}

int kills_wanted(int otherwise) {
  const char* wanted = std::getenv("PALPATE_KILLS");
  return wanted ? std::atoi(wanted) : otherwise;
}

TEST_F(SessionCrash, KilledAtRandomMomentsLosesOnlyWhatMayWait) {
  kill_recordings(kFormat, kills_wanted(16));
}

TEST_F(SessionCrash, KilledWhileTheEncoderIsTooSlowLosesOnlyWhatMayWait) {
  kill_recordings(kLargeFormat, kills_wanted(16) / 4);
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
  expect_full_disk_is_survived(folder_ / "s", "file too large");
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, handler);
}

TEST_F(SessionCrash, AFullDiskEndsTheRecordingOnly) {
  const fs::path disk = folder_ / "disk";
  fs::create_directories(disk);
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=1m") != 0)
    GTEST_SKIP() << "a small disk cannot be mounted here: " << std::strerror(errno);
  expect_full_disk_is_survived(disk / "s", "no space left");
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
