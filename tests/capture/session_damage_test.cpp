// Sessions cut short at any byte, with bytes changed, with files missing: whole frames are read correctly,
// and the damage is reported in one line.
#include <algorithm>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <optional>

#include "capture/video/session_video.h"
#include "tests/support/session_fixture.h"

namespace palpate {
namespace {

constexpr FrameFormat kSmall{12, 9, 1, 12};
constexpr uint64_t kFrames = 7;

/// The video of a few small frames, and where each frame ends in it.
struct Video {
  std::string bytes;
  std::vector<size_t> ends;  ///< [0]: of the head
};
Video small_video(const fs::path& file, uint64_t frames, bool finished) {
  Video video;
  {
    const SessionInfo info = plain_info(kSmall);
    const auto writer =
        SessionVideoWriter::create(file, kSmall, 60, to_text(info, {}, {"2026-01-01T00:00:00Z", {}}));
    video.ends.push_back(writer->bytes());
    for (uint64_t n = 0; n < frames; ++n) {
      writer->write(noise_frame(kSmall, n));
      video.ends.push_back(writer->bytes());
    }
    if (finished) writer->finish();
  }
  video.bytes = slurp(file);
  return video;
}

struct Found {
  std::vector<uint64_t> numbers;  ///< of the frames that came
  uint64_t damaged = 0;           ///< frames that were said to be
};
/// Reads all frames of `file`, which must be right and rise.
Found read_all(const fs::path& file) {
  Found found;
  std::vector<uint64_t>& numbers = found.numbers;
  const auto reader = SessionVideoReader::open(file);
  EXPECT_EQ(session_from_text(reader->session_text(), "text").info.format, kSmall);
  reader->expect(kSmall);
  FrameStamp stamp;
  Frame frame;
  for (auto step = reader->step(stamp); step != SessionVideoReader::Step::End; step = reader->step(stamp)) {
    if (step != SessionVideoReader::Step::Frame || !reader->decode(frame)) {
      ++found.damaged;
      continue;
    }
    expect_same(frame, noise_frame(kSmall, frame.sequence));
    EXPECT_TRUE(numbers.empty() || frame.sequence > numbers.back());
    numbers.push_back(frame.sequence);
  }
  return found;
}

/// Changes single bytes of a file on the disk.
class ByteChanger {
 public:
  ByteChanger(fs::path file, std::string bytes) : file_(std::move(file)), bytes_(std::move(bytes)) {
    spill(file_, bytes_);
  }
  template <typename Look>
  void with_changed(size_t at, Look&& look) {
    put(at, static_cast<char>(bytes_[at] ^ static_cast<char>(1 + random_() % 255)));
    look();
    put(at, bytes_[at]);
  }

 private:
  fs::path file_;
  std::string bytes_;
  std::mt19937 random_{5};

  void put(size_t at, char byte) {
    std::fstream file(file_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(at)).put(byte);
  }
};

class SessionDamage : public Sessions {};

TEST_F(SessionDamage, CutAtEveryByteGivesEveryWholeFrameBefore) {
  for (const bool finished : {false, true}) {
    const Video video = small_video(folder_ / (finished ? "whole.mkv" : "open.mkv"), kFrames, finished);
    EXPECT_TRUE(finished || video.ends.back() == video.bytes.size());
    const fs::path cut = folder_ / "cut.mkv";
    spill(cut, video.bytes);
    for (size_t length = video.bytes.size() + 1; length-- > 0;) {
      fs::resize_file(cut, length);
      Found read;
      const Refusal refused = refusal([&] { read = read_all(cut); });
      const std::vector<uint64_t>& found = read.numbers;
      EXPECT_EQ(read.damaged, 0u) << "cut at byte " << length;
      const auto whole = static_cast<size_t>(
          std::count_if(video.ends.begin() + 1, video.ends.end(), [&](size_t end) { return end <= length; }));
      ASSERT_EQ(found.size(), whole) << "cut at byte " << length << " of " << video.bytes.size() << ": "
                                     << refused.line;
      for (size_t n = 0; n < whole; ++n) ASSERT_EQ(found[n], n);
      if (whole > 0) {
        EXPECT_EQ(refused.exit_code, 0) << "cut at byte " << length << ": " << refused.line;
      } else if (refused.exit_code != 0) {
        expect_one_line(refused, 3);
      }
    }
  }
}

/// Which frame lies where byte `at` is; nothing: the head or what follows the frames.
std::optional<size_t> frame_at(const Video& video, size_t at) {
  const auto end = std::upper_bound(video.ends.begin(), video.ends.end(), at);
  if (end == video.ends.begin() || end == video.ends.end()) return std::nullopt;
  return static_cast<size_t>(end - video.ends.begin() - 1);
}

/// All frames came but the one that holds byte `at`; that one may be lost where it is said.
void expect_cost(const Found& found, uint64_t frames, std::optional<size_t> hit, size_t at) {
  ASSERT_EQ(found.numbers.size() + found.damaged, frames) << "byte " << at;
  for (size_t n = 0; n < frames; ++n)
    ASSERT_TRUE(n == hit || std::count(found.numbers.begin(), found.numbers.end(), n))
        << "byte " << at << " took " << n;
}

TEST_F(SessionDamage, AChangedByteCostsItsFrameOnly) {
  for (const bool finished : {true, false}) {
    const Video video = small_video(folder_ / (finished ? "whole.mkv" : "open.mkv"), kFrames, finished);
    const fs::path changed = folder_ / "changed.mkv";
    ByteChanger change(changed, video.bytes);
    size_t costly = 0;
    for (size_t at = 0; at < video.bytes.size(); ++at) {
      Found found;
      Refusal refused;
      change.with_changed(at, [&] { refused = refusal([&] { found = read_all(changed); }); });
      ASSERT_EQ(refused.exit_code, 0) << "byte " << at << ": " << refused.line;
      expect_cost(found, kFrames, frame_at(video, at), at);
      costly += found.damaged;
      ASSERT_FALSE(HasFailure());
    }
    EXPECT_GT(costly, (video.ends.back() - video.ends.front()) / 2);  // most bytes of a frame matter
  }
}

// Lengths and places before the frames depend on the text's length.
TEST_F(SessionDamage, TheTextMayHaveAnyLength) {
  SessionInfo info = plain_info(kSmall);
  for (size_t more = 0; more < 300; more += 7) {
    info.device = std::string(more, 'd');
    const fs::path file = folder_ / (std::to_string(more) + ".mkv");
    Video video;
    {
      const auto writer = SessionVideoWriter::create(file, kSmall, 60, to_text(info, {}, {"2026", {}}));
      for (uint64_t n = 0; n <= 3; ++n) {
        video.ends.push_back(writer->bytes());
        if (n < 3) writer->write(noise_frame(kSmall, n));
      }
      writer->finish();
    }
    video.bytes = slurp(file);
    ByteChanger change(file, video.bytes);
    constexpr size_t kHeaders = 40;  // of cluster, group and block
    for (size_t at = video.ends[1]; at < video.ends[1] + kHeaders; ++at) {
      Found found;
      change.with_changed(at, [&] { found = read_all(file); });
      expect_cost(found, 3, 1, at);
      ASSERT_FALSE(HasFailure()) << more << " more characters";
    }
  }
}

TEST_F(SessionDamage, ABlockOfZerosCostsTheFramesThatItLiesOn) {
  const Video video = small_video(folder_ / "whole.mkv", kFrames, true);
  const fs::path changed = folder_ / "changed.mkv";
  constexpr size_t kBlock = 512;
  for (size_t begin = video.ends[0]; begin < video.bytes.size(); begin += 101) {
    std::string bytes = video.bytes;
    const size_t end = std::min(bytes.size(), begin + kBlock);
    std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(begin),
              bytes.begin() + static_cast<std::ptrdiff_t>(end), '\0');
    spill(changed, bytes);
    const Refusal refused = refusal([&] {
      const Found found = read_all(changed);
      for (size_t n = 0; n < kFrames; ++n) {
        const bool hit = video.ends[n] < end && video.ends[n + 1] > begin;
        EXPECT_TRUE(hit || std::count(found.numbers.begin(), found.numbers.end(), n))
            << begin << " took " << n;
      }
      // Nothing may be left of a last frame.
      const bool noticed = found.damaged > 0 || video.ends[kFrames] <= end;
      EXPECT_TRUE(found.numbers.size() == kFrames || noticed) << begin;
    });
    EXPECT_EQ(refused.exit_code, 0) << begin << ": " << refused.line;
    ASSERT_FALSE(HasFailure());
  }
}

/// A session of kFrames measured frames with everything in it.
fs::path whole_session(const fs::path& folder) {
  SessionInfo info = plain_info(kSmall);
  info.background = noise_frame(kSmall, 50);
  info.outputs = Output::Force;
  Sensor sensor;
  sensor.name = "small";
  sensor.pitch_mm_per_px = 0.1;
  sensor.bit_depth = kSmall.bit_depth;
  sensor.saturation_gray = kSmall.max_gray();
  info.sensor = sensor;
  info.details = {{"driver", "none"}};
  SessionWriter writer(folder, info, {.no_drop = true});
  for (uint64_t n = 0; n < kFrames; ++n) {
    EXPECT_TRUE(writer.record(noise_frame(kSmall, n)));
    Touch touch;
    touch.sequence = n;
    touch.gray_sum = static_cast<double>(n) / 3;
    writer.measured(touch);
  }
  EXPECT_EQ(writer.close().error, "");
  return folder;
}

/// Reads everything there is; what comes must be right. The number of frames.
uint64_t read_everything(const fs::path& folder) {
  Session session(folder);
  Frame frame;
  uint64_t count = 0, last = 0;
  while (session.next(frame)) {
    expect_same(frame, noise_frame(kSmall, frame.sequence));
    EXPECT_TRUE(count == 0 || frame.sequence > last);
    last = frame.sequence;
    ++count;
  }
  EXPECT_LE(count, *session.frame_count());
  session.warning();
  for (const uint64_t n : session.measured_sequences()) EXPECT_TRUE(session.recorded(n));
  session.own_background();
  if (session.seek(count / 2)) session.next(frame);
  return count;
}

/// What a session of kFrames frames says with a byte changed, and how many frames it gives.
void expect_said(const fs::path& folder, size_t at) {
  Session session(folder);
  Frame frame;
  uint64_t count = 0;
  for (; session.next(frame); ++count)
    EXPECT_EQ(session.place(), session.complete() ? frame.sequence : count) << at;
  const bool said = session.warning().find("1 damaged frame is left out") != std::string::npos;
  EXPECT_EQ(said, count < kFrames) << at << ": " << session.warning();
  EXPECT_GE(count + 1, kFrames) << at;
  EXPECT_EQ(session.counts().damaged, kFrames - count) << at;
  EXPECT_EQ(session.complete(), *session.frame_count() == kFrames) << at;
  for (uint64_t n = 0; n < *session.frame_count(); ++n) EXPECT_TRUE(session.seek(n)) << at;
}

TEST_F(SessionDamage, ASessionSaysWhatAChangedByteCosts) {
  const fs::path session = whole_session(folder_ / "s");
  const std::string bytes = slurp(session / kSessionFrames);
  ByteChanger change(session / kSessionFrames, bytes);
  for (const bool with_text : {true, false}) {
    if (!with_text) fs::remove(session / kSessionJson);
    for (size_t at = 0; at < bytes.size(); at += 7)
      change.with_changed(at, [&] {
        if (with_text)
          expect_said(session, at);
        else
          EXPECT_GE(read_everything(session) + 1, kFrames) << at;
      });
  }
}

// Recordings of before the head was kept twice.
TEST_F(SessionDamage, AnOldSessionLosesNoMore) {
  const fs::path old = fs::path(PALPATE_SOURCE_DIR) / "tests" / "data" / "session_v1",
                 session = folder_ / "s";
  fs::copy(old, session);
  const std::string bytes = slurp(session / kSessionFrames);
  Session whole(old);
  const uint64_t frames = *whole.frame_count();
  std::vector<Frame> wanted(frames);
  for (Frame& frame : wanted) ASSERT_TRUE(whole.next(frame));
  ByteChanger change(session / kSessionFrames, bytes);
  for (size_t at = 0; at < bytes.size(); ++at)
    change.with_changed(at, [&] {
      Session read(session);
      Frame frame;
      uint64_t count = 0;
      for (; read.next(frame); ++count) {
        const auto same = std::find_if(wanted.begin(), wanted.end(),
                                       [&](const Frame& one) { return one.sequence == frame.sequence; });
        ASSERT_NE(same, wanted.end());
        expect_same(frame, *same);
      }
      EXPECT_GE(count + 1, frames) << at;
      EXPECT_EQ(read.counts().damaged, frames - count) << at;
    });
}

TEST_F(SessionDamage, SessionsCutShortSayHowMuchThereIs) {
  const fs::path session = whole_session(folder_ / "s");
  EXPECT_EQ(read_everything(session), kFrames);
  const uintmax_t size = fs::file_size(session / kSessionFrames);
  fs::resize_file(session / kSessionFrames, size * 2 / 3);
  const uint64_t left = read_everything(session);
  EXPECT_TRUE(left > 1 && left < kFrames) << left;
  Session cut(session);
  EXPECT_FALSE(cut.complete());
  EXPECT_EQ(cut.frame_count(), left);
  EXPECT_NE(cut.warning().find(std::to_string(left) + " of 7 recorded frames can be read"), std::string::npos)
      << cut.warning();
  EXPECT_EQ(cut.measured_sequences().size(), kFrames);  // the rows are whole
}

TEST_F(SessionDamage, RowsCutAtEveryByteGiveEveryWholeRow) {
  const fs::path session = whole_session(folder_ / "s");
  const std::string rows = slurp(session / kSessionRows);
  for (size_t length = rows.size(); length-- > 0;) {
    fs::resize_file(session / kSessionRows, length);
    const auto lines = std::count(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(length), '\n');
    Session cut(session);
    ASSERT_EQ(cut.measured_sequences().size(), static_cast<size_t>(std::max<std::ptrdiff_t>(0, lines - 1)))
        << length;
    ASSERT_EQ(cut.frame_count(), kFrames);
  }
  fs::remove(session / kSessionRows);
  EXPECT_EQ(read_everything(session), kFrames);
}

TEST_F(SessionDamage, WhatAPowerCutLeavesBehindTheLastFrameDoesNotMatter) {
  const std::string zeros(50'000, '\0');
  std::string noise(50'000, ' ');
  std::mt19937 random(8);
  for (char& byte : noise) byte = static_cast<char>(random());
  for (const std::string& tail : {zeros, noise, std::string(3, '\0')}) {
    const fs::path session = whole_session(folder_ / std::to_string(random()));
    for (const char* name : {kSessionFrames, kSessionRows})
      std::ofstream(session / name, std::ios::binary | std::ios::app) << tail;
    EXPECT_EQ(read_everything(session), kFrames);
    Session read(session);
    EXPECT_FALSE(read.complete());
    EXPECT_EQ(read.measured_sequences().size(), kFrames);
  }
}

TEST_F(SessionDamage, NonsenseIsRefusedInOneLine) {
  const fs::path good = whole_session(folder_ / "good");
  const std::string json = slurp(good / kSessionJson);
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = json;
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  int cases = 0;
  const auto refuse = [&](const std::string& text, const std::string& word, int exit_code = 3) {
    const fs::path bad = folder_ / ("bad" + std::to_string(cases++));
    fs::copy(good, bad);
    spill(bad / kSessionJson, text);
    const Refusal refused = refusal([&] { Session session(bad); });
    expect_one_line(refused, exit_code);
    EXPECT_NE(refused.line.find(word), std::string::npos) << refused.line;
  };
  refuse("", "valid JSON");
  refuse(json.substr(0, json.size() / 2), "frames.mkv holds a copy");
  refuse("[]", "object");
  refuse("17", "object");
  refuse("{}", "palpate_session");
  refuse(std::string(2'000'000, '['), "lists in lists");
  refuse(changed("\"palpate_session\": 1", "\"palpate_session\": 2"), "a newer palpate");
  refuse(changed("\"palpate_session\": 1", "\"palpate_session\": \"1\""), "palpate_session");
  refuse(changed("\"width\": 12", "\"width\": 0"), "width");
  refuse(changed("\"width\": 12", "\"width\": 13"), "frames.mkv");
  refuse(changed("\"width\": 12", "\"width\": 1e9"), "width");
  refuse(changed("\"channels\": 1", "\"channels\": 2"), "channels");
  refuse(changed("\"bit_depth\": 12", "\"bit_depth\": -12"), "bit_depth");
  refuse(changed("\"rate_Hz\": 60.0", "\"rate_Hz\": null"), "rate_Hz");
  refuse(changed("\"outputs\": [", "\"outputs\": [1,"), "outputs");
  refuse(changed("\"force\"", "\"farce\""), "one of force, surface, confidence");
  refuse(changed("\"solver\": \"live\"", "\"solver\": \"slow\""), "solver");
  refuse(changed("\"details\": [", "\"details\": [[\"a\"],"), "details");
  refuse(changed("\"pitch_mm_per_px\": 0.1", "\"pitch_mm_per_px\": -1"), "pitch_mm_per_px", 4);
  refuse(changed("\"complete\": true", "\"complete\": 3"), "complete");
  refuse(changed("\"frames\": 7", "\"frames\": -7"), "frames");
  refuse(changed("background.png", "../background.png"), "background");
  // Additions of later programs are ignored.
  const fs::path more = folder_ / "more";
  fs::copy(good, more);
  spill(more / kSessionJson, changed("\"complete\": true", "\"weather\": {\"rain\": 1}, \"complete\": true"));
  EXPECT_EQ(read_everything(more), kFrames);
}

TEST_F(SessionDamage, MissingAndExchangedFilesAreRefusedInOneLine) {
  const fs::path good = whole_session(folder_ / "good");
  const auto refuse = [&](const char* name, auto&& harm, const std::string& word) {
    const fs::path bad = folder_ / "bad";
    fs::remove_all(bad);
    fs::copy(good, bad);
    harm(bad / name);
    const Refusal refused = refusal([&] { read_everything(bad); });
    expect_one_line(refused, 3);
    EXPECT_NE(refused.line.find(word), std::string::npos) << refused.line;
  };
  const auto remove = [](const fs::path& file) { fs::remove(file); };
  const auto empty = [](const fs::path& file) { spill(file, ""); };
  const auto folder = [](const fs::path& file) {
    fs::remove(file);
    fs::create_directory(file);
  };
  const auto text = [](const fs::path& file) { spill(file, "this is no such file\nat all\n"); };
  refuse(kSessionFrames, remove, "frames.mkv");
  refuse(kSessionFrames, empty, "frames.mkv");
  refuse(kSessionFrames, folder, "frames.mkv");
  refuse(kSessionFrames, text, "frames.mkv");
  refuse(kSessionJson, empty, "session.json");
  refuse(kSessionJson, folder, "session.json");
  refuse(kSessionJson, text, "session.json");
  refuse(kSessionRows, folder, "frames.csv");
  refuse(kSessionRows, text, "frames.csv");
  refuse(kSessionBackground, remove, "background.png");
  refuse(kSessionBackground, empty, "background.png");
  refuse(kSessionBackground, folder, "background.png");
  refuse(kSessionBackground, text, "background.png");
  expect_one_line(refusal([&] { Session session(folder_ / "none"); }), 3);
  fs::remove(good / kSessionJson);
  fs::remove(good / kSessionRows);
  EXPECT_EQ(read_everything(good), kFrames);  // the video is enough
}

TEST_F(SessionDamage, AVideoOfAnotherIsNoSession) {
  const fs::path folder = folder_ / "other";
  fs::create_directories(folder);
  cv::VideoWriter video((folder / kSessionFrames).string(), cv::CAP_FFMPEG,
                        cv::VideoWriter::fourcc('F', 'F', 'V', '1'), 30, {64, 48});
  ASSERT_TRUE(video.isOpened());
  for (int i = 0; i < 3; ++i) video.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar(i, 2, 3)));
  video.release();
  EXPECT_FALSE(is_session(folder / kSessionFrames));
  expect_one_line(refusal([&] { Session session(folder); }), 3);
}

TEST_F(SessionDamage, RandomHarmNeverGivesWrongPixelsNorAHang) {
  const fs::path good = whole_session(folder_ / "good");
  const fs::path bad = folder_ / "bad";
  fs::copy(good, bad);
  std::mt19937 random(11);
  const auto below = [&](size_t end) { return std::uniform_int_distribution<size_t>(0, end - 1)(random); };
  for (const char* name : {kSessionFrames, kSessionJson, kSessionRows}) {
    const std::string whole = slurp(good / name);
    for (int round = 0; round < 300; ++round) {
      std::string text = whole;
      for (size_t i = 0, changes = 1 + below(8); i < changes; ++i) {
        const size_t at = below(text.size()), length = std::min(text.size() - at, 1 + below(64));
        switch (below(5)) {
          case 0:
            text[at] = static_cast<char>(random());
            break;
          case 1:
            text.erase(at, length);
            break;
          case 2:
            text.insert(at, text.substr(below(text.size()), length));
            break;
          case 3:
            text.replace(at, length, std::string(length, static_cast<char>(random() % 2 ? 0 : 0xff)));
            break;
          default:
            if (i == 0) text.resize(at);
        }
        if (text.empty()) text = "x";
      }
      spill(bad / name, text);
      const Refusal refused = refusal([&] { read_everything(bad); });
      if (refused.exit_code != 0) {
        expect_one_line(refused, refused.exit_code == 4 ? 4 : 3);  // 4: the sensor's part of session.json
      }
      ASSERT_FALSE(HasFailure()) << name << " round " << round;
    }
    spill(bad / name, whole);
  }
}
}  // namespace
}  // namespace palpate
