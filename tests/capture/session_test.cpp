// Sessions written and read back: to the last bit, with all that goes with the frames.
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>

#include "capture/files/measurements.h"
#include "capture/open_source.h"
#include "tests/support/session_fixture.h"

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

constexpr FrameFormat kGray{40, 30, 1, 8};

Sensor some_sensor(const FrameFormat& format) {
  Sensor sensor;
  sensor.name = "pad \"7\", ünïcode";
  sensor.pitch_mm_per_px = 0.0435;
  sensor.channels = format.channels;
  sensor.bit_depth = format.bit_depth;
  sensor.size_px = {format.width, format.height};
  sensor.crop_px = {{100, 50, 200, 160}};
  sensor.quad_px = {{{1, 2}, {190, 3}, {188, 150}, {2, 149}}};
  sensor.threshold_gray = 3.25;
  sensor.saturation_gray = format.max_gray();
  sensor.force = ForceCalibration{.c1_N_per_gray = 1e-6 / 3, .gray_max = 1e6};
  return sensor;
}

Touch some_touch(uint64_t sequence) {
  Touch touch;
  touch.sequence = sequence;
  touch.time_ns = static_cast<int64_t>(sequence) * 16'666'667;
  touch.contact = true;
  touch.gray_sum = 1e5 / 3 + static_cast<double>(sequence);
  touch.centroid_x_px = 1.0 / 3;
  touch.force_N = {0.1 + static_cast<double>(sequence) / 7, 1e-3 / 3, Validity::Valid};
  return touch;
}

using SessionTest = Sessions;

TEST_F(SessionTest, KeepsSensorSettingsAndDetails) {
  SessionInfo info = plain_info(kGray);
  info.input = "camera:/dev/video0?format=GREY";
  info.sensor = some_sensor(kGray);
  info.sensor->background.image = "/nowhere/untouched.png";
  info.background = noise_frame(kGray, 5);
  info.outputs = Output::Force | Output::Confidence;
  info.solver = SurfaceSolver::Best;
  info.solve_by = SolveBy::Host;
  info.device = "llvmpipe";
  info.details = {{"driver", "vivid"}, {"exposure", "8 ms"}, {"a", "1"}};
  const fs::path folder = record("s", info, 2);
  Session read(folder, *Session(folder).info().sensor);
  const SessionInfo& found = read.info();
  EXPECT_EQ(found.input, info.input);
  EXPECT_EQ(found.rate_Hz, 60);
  EXPECT_EQ(found.outputs, info.outputs);
  EXPECT_EQ(found.solver, info.solver);
  EXPECT_EQ(found.solve_by, info.solve_by);
  EXPECT_EQ(found.program_version, "0.1.0");
  EXPECT_EQ(found.device, "llvmpipe");
  EXPECT_EQ(found.details, info.details);
  EXPECT_EQ(read.details(), info.details);
  ASSERT_TRUE(found.sensor);
  Sensor wanted = *info.sensor;
  wanted.background.image.clear();  // the session holds it
  EXPECT_EQ(sensor_text(*found.sensor), sensor_text(wanted));
  EXPECT_EQ(read.rate_Hz(), 60);
  // The same without session.json: the video's copy.
  fs::remove(folder / kSessionJson);
  Session copy(folder);
  EXPECT_EQ(sensor_text(*copy.info().sensor), sensor_text(wanted));
  EXPECT_NE(copy.warning().find("session.json is missing"), std::string::npos);
  EXPECT_EQ(copy.frame_count(), 2u);
  EXPECT_TRUE(same_pixels(*copy.own_background(), *info.background));
}

TEST_F(SessionTest, OneRowAFrameInOrderWithWhatWasMeasured) {
  SessionInfo info = plain_info(kGray);
  info.outputs = Output::Force;
  {
    SessionWriter writer(folder_ / "s", info, {.no_drop = true});
    for (const uint64_t n : {0, 1, 2, 4, 5, 6}) {
      ASSERT_TRUE(writer.record(noise_frame(kGray, n)));
      if (n != 1 && n != 6) writer.measured(some_touch(n), n == 4 ? 4400 : 0);
      if (n == 2) writer.measured(some_touch(3));  // measured but not recorded
    }
    const SessionStatus status = writer.close();
    EXPECT_EQ(status.recorded, 6u);
    EXPECT_EQ(status.written, 6u);
    EXPECT_EQ(status.measured, 4u);
    EXPECT_EQ(status.unmatched, 1u);
    EXPECT_EQ(status.dropped, 0u);
    EXPECT_EQ(status.queued, 0u);
    EXPECT_EQ(status.written_bytes, fs::file_size(folder_ / "s" / kSessionFrames));
  }
  std::istringstream lines(slurp(folder_ / "s" / kSessionRows));
  std::string line;
  ASSERT_TRUE(std::getline(lines, line));
  EXPECT_EQ(
      line,
      "frame,driver_time_ns,host_time_ns,host_delivered_ns,host_measured_ns,time_s,after_gap,measured," +
          Measurements::cell_names());
  const auto columns = std::count(line.begin(), line.end(), ',');
  for (const uint64_t n : {0, 1, 2, 4, 5, 6}) {
    ASSERT_TRUE(std::getline(lines, line));
    const Frame frame = noise_frame(kGray, n);
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), columns);
    const bool measured = n != 1 && n != 6;
    const std::string start =
        std::to_string(n) + ',' + std::to_string(frame.time_ns) + ',' + std::to_string(frame.exposed_ns) +
        ',' + std::to_string(frame.delivered_ns) + (n == 4 ? ",4400," : ",,") +
        shortest(static_cast<double>(frame.time_ns) / 1e9) + ",0," + (measured ? "1," : "0,,");
    EXPECT_EQ(line.substr(0, start.size()), start);
    EXPECT_TRUE(!measured || line.substr(start.size()) == Measurements::cells(some_touch(n), info.outputs));
  }
  EXPECT_FALSE(std::getline(lines, line));
  Session read(folder_ / "s");
  EXPECT_EQ(read.measured_sequences(), (std::vector<uint64_t>{0, 2, 4, 5}));
  EXPECT_EQ(read.recorded(4), Measurements::cells(some_touch(4), info.outputs));
  EXPECT_EQ(read.recorded_names(), Measurements::cell_names());
  EXPECT_EQ(read.recorded(1), std::nullopt);
  EXPECT_EQ(read.recorded(3), std::nullopt);
}

/// Frames that are all the same but for number and time, for tests that want no time lost in making them.
struct Stamped {
  Frame frame;
  explicit Stamped(const FrameFormat& format) : frame(noise_frame(format, 1)) {}
  const Frame& at(uint64_t sequence) {
    frame.sequence = sequence;
    frame.time_ns = static_cast<int64_t>(sequence) * 1'000'000;
    return frame;
  }
};

std::vector<uint64_t> read_numbers(const fs::path& folder, const Frame& pixels) {
  Session read(folder);
  EXPECT_TRUE(read.complete()) << read.warning();
  std::vector<uint64_t> numbers;
  Frame frame;
  while (read.next(frame)) {
    EXPECT_TRUE(same_pixels(frame, pixels));
    numbers.push_back(frame.sequence);
  }
  return numbers;
}

TEST_F(SessionTest, DropsAreCountedExactlyAndTheRestIsWhole) {
  Stamped frames({400, 300, 1, 8});
  SessionWriter writer(folder_ / "s", plain_info(frames.frame.format), {.queue_bytes = 1});  // two frames
  std::vector<uint64_t> taken;
  uint64_t offered = 0;
  for (uint64_t n = 0; n < 300 || (taken.size() == n && n < 100'000); ++n, ++offered)
    if (writer.record(frames.at(n))) taken.push_back(n);
  const SessionStatus status = writer.close();
  EXPECT_EQ(status.error, "");
  EXPECT_GT(status.dropped, 0u);
  EXPECT_EQ(status.recorded, taken.size());
  EXPECT_EQ(status.recorded + status.dropped, offered);
  EXPECT_EQ(status.written, status.recorded);
  EXPECT_EQ(read_numbers(folder_ / "s", frames.frame), taken);
  EXPECT_NE(slurp(folder_ / "s" / kSessionJson).find("\"dropped\": " + std::to_string(status.dropped)),
            std::string::npos);
}

TEST_F(SessionTest, NoDropWaitsAndLosesNothing) {
  Stamped frames({400, 300, 1, 8});
  SessionWriter writer(folder_ / "s", plain_info(frames.frame.format), {.queue_bytes = 1, .no_drop = true});
  std::vector<uint64_t> all;
  for (uint64_t n = 0; n < 100; ++n) {
    ASSERT_TRUE(writer.record(frames.at(n)));
    EXPECT_LE(writer.status().queued, 2u);
    all.push_back(n);
  }
  EXPECT_EQ(writer.close().dropped, 0u);
  EXPECT_EQ(read_numbers(folder_ / "s", frames.frame), all);
}

TEST_F(SessionTest, AWaitingRecordGivesUpWhenCancelled) {
  Stamped frames({1600, 1200, 1, 16});
  SessionWriter writer(folder_ / "s", plain_info(frames.frame.format), {.queue_bytes = 1, .no_drop = true});
  writer.watch([] { return true; });
  uint64_t taken = 0;
  while (writer.record(frames.at(taken))) ASSERT_LT(++taken, 1000u) << "no record waited";
  const SessionStatus status = writer.close();
  EXPECT_GE(taken, 2u);
  EXPECT_EQ(status.recorded, taken);
  EXPECT_EQ(status.dropped, 1u);
}

TEST_F(SessionTest, AQueueOfManyFramesTakesABurst) {
  Stamped frames({400, 300, 1, 8});
  SessionWriter writer(folder_ / "s", plain_info(frames.frame.format), {.most_behind_s = 1e9});
  uint64_t taken = 0;
  while (writer.status().queue_bytes <= 10u * frames.frame.format.frame_bytes()) {
    ASSERT_TRUE(writer.record(frames.at(taken)));
    ASSERT_LT(++taken, 10'000u) << "no frame waited for the encoder";
  }
  EXPECT_EQ(writer.close().written, taken);
  EXPECT_EQ(writer.status().queue_bytes, 0u);
}

// However much memory is left: a frame that would wait longer than it may is dropped.
TEST_F(SessionTest, NoFrameWaitsLongerThanItMay) {
  Stamped frames({640, 480, 1, 16});
  SessionWriter writer(folder_ / "s", plain_info(frames.frame.format),
                       {.queue_bytes = size_t{1} << 32, .most_behind_s = 0});
  uint64_t taken = 0, offered = 0;
  for (; offered - taken < 20 && offered < 100'000; ++offered) {
    taken += writer.record(frames.at(offered)) ? 1 : 0;
    EXPECT_LE(writer.status().queued, 2u);
  }
  const SessionStatus status = writer.close();
  EXPECT_EQ(status.recorded, taken);
  EXPECT_EQ(status.dropped, 20u);
  EXPECT_EQ(status.recorded + status.dropped, offered);
  EXPECT_EQ(status.behind_s, 0);
}

TEST_F(SessionTest, LeasedPixelsAreCopied) {
  SessionWriter writer(folder_ / "s", plain_info(kGray), {.no_drop = true});
  const Frame wanted = noise_frame(kGray, 4);
  {
    Frame leased = wanted;
    auto buffer = std::make_shared<std::vector<uint8_t>>(std::exchange(leased.bytes, {}));
    leased.leased = std::shared_ptr<const uint8_t>(buffer, buffer->data());
    ASSERT_TRUE(writer.record(leased));
    leased.leased.reset();
    EXPECT_EQ(buffer.use_count(), 1);
    std::fill(buffer->begin(), buffer->end(), uint8_t{0});
  }
  writer.close();
  Session read(folder_ / "s");
  Frame frame;
  ASSERT_TRUE(read.next(frame));
  expect_same(frame, wanted);
}

TEST_F(SessionTest, FramesThatDoNotFitEndTheRecordingAndSayWhy) {
  for (const bool format : {false, true}) {
    const fs::path folder = folder_ / (format ? "format" : "number");
    SessionWriter writer(folder, plain_info(kGray), {.no_drop = true});
    ASSERT_TRUE(writer.record(noise_frame(kGray, 3)));
    EXPECT_FALSE(writer.record(noise_frame(format ? FrameFormat{40, 31, 1, 8} : kGray, format ? 4 : 3)));
    EXPECT_FALSE(writer.record(noise_frame(kGray, 5)));
    const SessionStatus status = writer.close();
    EXPECT_NE(status.error.find(format ? "format" : "frame 3 came after frame 3"), std::string::npos)
        << status.error;
    EXPECT_EQ(status.dropped, 2u);
    Session read(folder);
    EXPECT_FALSE(read.complete());
    EXPECT_EQ(read.frame_count(), status.written);
    EXPECT_NE(read.warning().find(status.error), std::string::npos) << read.warning();
  }
}

TEST_F(SessionTest, ARecordingIsNeverOverwritten) {
  const fs::path session = record("s", plain_info(kGray), 2);
  const std::string before = slurp(session / kSessionFrames);
  for (const char* left : {kSessionJson, kSessionFrames, kSessionRows}) {
    const fs::path folder = folder_ / (std::string("only-") + left);
    fs::create_directories(folder);
    fs::copy_file(session / left, folder / left);
    expect_one_line(refusal([&] { SessionWriter(folder, plain_info(kGray)); }), 7);
    EXPECT_EQ(slurp(folder / left), slurp(session / left));
  }
  expect_one_line(refusal([&] { SessionWriter(session, plain_info(kGray)); }), 7);
  EXPECT_EQ(slurp(session / kSessionFrames), before);
  spill(folder_ / "file", "");
  expect_one_line(refusal([&] { SessionWriter(folder_ / "file", plain_info(kGray)); }), 7);
}

TEST_F(SessionTest, SeeksToEveryFrameOfWholeAndOfCutSessions) {
  const fs::path session = record("s", plain_info(kGray), 40);
  for (const bool cut : {false, true}) {
    if (cut) fs::resize_file(session / kSessionFrames, fs::file_size(session / kSessionFrames) * 3 / 4);
    Session read(session);
    EXPECT_EQ(read.complete(), !cut);
    const uint64_t count = *read.frame_count();
    EXPECT_TRUE(cut ? count > 20 && count < 40 : count == 40) << count;
    Frame frame;
    std::mt19937 random(3);
    for (int i = 0; i < 100; ++i) {
      const uint64_t to = random() % count;
      ASSERT_TRUE(read.seek(to));
      for (uint64_t n = to; n < std::min(to + 3, count); ++n) {
        ASSERT_TRUE(read.next(frame));
        Frame wanted = noise_frame(kGray, n);
        if (n == to) wanted.after_gap = true;
        expect_same(frame, wanted);
      }
    }
    EXPECT_FALSE(read.seek(count));
    while (read.next(frame)) {
    }
    ASSERT_TRUE(read.seek(0));  // from the end
    ASSERT_TRUE(read.next(frame));
    EXPECT_EQ(frame.sequence, 0u);
  }
}

TEST_F(SessionTest, TimesThatStandStillOrGoBackStillMakeAVideo) {
  SessionWriter writer(folder_ / "s", plain_info(kGray), {.no_drop = true});
  const std::vector<int64_t> times_ns = {
      5'000'000'000'000, 5'000'000'000'000, 5'000'000'000'001, 4'000'000'000'000, 0,
      6'000'000'000'000, INT64_MAX,         INT64_MIN};
  std::vector<Frame> frames;
  for (size_t n = 0; n < times_ns.size(); ++n) {
    frames.push_back(noise_frame(kGray, n));
    frames.back().time_ns = times_ns[n];
    ASSERT_TRUE(writer.record(frames.back()));
  }
  EXPECT_EQ(writer.close().error, "");
  Session read(folder_ / "s");
  Frame frame;
  for (const Frame& wanted : frames) {
    ASSERT_TRUE(read.next(frame));
    expect_same(frame, wanted);
  }
}

TEST_F(SessionTest, AnyPlayerReadsTheFrames) {
  for (const FrameFormat& format : {FrameFormat{64, 48, 1, 8}, FrameFormat{64, 48, 3, 8}}) {
    const fs::path session = record(std::to_string(format.channels), plain_info(format), 5);
    cv::VideoCapture video((session / kSessionFrames).string(), cv::CAP_FFMPEG);
    ASSERT_TRUE(video.isOpened());
    EXPECT_NEAR(video.get(cv::CAP_PROP_FPS), 60, 0.1);
    cv::Mat image;
    for (uint64_t n = 0; n < 5; ++n) {
      ASSERT_TRUE(video.read(image)) << n;
      const Frame wanted = noise_frame(format, n);
      ASSERT_EQ(image.cols, 64);
      ASSERT_EQ(image.rows, 48);
      for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x)
          for (uint32_t c = 0; c < format.channels; ++c)
            ASSERT_EQ(image.at<cv::Vec3b>(y, x)[2 - static_cast<int>(c)], wanted.at(c, x, y));
    }
    EXPECT_FALSE(video.read(image));
  }
}

TEST_F(SessionTest, OpensAsASourceByFolderAndByItsVideo) {
  SessionInfo info = plain_info(kGray);
  info.sensor = some_sensor(kGray);
  info.background = noise_frame(kGray, 70);
  const fs::path session = record("s", info, 3);
  Sensor sensor = *info.sensor;
  for (const fs::path& input : {session, session / kSessionFrames, session / kSessionJson, session / ""}) {
    const std::unique_ptr<Source> source = open_source(input.string(), sensor);
    EXPECT_EQ(source->format(), kGray);  // crop and quad are not applied again
    Frame frame;
    ASSERT_TRUE(source->next(frame));
    expect_same(frame, noise_frame(kGray, 0));
    EXPECT_TRUE(same_pixels(load_background(input.string(), sensor, *source), *info.background));
  }
  sensor.crop_px.reset();
  sensor.quad_px.reset();
  EXPECT_EQ(open_source(session.string(), sensor)->format(), kGray);
  sensor.crop_px = {{0, 0, 40, 30}};
  expect_one_line(refusal([&] { open_source(session.string(), sensor); }), 3);
  sensor.crop_px.reset();
  sensor.size_px = {41, 30};
  expect_one_line(refusal([&] { open_source(session.string(), sensor); }), 3);
}

TEST_F(SessionTest, UncalibratedFramesAreCutByTheSensorTheyAreReadWith) {
  SessionInfo info = plain_info({40, 30, 3, 8});
  info.background = noise_frame(info.format, 70);
  const fs::path session = record("s", info, 3);
  Sensor sensor;
  sensor.pitch_mm_per_px = 0.05;
  sensor.crop_px = {{3, 5, 20, 10}};
  sensor.channels = 3;
  const std::unique_ptr<Source> source = open_source(session.string(), sensor);
  EXPECT_EQ(source->format(), (FrameFormat{20, 10, 3, 8}));
  Frame frame;
  for (uint64_t n = 0; n < 3; ++n) {
    ASSERT_TRUE(source->next(frame));
    const Frame whole = noise_frame(info.format, n);
    EXPECT_EQ(frame.sequence, n);
    EXPECT_EQ(frame.delivered_ns, whole.delivered_ns);
    for (uint32_t c = 0; c < 3; ++c)
      for (uint32_t y = 0; y < 10; ++y)
        for (uint32_t x = 0; x < 20; ++x) ASSERT_EQ(frame.at(c, x, y), whole.at(c, x + 3, y + 5));
  }
  const std::optional<Frame> background = source->own_background();
  ASSERT_TRUE(background);
  EXPECT_EQ(background->at(1, 0, 0), info.background->at(1, 3, 5));
  sensor.channels = 1;  // gray from colour
  EXPECT_EQ(open_source(session.string(), sensor)->format(), (FrameFormat{20, 10, 1, 8}));
  sensor.crop_px = {{30, 5, 20, 10}};
  expect_one_line(refusal([&] { open_source(session.string(), sensor); }), 3);
}

TEST_F(SessionTest, ASensorWithoutScaleIsNone) {
  SessionInfo info = plain_info(kGray);
  info.sensor = some_sensor(kGray);
  info.sensor->pitch_mm_per_px = std::nan("");
  EXPECT_FALSE(Session(record("s", info, 1)).info().sensor);
}
}  // namespace
}  // namespace palpate
