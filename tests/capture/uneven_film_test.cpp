// Films as telephones, browsers and cutters make them: frames at uneven times, damaged packets, ends cut
// away.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "capture/open_source.h"
#include "capture/source.h"
#include "capture/video/frame_numbers.h"
#include "tests/support/film.h"
#include "tests/support/test_folder.h"

namespace palpate {
namespace {

class UnevenFilm : public ::testing::Test {
 protected:
  ~UnevenFilm() override { std::filesystem::remove_all(folder_); }

  /// Pauses of a telephone in the dark and of a browser: a multiple of 40 ms each.
  static std::vector<int64_t> uneven(size_t frames) {
    std::vector<int64_t> times_ms;
    int64_t now = 0;
    for (size_t i = 0; i < frames; ++i) {
      times_ms.push_back(now);
      now += i % 7 == 3 ? 240 : i % 11 == 5 ? 1000 : i % 3 == 1 ? 80 : 40;
    }
    return times_ms;
  }
  static std::vector<int64_t> even(size_t frames) {
    std::vector<int64_t> times_ms;
    for (size_t i = 0; i < frames; ++i) times_ms.push_back(40 * static_cast<int64_t>(i));
    return times_ms;
  }
  std::filesystem::path file(const std::string& name) const { return folder_ / name; }
  std::unique_ptr<Source> open(const std::filesystem::path& film) const {
    Sensor sensor;
    sensor.pitch_mm_per_px = 0.1;
    return open_source(film.string(), sensor);
  }
  static uint32_t shown(const Frame& frame) {
    return frame_shown(frame.format.width, frame.format.height,
                       [&](uint32_t x, uint32_t y) { return double(frame.at(0, x, y)); });
  }
  /// Every frame is there, with its number and its time less the first's, also after a jump.
  void expect_times(const std::string& name, const std::vector<int64_t>& times_ms) {
    SCOPED_TRACE(name);
    const auto source = open(file(name));
    EXPECT_EQ(source->frame_count(), times_ms.size());
    Frame frame;
    for (size_t i = 0; i < times_ms.size(); ++i) {
      ASSERT_TRUE(source->next(frame)) << i;
      EXPECT_EQ(frame.sequence, i);
      EXPECT_EQ(shown(frame), i);
      EXPECT_NEAR(static_cast<double>(frame.time_ns) * 1e-6, static_cast<double>(times_ms[i] - times_ms[0]),
                  1)
          << i;
    }
    EXPECT_FALSE(source->next(frame));
    EXPECT_EQ(source->warning(), "");
    EXPECT_FALSE(source->cut_short());
    EXPECT_EQ(source->counts().damaged, 0u);
    for (const size_t i : {times_ms.size() / 2, size_t{1}, times_ms.size() - 1}) {
      ASSERT_TRUE(source->seek(i));
      ASSERT_TRUE(source->next(frame));
      EXPECT_EQ(frame.sequence, i);
      EXPECT_NEAR(static_cast<double>(frame.time_ns) * 1e-6, static_cast<double>(times_ms[i] - times_ms[0]),
                  1);
    }
  }

  std::filesystem::path folder_ = test_folder("uneven");
};

TEST_F(UnevenFilm, TimesAreTheFilmsOwnInEveryContainer) {
  const std::vector<int64_t> times_ms = uneven(40);
  const struct {
    const char* name;
    FilmSetting setting;
  } films[] = {{"b_frames.mp4", {.codec = "mpeg4", .b_frames = 2}},
               {"fragments.mp4", {.codec = "mpeg4", .b_frames = 2, .movflags = "frag_keyframe+empty_moov"}},
               {"jpeg.mov", {.codec = "mjpeg"}},
               {"jpeg.mkv", {.codec = "mjpeg"}},
               {"b_frames.mkv", {.codec = "mpeg4", .b_frames = 2}},
               {"browser.webm", {.codec = "libvpx"}},
               {"places.avi", {.codec = "mjpeg", .time_base_per_s = 25}},
               {"stream.ts", {.codec = "mpeg2video", .time_base_per_s = 25, .b_frames = 2}},
               {"moving.gif", {.codec = "gif", .time_base_per_s = 100}}};
  for (const auto& [name, known] : films) {
    FilmSetting setting = known;
    setting.times_ms = times_ms;
    write_film(file(name), setting);
    expect_times(name, times_ms);
  }
}

TEST_F(UnevenFilm, AFilmThatStartsLateBeginsAtZero) {
  std::vector<int64_t> late_ms = uneven(20);
  for (int64_t& time_ms : late_ms) time_ms += 582'000;
  write_film(file("late.mkv"), {.codec = "mpeg4", .times_ms = late_ms, .b_frames = 2});
  expect_times("late.mkv", late_ms);
}

TEST_F(UnevenFilm, ItsTimesAreKnownBeforehandOnlyWhereTheyAreUneven) {
  const std::vector<int64_t> times_ms = uneven(20);
  write_film(file("uneven.mkv"), {.codec = "mjpeg", .times_ms = times_ms});
  const auto source = open(file("uneven.mkv"));
  const std::vector<double> times_s = source->uneven_times_s();
  ASSERT_EQ(times_s.size(), times_ms.size());
  for (size_t i = 0; i < times_s.size(); ++i) EXPECT_NEAR(times_s[i], 1e-3 * double(times_ms[i]), 1e-3);
  const double mean_Hz = 19e3 / double(times_ms.back());
  EXPECT_NEAR(source->rate_Hz(), mean_Hz, 0.01 * mean_Hz);
  write_film(file("even.mkv"), {.codec = "mjpeg", .times_ms = even(20)});
  EXPECT_TRUE(open(file("even.mkv"))->uneven_times_s().empty());
}

/// From 40 % of packet 12 on, nothing but zeros.
void erase_packet_12(size_t index, std::span<uint8_t> bytes) {
  if (index == 12)
    std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() * 4 / 10), bytes.end(), 0);
}

TEST_F(UnevenFilm, ADamagedPictureIsLeftOutAndCounted) {
  for (const char* name : {"bad.avi", "bad.mov", "bad.mkv"}) {
    SCOPED_TRACE(name);
    write_film(file(name),
               {.codec = "mjpeg", .times_ms = even(30), .time_base_per_s = 25, .damage = erase_packet_12});
    const auto source = open(file(name));
    Frame frame;
    for (uint64_t i = 0; i < 30; ++i) {
      if (i == 12) continue;
      ASSERT_TRUE(source->next(frame)) << i;
      EXPECT_EQ(frame.sequence, i);
      EXPECT_EQ(source->place(), i);
      EXPECT_EQ(shown(frame), i);
      EXPECT_NEAR(double(frame.time_ns), 40e6 * double(i), 1e6);
      EXPECT_FALSE(frame.after_gap);  // one missing frame is no gap
    }
    EXPECT_FALSE(source->next(frame));
    EXPECT_EQ(source->counts().damaged, 1u);
    EXPECT_FALSE(source->cut_short());
    EXPECT_NE(source->warning().find("1 frame does not decode whole"), std::string::npos)
        << source->warning();
    // A jump to it ends at the next one.
    ASSERT_TRUE(source->seek(12));
    ASSERT_TRUE(source->next(frame));
    EXPECT_EQ(frame.sequence, 13u);
    EXPECT_EQ(source->place(), 13u);
    EXPECT_EQ(shown(frame), 13u);
  }
}

TEST_F(UnevenFilm, WhatRefersToADamagedPictureIsLeftOutUntilTheNextKeyPicture) {
  for (const int b_frames : {0, 2}) {
    uint64_t most_left_out = 0;
    for (const size_t bad : {12u, 13u, 14u}) {
      SCOPED_TRACE(std::to_string(b_frames) + " between, packet " + std::to_string(bad));
      const auto erase = [bad](size_t index, std::span<uint8_t> bytes) {
        if (index == bad) erase_packet_12(12, bytes);
      };
      write_film(file("bad.mp4"),
                 {.codec = "mpeg4", .times_ms = even(40), .gop = 10, .b_frames = b_frames, .damage = erase});
      const auto source = open(file("bad.mp4"));
      Frame frame;
      std::vector<uint64_t> numbers;
      while (source->next(frame)) {
        EXPECT_EQ(shown(frame), frame.sequence);
        EXPECT_NEAR(double(frame.time_ns), 40e6 * double(frame.sequence), 1e6);
        if (!numbers.empty()) {
          EXPECT_EQ(frame.after_gap, frame.sequence > numbers.back() + 4);
        }
        numbers.push_back(frame.sequence);
      }
      const uint64_t left_out = 40 - numbers.size();
      EXPECT_EQ(source->counts().damaged, left_out);
      EXPECT_GE(left_out, b_frames == 0 ? 20 - bad : 1u);
      EXPECT_LE(left_out, 12u);
      EXPECT_EQ(numbers.front(), 0u);
      EXPECT_EQ(numbers.back(), 39u);
      EXPECT_FALSE(source->cut_short());
      most_left_out = std::max(most_left_out, left_out);
    }
    EXPECT_GE(most_left_out, 5u);  // of a picture that others refer to
  }
}

TEST_F(UnevenFilm, AWholeFilmThatWasCutWithoutCodingItAgainIsWhole) {
  write_film(file("whole.mp4"), {.codec = "mpeg4", .times_ms = even(50), .gop = 12, .b_frames = 2});
  cut_film(file("whole.mp4"), file("cut.mp4"), 800);  // frame 20; the key frame before is number 12
  const auto source = open(file("cut.mp4"));
  EXPECT_EQ(source->frame_count(), 30u);
  Frame frame;
  for (uint64_t i = 0; i < 30; ++i) {
    ASSERT_TRUE(source->next(frame)) << i;
    EXPECT_EQ(frame.sequence, i);
    EXPECT_EQ(shown(frame), i + 20);
    EXPECT_NEAR(double(frame.time_ns), 40e6 * double(i), 1e6);
  }
  EXPECT_FALSE(source->next(frame));
  EXPECT_FALSE(source->cut_short());
  EXPECT_EQ(source->warning(), "");
  EXPECT_EQ(source->counts().damaged, 0u);
}

TEST(FrameNumbersTest, PicturesBeforeTheFirstKeyPictureHaveNoNumber) {
  FrameNumbers numbers(false, 1000);
  numbers.sent({.tick = 60, .key = true});
  numbers.sent({.tick = 20});  // refer to what was cut away
  numbers.sent({.tick = 40});
  numbers.sent({.tick = 80});
  numbers.shown(60, true, false);
  numbers.shown(80, false, false);
  const FrameNumbers::Numbered first = numbers.take(), second = numbers.take();
  EXPECT_EQ(first.index, 0u);
  EXPECT_EQ(first.tick, 0);
  EXPECT_FALSE(first.doubtful);
  EXPECT_EQ(second.index, 1u);
  EXPECT_EQ(second.tick, 20);
  EXPECT_FALSE(second.doubtful);
  EXPECT_EQ(numbers.left_out(), 0u);
}

/// Coded I0 P3 B1 B2 I6 B4 B5 P7; P3 is bad: all that is shown before I6 is, and what comes after is not.
TEST(FrameNumbersTest, AFaultIsKnownBeforeAPictureThatRefersToItIsTaken) {
  FrameNumbers numbers(false, 1000);
  int64_t order[] = {0, 3, 1, 2, 6, 4, 5, 7};
  for (const int64_t tick : order) numbers.sent({.tick = tick, .key = tick % 6 == 0});
  std::vector<uint64_t> good;
  const auto take = [&] {
    while (numbers.ready()) {
      const FrameNumbers::Numbered one = numbers.take();
      EXPECT_EQ(one.index, static_cast<uint64_t>(*one.tick));
      if (!one.doubtful) good.push_back(one.index);
    }
  };
  for (int64_t tick = 0; tick < 8; ++tick) {
    numbers.shown(tick, tick % 6 == 0, tick == 3);
    take();
  }
  EXPECT_EQ(good, (std::vector<uint64_t>{0, 6, 7}));
  EXPECT_EQ(numbers.left_out(), 5u);
}

TEST(RisingTimesTest, StampsThatDoNotRiseArePlacedAndCounted) {
  RisingTimes twice({.tick_s = 1e-3, .period_s = 0.04});
  std::vector<int64_t> ms;
  uint64_t index = 0;
  for (const int64_t tick : {0, 40, 40, 120, 160}) ms.push_back(twice.next_ns(tick, index++) / 1'000'000);
  EXPECT_EQ(ms, (std::vector<int64_t>{0, 40, 80, 120, 160}));
  EXPECT_EQ(twice.placed(), 1u);
  // A second film joined to the first one begins at 0 again.
  RisingTimes joined({.tick_s = 1e-3, .period_s = 0.04});
  ms.clear();
  index = 0;
  for (const int64_t tick : {0, 2000, 4000, 0, 500, 900})
    ms.push_back(joined.next_ns(tick, index++) / 1'000'000);
  EXPECT_EQ(ms, (std::vector<int64_t>{0, 2000, 4000, 4040, 4540, 4940}));
  EXPECT_EQ(joined.placed(), 1u);
}

}  // namespace
}  // namespace palpate
