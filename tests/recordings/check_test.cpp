// palpate check on recordings of real sensors: yes on a sensor's own, no on another's and on another day.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/support/json.h"
#include "tests/support/program_fixture.h"
#include "tests/support/recordings.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

class CheckOfRecordings : public TypedProgram {
 protected:
  void SetUp() override {
    if (!fs::is_directory(data_)) {
      std::fprintf(stderr, "\n*** CHECKS OF REAL SENSORS ARE NOT TRIED: no recordings in %s ***\n\n",
                   data_.c_str());
      GTEST_SKIP() << "no recordings of real sensors";
    }
    TypedProgram::SetUp();
  }
  void TearDown() override {
    if (!IsSkipped()) TypedProgram::TearDown();
  }
  std::string data(const std::string& name) const { return "'" + (data_ / name).string() + "'"; }
  void make(const std::string& command, const std::string& out) {
    ASSERT_EQ(run(command + " --quiet --out '" + at(out) + "'"), 0) << command << "\n" << text("stderr");
  }
  void expect(bool holds, const std::string& sensor, const std::string& input) {
    EXPECT_EQ(run("check '" + at(sensor) + "' " + input + " --quiet"), holds ? 0 : 3)
        << input << "\n"
        << text("stdout") << text("stderr");
    EXPECT_EQ(text("stdout").starts_with("as calibrated: "), holds) << input << "\n" << text("stdout");
  }

  const fs::path data_ = fs::weakly_canonical(recordings_folder());
};

TEST_F(CheckOfRecordings, TwoPadsOfOneKindDiffer) {
  const std::string a = "gelsight_mini/pad_a/", b = "gelsight_mini/pad_b/";
  make("setup " + data(a + "ball_6.31mm") + " --background " + data(a + "background.png") +
           " --ball-diameter-mm 6.31 --like gelsight_mini",
       "a.json");
  // A ball that the calibration has not seen.
  expect(true, "a.json", data(a + "ball_9.5mm") + " --ball-diameter-mm 9.5");
  expect(true, "a.json", data(a + "ball_6.31mm") + " --background " + data(a + "background.png"));
  expect(false, "a.json", data(b + "ball_5mm"));
  expect(false, "a.json", data(a + "ball_9.5mm") + " --background " + data(b + "background.png"));
  // A diameter as the radius is a depth twice too large.
  expect(false, "a.json", data(a + "ball_6.31mm") + " --ball-radius-mm 6.31");
  if (!thorough()) return;
  make("setup " + data(b + "ball_5mm") + " --background " + data(b + "background.png") +
           " --ball-diameter-mm 5 --like gelsight_mini_markers",
       "b.json");
  expect(true, "b.json", data(b + "ball_5mm") + " --background " + data(b + "background.png"));
  expect(false, "b.json", data(a + "ball_9.5mm"));
}

TEST_F(CheckOfRecordings, AnotherDayOfTheWedgeIsNotTheFirst) {
  const std::string first = "gelsight_wedge_press/", other = "gelsight_wedge_day2/";
  make("calibrate background " + data(first + "golf_ball_1.avi") + " --sensor '" +
           shipped_sensor("gelsight_wedge").string() + "'",
       "first.json");
  expect(true, "first.json", data(first + "purple_ball_hardest_2.avi"));
  if (thorough()) expect(true, "first.json", data(first + "foam_brick_1.avi"));
  expect(false, "first.json", data(other + "golf_ball.avi"));
}

}  // namespace
}  // namespace palpate
