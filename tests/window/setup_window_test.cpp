// A sensor file made in the window: corners dragged, steps done again, judged by the file.
#include <opencv2/imgcodecs.hpp>

#include "palpate/sensor.h"
#include "tests/window/desktop.h"

namespace palpate {
namespace {

class SetupInWindow : public WindowTest {
 protected:
  /// Where the corner at `camera` px is drawn: the picture of 320 x 240 px stands in the left column, as in a
  /// window of 1280 x 720.
  static std::pair<double, double> on_screen(double x, double y) {
    const double low_x = 37, low_y = 71, factor = 2.3;
    return {low_x + factor * x, low_y + factor * y};
  }
  /// The recording's picture is there, and with it what can be dragged.
  bool picture_shown() const {
    return wait_for([&] {
      const auto [x, y] = on_screen(160, 120);
      return desktop_->brightness(x, y) > 60;
    });
  }
  static constexpr int kMake_x = 70, kButtons_y = 689;
  static constexpr int kPropose_x = 1053, kPropose_y = 357;
};

TEST_F(SetupInWindow, CornersAreDraggedAndStepsDoneAgain) {
  const fs::path rec = folder_ / "rec", out = folder_ / "own.json";
  ASSERT_EQ(run({"simulate", "palpation", "--mode", "gel", "--rate", "6", "--size", "320x240", "--out", rec})
                .exit_code,
            0);
  const double pitch = load_sensor(rec / "sensor.json").pitch_mm_per_px;
  open({"setup", rec / "frames", "--window", "--corners", "10,10,309,10,309,229,10,229", "--pitch",
        std::to_string(pitch), "--ball-mm", "8", "--out", out});
  ASSERT_TRUE(titled("palpate: a sensor of your own"));
  ASSERT_TRUE(picture_shown());
  const auto [from_x, from_y] = on_screen(10, 10);
  const auto [to_x, to_y] = on_screen(30, 24);
  desktop_->drag(from_x, from_y, to_x, to_y);
  desktop_->click(kMake_x, kButtons_y);
  ASSERT_TRUE(wait_for([&] { return contains(slurp(out), "\"reading\": \"photometric\""); })) << slurp(out);
  const Ended done = leave();
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const Sensor sensor = load_sensor(out);
  ASSERT_TRUE(sensor.quad_px);
  EXPECT_NEAR((*sensor.quad_px)[0][0], 30, 3) << "where it was dragged";
  EXPECT_NEAR((*sensor.quad_px)[0][1], 24, 3);
  EXPECT_NEAR((*sensor.quad_px)[2][0], 309, 1e-6) << "as given";
  EXPECT_NEAR(sensor.pitch_mm_per_px, pitch, 1e-5);
}

TEST_F(SetupInWindow, KeysAloneMoveCornersAndMakeTheFile) {
  const fs::path rec = folder_ / "rec", out = folder_ / "own.json";
  ASSERT_EQ(
      run({"simulate", "press", "--mode", "gel", "--rate", "6", "--size", "320x240", "--out", rec}).exit_code,
      0);
  open({"setup", rec / "frames", "--window", "--corners", "10,10,309,10,309,229,10,229", "--out", out});
  ASSERT_TRUE(titled("palpate: a sensor of your own"));
  ASSERT_TRUE(picture_shown());
  desktop_->key("1 shift+Right shift+Right Right Down Down 3 shift+Up");
  desktop_->key("ctrl+Return");
  ASSERT_TRUE(wait_for([&] { return contains(slurp(out), "\"threshold_gray\""); })) << slurp(out);
  EXPECT_EQ(leave().exit_code, 0);
  const Sensor sensor = load_sensor(out);
  ASSERT_TRUE(sensor.quad_px);
  EXPECT_EQ((*sensor.quad_px)[0], (std::array{31.0, 12.0}));
  EXPECT_EQ((*sensor.quad_px)[1], (std::array{309.0, 10.0}));
  EXPECT_EQ((*sensor.quad_px)[2], (std::array{309.0, 219.0}));
}

// A sensor file lies next to its recording; corners that were not found are not cut to, and what is not known
// is empty, not 0.
TEST_F(SetupInWindow, WithoutAnythingFilledInTheFileIsByTheRecording) {
  const fs::path rec = folder_ / "rec";
  ASSERT_EQ(
      run({"simulate", "press", "--mode", "gel", "--rate", "6", "--size", "320x240", "--out", rec}).exit_code,
      0);
  open({"setup", rec / "frames", "--window"});
  ASSERT_TRUE(titled("palpate: a sensor of your own"));
  std::this_thread::sleep_for(std::chrono::seconds(2));
  desktop_->click(kPropose_x, kPropose_y);  // the light fills the picture
  desktop_->click(kMake_x, kButtons_y);
  const fs::path made = rec / "frames.json";
  ASSERT_TRUE(wait_for([&] { return contains(slurp(made), "\"threshold_gray\""); }));
  EXPECT_EQ(leave().exit_code, 0);
  const Sensor sensor = load_sensor(made);
  EXPECT_FALSE(sensor.quad_px);
  EXPECT_FALSE(has_scale(sensor));
  EXPECT_FALSE(fs::exists(home() / "palpate" / "frames.json"));
}

TEST_F(SetupInWindow, AFileThatIsThereIsNeverOverwritten) {
  const fs::path rec = folder_ / "rec", out = folder_ / "own.json";
  ASSERT_EQ(
      run({"simulate", "press", "--mode", "gel", "--rate", "6", "--size", "160x120", "--out", rec}).exit_code,
      0);
  spill(out, "mine");
  open({"setup", rec / "frames", "--window", "--out", out});
  ASSERT_TRUE(titled("palpate: a sensor of your own"));
  ASSERT_TRUE(picture_shown());
  desktop_->click(kMake_x, kButtons_y);
  EXPECT_EQ(leave().exit_code, 0);
  EXPECT_EQ(slurp(out), "mine");
}

}  // namespace
}  // namespace palpate
