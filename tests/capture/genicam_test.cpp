// GenICam cameras: Aravis's own simulated camera, and its simulated GigE camera on the loopback network.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <set>
#include <thread>

#include "capture/camera/camera_clock.h"
#include "capture/genicam/camera.h"
#include "capture/genicam/module.h"
#include "capture/open_source.h"
#include "engine/base/clock.h"
#include "palpate/error.h"

namespace palpate {
namespace {

Sensor sensor_of(uint32_t channels, uint32_t bits) {
  Sensor sensor;
  sensor.channels = channels;
  sensor.bit_depth = bits;
  return sensor;
}

class Genicam : public testing::Test {
 protected:
  void SetUp() override {
    if (!genicam::module_if_there()) GTEST_SKIP() << "built without Aravis";
  }

  /// The line of the error that opening `input` ends with.
  static std::string refused(const std::string& input, const Sensor& sensor) {
    try {
      open_source(input, sensor);
    } catch (const Error& error) {
      return error.what();
    }
    return "not refused";
  }
};

std::string detail(const Source& source, const std::string& name) {
  for (const auto& [key, value] : source.details())
    if (key == name) return value;
  return "none";
}

TEST_F(Genicam, FramesOfEveryKindComeInOrderWithTheirTimes) {
  struct Kind {
    const char* format;
    uint32_t channels, bits;
    const char* copies;
  };
  for (const Kind& kind :
       {Kind{"GREY", 1, 8, "0 (leased)"}, Kind{"Y16", 1, 16, "0 (leased)"},
        Kind{"BayerRG8", 3, 8, "2 (decoded, rectified)"}, Kind{"RGGB8", 1, 8, "1 (decoded)"},
        Kind{"RGB8", 3, 8, "2 (decoded, rectified)"}}) {
    const auto camera =
        open_source(std::string("camera:genicam:Fake_1?size=320x240&fps=50&format=") + kind.format,
                    sensor_of(kind.channels, kind.bits));
    EXPECT_EQ(camera->format(), (FrameFormat{320, 240, kind.channels, kind.bits})) << kind.format;
    EXPECT_TRUE(camera->live());
    EXPECT_NEAR(camera->rate_Hz(), 50, 0.5);
    Frame frame;
    uint64_t sequence = 0;
    int64_t time_ns = -1;
    for (int i = 0; i < 6; ++i) {
      ASSERT_TRUE(camera->next(frame));
      EXPECT_TRUE(i == 0 ? frame.sequence == 0 : frame.sequence > sequence) << frame.sequence;
      EXPECT_GT(frame.time_ns, time_ns);
      EXPECT_TRUE(frame.exposed_ns > 0 && frame.exposed_ns <= frame.delivered_ns) << kind.format;
      std::set<uint32_t> values;
      for (uint32_t x = 0; x < 320; ++x) values.insert(frame.at(0, x, 120));
      EXPECT_GT(values.size(), 50u) << kind.format << ": a picture of one colour";
      sequence = frame.sequence;
      time_ns = frame.time_ns;
    }
    EXPECT_EQ(camera->counts().lost, sequence - 5) << kind.format;
    EXPECT_EQ(camera->counts().damaged + camera->counts().gaps, 0u);
    EXPECT_EQ(detail(*camera, "copies per frame"), kind.copies) << kind.format;
    EXPECT_EQ(detail(*camera, "size"), "320x240 px");
  }
}

TEST_F(Genicam, WithoutASensorTheWholeChipIsTakenInColour) {
  EXPECT_EQ(camera_format("camera:genicam:Fake_1"), (FrameFormat{2048, 2048, 3, 8}));
  EXPECT_EQ(camera_format("camera:genicam:Fake_1?format=Mono16&size=64x48"), (FrameFormat{64, 48, 1, 16}));
}

// A frame that is kept keeps its pixels, however many come after it and whether or not the camera lives.
TEST_F(Genicam, AFrameThatIsKeptIsNotWrittenOver) {
  auto camera =
      open_source("camera:genicam:Fake_1?size=64x48&format=GREY&buffers=4&fps=200", sensor_of(1, 8));
  Frame kept;
  ASSERT_TRUE(camera->next(kept));
  ASSERT_TRUE(kept.leased);
  const std::vector<uint8_t> before(kept.pixels(), kept.pixels() + kept.format.frame_bytes());
  Frame frame;
  for (int i = 0; i < 12; ++i) ASSERT_TRUE(camera->next(frame));
  EXPECT_NE(std::vector<uint8_t>(frame.pixels(), frame.pixels() + frame.format.frame_bytes()), before)
      << "the simulated picture moves";
  camera.reset();
  EXPECT_EQ(std::vector<uint8_t>(kept.pixels(), kept.pixels() + kept.format.frame_bytes()), before);
}

TEST_F(Genicam, SettingsAreSetAndReadBack) {
  const auto camera =
      open_source("camera:genicam:Fake_1?size=64x48&format=GREY&fps=20&exposure=5ms&gain=3&trigger=Software",
                  sensor_of(1, 8));
  EXPECT_EQ(detail(*camera, "exposure"), "5000 us");
  EXPECT_EQ(detail(*camera, "gain"), "3");
  EXPECT_EQ(detail(*camera, "rate"), "20 Hz");
  EXPECT_EQ(detail(*camera, "trigger"), "Software");
  EXPECT_EQ(detail(*camera, "offset"), "992, 1000 px") << "the middle of the chip of 2048 x 2048";
  Frame frame;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(camera->next(frame));
}

TEST_F(Genicam, AnExposureLongerThanAFrameIsSaid) {
  const auto camera =
      open_source("camera:genicam:Fake_1?size=64x48&format=GREY&fps=15/2&exposure=200ms", sensor_of(1, 8));
  EXPECT_EQ(camera->warning(), "an exposure of 200 ms allows at most 5 frames/s, not 7.5");
  EXPECT_EQ(detail(*camera, "warning"), camera->warning());
  EXPECT_EQ(detail(*camera, "rate"), "7.5 Hz");
}

TEST_F(Genicam, WhatItCannotDoIsRefusedInOneLine) {
  const Sensor gray = sensor_of(1, 8);
  const std::pair<const char*, const char*> cases[] = {
      {"nobody", "the GenICam camera 'nobody'"},
      {"Fake_1?size=5000x48", "1 to 2048 px in steps of 1"},
      {"Fake_1?fps=5000", "0.1 to 1000"},
      {"Fake_1?format=Y12", "the formats"},
      {"Fake_1?format=Y99", "one of GREY"},
      {"Fake_1?exposure=30s", "10 to 1e+07"},
      {"Fake_1?exposure=auto", "an automatic exposure"},
      {"Fake_1?gain=99", "0 to 10"},
      {"Fake_1?white_balance=4500", "a white balance in K"},
      {"Fake_1?trigger=Line7", "the triggers Line0, Software"},
      {"Fake_1?control.NoSuchThing=3", "no feature of that name"}};
  for (const auto& [input, word] : cases) {
    const std::string line = refused(std::string("camera:genicam:") + input, gray);
    EXPECT_NE(line.find(word), std::string::npos) << input << ": " << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
  EXPECT_EQ(refused("camera:genicam:Fake_1?format=Y16&size=64x48", sensor_of(3, 8))
                .find("wanted colour from Fake_1"),
            0u);
}

/// The simulated GigE camera in a process of its own, on the loopback network.
class FakeGige {
 public:
  static constexpr const char* kProgram = "/usr/bin/arv-fake-gv-camera-0.8";

  FakeGige() : child_(::fork()) {
    if (child_ != 0) return;
    ::execl(kProgram, kProgram, "-i", "127.0.0.1", "-s", "GV01", static_cast<char*>(nullptr));
    ::_exit(127);
  }
  ~FakeGige() {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }
  FakeGige(const FakeGige&) = delete;
  FakeGige& operator=(const FakeGige&) = delete;

 private:
  pid_t child_;
};

TEST_F(Genicam, AGigeCameraThatWasUnpluggedComesBack) {
  if (!std::filesystem::exists(FakeGige::kProgram)) GTEST_SKIP() << "no " << FakeGige::kProgram;
  auto gige = std::make_unique<FakeGige>();
  std::unique_ptr<Source> camera;
  std::string why;
  for (int i = 0; i < 20 && !camera; ++i) {
    try {
      camera =
          open_source("camera:genicam:127.0.0.1?size=64x48&format=GREY&fps=50&timeout=1s", sensor_of(1, 8));
    } catch (const Error& error) {
      why = error.what();
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
  if (!camera) GTEST_SKIP() << "no loopback network for a simulated GigE camera: " << why;
  EXPECT_EQ(detail(*camera, "driver"), "GigEVision by Aravis");
  Frame frame;
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(camera->next(frame));
  const uint64_t before = frame.sequence;
  gige.reset();
  std::string state;
  bool away = false;
  camera->watch([&] {
    state = camera->state();
    away |= state.find("waiting for the camera") != std::string::npos;
    if (away && !gige) gige = std::make_unique<FakeGige>();
    return false;
  });
  do {
    ASSERT_TRUE(camera->next(frame));
  } while (!frame.after_gap || !away);  // frames that were on their way when it went come first
  EXPECT_GT(frame.sequence, before);
  EXPECT_EQ(camera->state(), "");
  EXPECT_GE(camera->counts().gaps, 1u);
}

TEST(DeviceClock, IsTheHostsByTheFrameThatCameFastest) {
  // A camera's clock that starts anywhere and runs 40 ppm fast; ways of 2 to 12 ms.
  DeviceClock clock;
  int64_t worst_ns = 0, spread_ns = 0, last_off_ns = 0;
  for (int64_t i = 0; i < 20000; ++i) {
    const int64_t taken_ns = 5'000'000'000 + i * 16'666'667;
    const auto stamp_ns = 77'000 + taken_ns + taken_ns / 25'000;
    const int64_t delivered_ns = taken_ns + 2'000'000 + (i * 7919 % 10007) * 1000;
    const int64_t on_host_ns = clock.on_host(stamp_ns, delivered_ns);
    EXPECT_LE(on_host_ns, delivered_ns);
    if (i < 1000) continue;  // until a fast one has come
    const int64_t off_ns = on_host_ns - taken_ns;
    worst_ns = std::max(worst_ns, std::abs(off_ns - 2'000'000));
    spread_ns = std::max(spread_ns, std::abs(off_ns - last_off_ns) * (i > 1000));
    last_off_ns = off_ns;
  }
  EXPECT_LT(worst_ns, 1'000'000) << "least way: 2 ms";
  EXPECT_LT(spread_ns, 500'000) << "ways scatter by 10 ms, times do not";
}

TEST(DeviceClock, FollowsOneThatIsSetByAnHour) {
  constexpr int64_t kHour_ns = 3'600'000'000'000;
  for (const int64_t set_ns : {kHour_ns, -kHour_ns}) {
    DeviceClock clock;
    for (int64_t i = 0; i < 300; ++i) {
      const int64_t taken_ns = 2 * kHour_ns + i * 33'000'000;
      const int64_t stamp_ns = taken_ns + kHour_ns / 3 + (i >= 100 ? set_ns : 0);
      const int64_t delivered_ns = taken_ns + 2'000'000 + (i % 7) * 1'000'000;
      const int64_t off_ns = clock.on_host(stamp_ns, delivered_ns) - taken_ns;
      EXPECT_GE(off_ns, 0) << i;
      EXPECT_LE(off_ns, 8'100'000) << i;
    }
  }
}

}  // namespace
}  // namespace palpate
