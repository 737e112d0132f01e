// Folders and frames for the tests of recorded sessions.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <string>

#include "capture/session/info.h"
#include "capture/session/session.h"
#include "palpate/error.h"
#include "tests/support/test_folder.h"
#include "tests/support/text_file.h"

namespace palpate {

namespace fs = std::filesystem;

/// A frame of noise that uses every bit; the same for the same format and number.
inline Frame noise_frame(const FrameFormat& format, uint64_t sequence, int64_t interval_ns = 16'666'667) {
  Frame frame;
  frame.reshape(format);
  std::mt19937 random(static_cast<uint32_t>(sequence * 7919 + format.width));
  for (uint32_t c = 0; c < format.channels; ++c)
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x)
        frame.set(c, x, y, static_cast<uint32_t>(random()) & format.max_gray());
  frame.sequence = sequence;
  frame.time_ns = static_cast<int64_t>(sequence) * interval_ns;
  frame.exposed_ns = 1'000'000'000'000 + frame.time_ns;
  frame.delivered_ns = frame.exposed_ns + 3'000'001;
  frame.after_gap = sequence % 7 == 3;
  return frame;
}

inline bool same_pixels(const Frame& a, const Frame& b) {
  return a.format == b.format && std::equal(a.pixels(), a.pixels() + a.format.frame_bytes(), b.pixels());
}

/// Sameness to the last bit, of pixels and of what goes with them.
inline void expect_same(const Frame& found, const Frame& wanted) {
  EXPECT_TRUE(same_pixels(found, wanted)) << "frame " << wanted.sequence;
  EXPECT_EQ(found.sequence, wanted.sequence);
  EXPECT_EQ(found.time_ns, wanted.time_ns);
  EXPECT_EQ(found.exposed_ns, wanted.exposed_ns);
  EXPECT_EQ(found.delivered_ns, wanted.delivered_ns);
  EXPECT_EQ(found.after_gap, wanted.after_gap);
}

inline SessionInfo plain_info(const FrameFormat& format) {
  SessionInfo info;
  info.input = "test";
  info.format = format;
  info.rate_Hz = 60;
  info.program_version = "0.1.0";
  info.device = "none";
  return info;
}

/// A folder of its own for each test.
class Sessions : public testing::Test {
 protected:
  void SetUp() override { folder_ = test_folder("session"); }
  void TearDown() override {
    if (!HasFailure()) fs::remove_all(folder_);
  }

  /// Records `frames` frames of noise into folder_/name.
  fs::path record(const std::string& name, const SessionInfo& info, uint64_t frames) {
    fs::path to = folder_ / name;
    SessionWriter writer(to, info, {.no_drop = true});
    for (uint64_t n = 0; n < frames; ++n) EXPECT_TRUE(writer.record(noise_frame(info.format, n)));
    const SessionStatus status = writer.close();
    EXPECT_EQ(status.error, "");
    EXPECT_EQ(status.written, frames);
    return to;
  }

  fs::path folder_;
};

/// The one line that `action` refuses with, and its exit code.
struct Refusal {
  int exit_code = 0;
  std::string line;
};
template <typename Action>
Refusal refusal(Action&& action) {
  try {
    action();
  } catch (const Error& e) {
    return {e.exit_code(), e.what()};
  }
  return {};
}

inline void expect_one_line(const Refusal& refused, int exit_code) {
  EXPECT_EQ(refused.exit_code, exit_code) << refused.line;
  EXPECT_EQ(refused.line.find('\n'), std::string::npos) << refused.line;
  EXPECT_LT(refused.line.size(), 600u) << refused.line;
}

}  // namespace palpate
