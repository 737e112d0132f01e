// The player of a recording: its strip of thumbnails, marks, and the part that is played again and again.
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "capture/files/images/images.h"
#include "capture/synthetic/synthetic.h"
#include "tests/support/eventually.h"
#include "tests/support/gpu_fixture.h"
#include "tests/window/desktop.h"
#include "viz/display/depth_strip.h"
#include "viz/panels/start/thumbnails.h"
#include "viz/render/format.h"
#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate {
namespace viz {
namespace {

TEST(PlayedPart, EndsArePutAtTheShownFrame) {
  using P = std::optional<PlayedPart>;
  EXPECT_EQ(with_end({}, PartEnd::First, 30, 100), P({30, 99}));
  EXPECT_EQ(with_end({}, PartEnd::Last, 30, 100), P({0, 30}));
  EXPECT_EQ(with_end(PlayedPart{30, 99}, PartEnd::Last, 60, 100), P({30, 60}));
  EXPECT_EQ(with_end(PlayedPart{30, 60}, PartEnd::First, 70, 100), P({70, 99})) << "beyond the other end";
  EXPECT_EQ(with_end(PlayedPart{30, 60}, PartEnd::Last, 20, 100), P({0, 20}));
  EXPECT_EQ(with_end(PlayedPart{30, 60}, PartEnd::Keep, 5, 100), P({30, 60}));
  EXPECT_EQ(with_end(PlayedPart{30, 60}, PartEnd::None, 5, 100), P());
}

TEST(History, TheNextEventLiesBeyondTheMoment) {
  History history({.frames = 100, .rate_Hz = 10});
  for (const double time_s : {2.0, 7.0, 4.0}) history.mark({0, time_s, "mark", "x"});
  EXPECT_EQ(history.next_event(2.0, true), 4.0);
  EXPECT_EQ(history.next_event(7.0, true), std::nullopt);
  EXPECT_EQ(history.next_event(7.0, false), 4.0);
  EXPECT_EQ(history.next_event(1.0, false), std::nullopt);
}

/// Where the thumbnails of the list of sources are, for this test alone.
class DepthStripTest : public GpuTest {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    folder_ = test_folder("strip");
    setenv("PALPATE_CONFIG", (folder_ / "window.json").c_str(), 1);
    SyntheticOptions scene = parse_synthetic("synthetic:press?mode=gel&size=160x120");
    const SyntheticSensor sensor(scene);
    frames_ = std::min<uint64_t>(sensor.frame_count().value(), 240);
    fs::create_directories(folder_ / "rec");
    Frame frame;
    for (uint64_t i = 0; i < frames_; ++i) {
      ASSERT_TRUE(sensor.render(i, frame));
      const std::vector<uint8_t> png = encode_image(frame, ".png");
      std::ofstream(folder_ / "rec" / text("%04d.png", static_cast<int>(i)), std::ios::binary)
          .write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
      const std::optional<Truth> truth = sensor.truth(i);
      depths_mm_.push_back(*std::ranges::max_element(truth->depth_mm));
    }
    input_ = {folder_ / "rec", synthetic_sensor(scene), *sensor.own_background(),
              Output::Force | Output::Surface};
  }
  void TearDown() override {
    unsetenv("PALPATE_CONFIG");
    fs::remove_all(folder_);
    GpuTest::TearDown();
  }
  static uint32_t brightest(const Frame& picture) {
    uint32_t most = 0;
    for (uint32_t y = 0; y < picture.format.height; ++y)
      for (uint32_t x = 0; x < picture.format.width; ++x) most = std::max(most, picture.at(0, x, y));
    return most;
  }
  static void wait_for(DepthStrip& strip) {
    strip.give_way(false);
    ASSERT_TRUE(eventually([&] { return strip.finished(); }));
    ASSERT_EQ(strip.measured(), DepthStrip::kLooks);
  }

  fs::path folder_;
  uint64_t frames_ = 0;
  std::vector<double> depths_mm_;
  StripInput input_;
};

TEST_F(DepthStripTest, HasTheTrueDepthsAndKeepsThem) {
  DepthStrip strip(context(), input_);
  wait_for(strip);
  EXPECT_FALSE(strip.from_file());
  std::vector<double> found_mm;
  double largest_mm = 0;
  for (uint32_t i = 0; i < DepthStrip::kLooks; ++i) {
    const double true_mm = depths_mm_[(2 * i + 1) * frames_ / (2 * DepthStrip::kLooks)];
    found_mm.push_back(strip.deepest_mm(i));
    EXPECT_NEAR(found_mm.back(), true_mm, 0.06 * true_mm + 0.02) << "look " << i;
    largest_mm = std::max(largest_mm, true_mm);
  }
  EXPECT_GT(largest_mm, 0.3) << "something is pressed";
  // The deepest place of all has the last colour, what nothing touches the first.
  Frame picture;
  strip.draw(picture, 800, 32, ColourMap::Viridis);
  EXPECT_GT(brightest(picture), 200u) << "yellow";

  DepthStrip again(context(), input_);
  wait_for(again);
  EXPECT_TRUE(again.from_file());
  for (uint32_t i = 0; i < DepthStrip::kLooks; ++i) EXPECT_EQ(again.deepest_mm(i), found_mm[i]) << i;
}

TEST_F(DepthStripTest, AnotherSensorOrAnotherRecordingIsMeasuredAnew) {
  {
    DepthStrip strip(context(), input_);
    wait_for(strip);
  }
  input_.sensor.pitch_mm_per_px *= 1.5;
  {
    DepthStrip strip(context(), input_);
    wait_for(strip);
    EXPECT_FALSE(strip.from_file());
  }
  fs::remove(folder_ / "rec" / "0000.png");
  DepthStrip strip(context(), input_);
  wait_for(strip);
  EXPECT_FALSE(strip.from_file());
  int strips = 0;
  for (const auto& entry : fs::directory_iterator(thumbnail_file(input_.input).parent_path()))
    strips += entry.path().filename().string().find("-strip-") != std::string::npos;
  EXPECT_EQ(strips, 1) << "the one before is replaced";
}

TEST_F(DepthStripTest, WithoutASurfaceItShowsTheFramesAndWithoutARecordingNothing) {
  input_.outputs = Output::Force;
  DepthStrip strip(context(), input_);
  wait_for(strip);
  Frame picture;
  strip.draw(picture, 800, 32, ColourMap::Viridis);
  EXPECT_GT(brightest(picture), 60u) << "the gel's gray";
  input_.input = folder_ / "nowhere";
  DepthStrip nothing(context(), input_);
  ASSERT_TRUE(eventually([&] { return nothing.finished(); }));
  EXPECT_EQ(nothing.measured(), 0u);
  nothing.draw(picture, 800, 32, ColourMap::Viridis);
  EXPECT_EQ(brightest(picture), 24u);
}

}  // namespace
}  // namespace viz

namespace {

/// Replays a session of 120 frames, 4 s; rows of what is measured come on stdout.
class PlayerTest : public WindowTest {
 protected:
  void open_recording() {
    const fs::path rec = folder_ / "rec";
    ASSERT_EQ(run({"record", "synthetic:slide?size=160x120", "--out", rec, "--frames", "120"}).exit_code, 0);
    spill(rec / "events.csv", "frame,time_s,event,text\n30,1,mark,first\n90,3,mark,second\n");
    open({"replay", rec, "--out", folder_ / "out", "--jsonl"});
    ASSERT_TRUE(drawn(folder_ / "out"));
    layout_ = viz::make_layout({1280, 720}, 1, {160, 120, 1, 8}, true, {.player = true, .tools = true});
    desktop_->key("space");
  }
  /// Marks until one lies where the player should be: the frame is there when it has been sought and
  /// measured.
  int at_frame(int least, int most) {
    int at = -1;
    EXPECT_TRUE(wait_for([&] {
      desktop_->key("m");
      const Table rows(slurp(folder_ / "out" / "events.csv"));
      if (rows.rows.empty()) return false;
      at = std::stoi(rows.at(rows.rows.size() - 1, "frame"));
      return at >= least && at <= most;
    })) << at
        << " is not from " << least << " to " << most;
    return at;
  }
  std::vector<int> measured() const {
    std::istringstream rows(slurp(folder_ / "stdout"));
    std::vector<int> frames;
    for (std::string row; std::getline(rows, row);)
      if (const size_t at = row.find("\"frame\":"); at != std::string::npos)
        frames.push_back(std::stoi(row.substr(at + 8)));
    return frames;
  }

  viz::Layout layout_;
};

TEST_F(PlayerTest, TheMouseScrubsStepsAndLoops) {
  open_recording();
  const viz::ViewRect& strip = layout_.strip;
  const int y = strip.y + 16;
  const auto x = [&](double part) { return strip.x + static_cast<int>(part * strip.width); };
  desktop_->click(x(0.5), y);
  EXPECT_NEAR(at_frame(58, 61), 60, 2);
  desktop_->drag(x(0.5), y, x(0.25), y);
  const int first = at_frame(29, 31);
  const int button = strip.y + static_cast<int>(strip.height) + 16;
  const auto press = [&](int number) { desktop_->click(layout_.player.x + 8 + 14 + 32 * number, button); };
  press(2);  // a step on
  EXPECT_EQ(at_frame(first + 1, first + 1), first + 1);
  press(5);  // A
  desktop_->click(x(0.3), y);
  const int last = at_frame(34, 37);
  press(6);  // B
  const size_t before = measured().size();
  press(1);  // on
  ASSERT_TRUE(wait_for([&] { return measured().size() > before + 40; })) << "longer than the part";
  const std::vector<int> frames = measured();
  for (size_t i = before; i < frames.size(); ++i) {
    EXPECT_GE(frames[i], first + 1);
    EXPECT_LE(frames[i], last);
  }
  press(7);  // no loop
  ASSERT_TRUE(wait_for([&] { return measured().back() > last + 20; }));
  const Ended done = quit();
  EXPECT_EQ(done.exit_code, 0) << done.err;
}

TEST_F(PlayerTest, KeysGoToMarksAndToTheLargestForceAndLoop) {
  open_recording();
  desktop_->key("End");
  at_frame(119, 119);
  desktop_->key("ctrl+comma");
  at_frame(90, 90);
  desktop_->key("alt+bracketright Home");
  at_frame(0, 0);
  desktop_->key("alt+bracketleft ctrl+period");  // the part begins here; to the first mark
  at_frame(30, 30);
  const size_t before = measured().size();
  desktop_->key("space");
  ASSERT_TRUE(wait_for([&] { return measured().size() > before + 120; })) << "longer than the part";
  std::vector<int> frames = measured();
  EXPECT_LE(*std::max_element(frames.begin() + static_cast<std::ptrdiff_t>(before), frames.end()), 90);
  desktop_->key("BackSpace");
  ASSERT_TRUE(wait_for([&] { return measured().back() == 119; }));
  desktop_->key("shift+f");
  std::istringstream rows(slurp(folder_ / "stdout"));
  std::map<int, double> force_N;
  for (std::string row; std::getline(rows, row);)
    if (const Json touch = parse_json(row); touch.is_object())
      force_N[touch["frame"]] = touch["force_N"].is_number() ? touch["force_N"].get<double>() : 0;
  double largest_N = 0;
  for (const auto& [frame, force] : force_N) largest_N = std::max(largest_N, force);
  EXPECT_GT(largest_N, 0.1);
  EXPECT_TRUE(wait_for([&] { return force_N[at_frame(0, 118)] > 0.97 * largest_N; }));
  const Ended done = quit();
  EXPECT_EQ(done.exit_code, 0) << done.err;
}

}  // namespace
}  // namespace palpate
