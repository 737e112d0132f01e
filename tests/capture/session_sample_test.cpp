// tests/data/session_v1 was recorded with version 1 of the format. Later programs must read it, whatever they
// write.
#include "capture/files/measurements.h"
#include "tests/support/session_fixture.h"

namespace palpate {
namespace {

constexpr FrameFormat kOldFormat{20, 15, 1, 12};
constexpr uint64_t kNumbers[] = {0, 1, 2, 4, 5};

Frame sample_frame(uint64_t number) {
  Frame frame;
  frame.reshape(kOldFormat);
  for (uint32_t y = 0; y < kOldFormat.height; ++y)
    for (uint32_t x = 0; x < kOldFormat.width; ++x)
      frame.set(0, x, y, (x * 37 + y * 211 + static_cast<uint32_t>(number) * 1009) % 4096);
  frame.sequence = number;
  frame.time_ns = static_cast<int64_t>(number) * 40'000'001;
  frame.exposed_ns = 77'000'000'000 + frame.time_ns;
  frame.delivered_ns = frame.exposed_ns + 9'000'000;
  frame.after_gap = number == 4;
  return frame;
}

/// Creation of the sample; by this test, where PALPATE_SAMPLE names a folder for a new one.
void write_sample(const fs::path& folder) {
  SessionInfo info;
  info.input = "camera:/dev/video0?format=Y12";
  Sensor sensor;
  sensor.name = "sample pad";
  sensor.pitch_mm_per_px = 0.25;
  sensor.crop_px = {{4, 3, 20, 15}};
  sensor.bit_depth = 12;
  sensor.saturation_gray = 4000;
  sensor.force = ForceCalibration{.c1_N_per_gray = 0.5, .c0_N = 0.25, .gray_max = 1000};
  info.sensor = sensor;
  info.format = kOldFormat;
  info.rate_Hz = 25;
  info.background = sample_frame(1000);
  info.outputs = Output::Force;
  info.program_version = "0.1.0";
  info.device = "llvmpipe";
  info.details = {{"driver", "vivid"}, {"exposure", "8 ms"}};
  SessionWriter writer(folder, info, {.no_drop = true});
  for (const uint64_t number : kNumbers) {
    ASSERT_TRUE(writer.record(sample_frame(number)));
    if (number == 2) continue;
    Touch touch;
    touch.sequence = number;
    touch.contact = true;
    touch.gray_sum = 1.0 / 3;
    touch.force_N = {0.125, 0.0625, Validity::Valid};
    touch.area_px = number;
    writer.measured(touch, 77'100'000'000);
  }
  EXPECT_EQ(writer.close().error, "");
}

void expect_sample(const fs::path& folder) {
  Session session(folder);
  EXPECT_TRUE(session.complete());
  EXPECT_EQ(session.warning(), "");
  EXPECT_EQ(session.format(), kOldFormat);
  EXPECT_EQ(session.rate_Hz(), 25);
  EXPECT_EQ(session.frame_count(), std::size(kNumbers));
  const SessionInfo& info = session.info();
  EXPECT_EQ(info.input, "camera:/dev/video0?format=Y12");
  EXPECT_EQ(info.outputs, Output::Force);
  EXPECT_EQ(info.solver, SurfaceSolver::Live);
  EXPECT_EQ(info.program_version, "0.1.0");
  EXPECT_EQ(info.device, "llvmpipe");
  ASSERT_EQ(info.details.size(), 2u);
  EXPECT_EQ(info.details[1].second, "8 ms");
  ASSERT_TRUE(info.sensor);
  EXPECT_EQ(info.sensor->name, "sample pad");
  EXPECT_EQ(info.sensor->pitch_mm_per_px, 0.25);
  EXPECT_EQ(info.sensor->saturation_gray, 4000u);
  ASSERT_TRUE(info.sensor->force);
  EXPECT_EQ(info.sensor->force->c0_N, 0.25);
  Frame frame;
  for (const uint64_t number : kNumbers) {
    ASSERT_TRUE(session.next(frame));
    expect_same(frame, sample_frame(number));
  }
  EXPECT_FALSE(session.next(frame));
  const std::optional<Frame> background = session.own_background();
  ASSERT_TRUE(background);
  EXPECT_TRUE(same_pixels(*background, sample_frame(1000)));
  EXPECT_EQ(session.measured_sequences(), (std::vector<uint64_t>{0, 1, 4, 5}));
  EXPECT_EQ(session.recorded_names().substr(0, 47), "contact,gray_sum,force_N,force_sd_N,force_state");
  const std::string start = "1,0.3333333333333333,0.125,0.0625,valid,0,0,4,";
  ASSERT_TRUE(session.recorded(4));
  EXPECT_EQ(session.recorded(4)->substr(0, start.size()), start);
}

using SessionSample = Sessions;

TEST_F(SessionSample, TheStoredOneReads) {
  expect_sample(fs::path(PALPATE_SOURCE_DIR) / "tests" / "data" / "session_v1");
}

TEST_F(SessionSample, OneWrittenNowReadsTheSame) {
  const char* wanted = std::getenv("PALPATE_SAMPLE");
  const fs::path folder = wanted ? fs::path(wanted) : folder_ / "s";
  write_sample(folder);
  expect_sample(folder);
}

}  // namespace
}  // namespace palpate
