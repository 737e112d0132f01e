// palpate setup: sensor files from nothing but recordings and stated facts.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "palpate/sensor.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

class SetupCommand : public TypedProgram {
 protected:
  /// The step of that name.
  static Json step(const Json& setup, const std::string& name) {
    for (const Json& one : setup.at("steps"))
      if (one.at("step") == name) return one;
    ADD_FAILURE() << "no step " << name;
    return {};
  }
  std::string simulated(const std::string& scene) {
    EXPECT_EQ(run("simulate " + scene + " --size 320x240 --quiet --out '" + at("rec") + "'"), 0)
        << text("stderr");
    return "'" + at("rec/frames") + "'";
  }
};

TEST_F(SetupCommand, APadThatLightsUpIsKnownFromOneRecording) {
  const std::string frames = simulated("rig --rate 10");
  const Table truth(text("rec/truth.csv"));
  std::ofstream gauge(at("gauge.csv"));
  gauge << "frame,force_N\n";
  for (size_t i = 0; i < truth.rows.size(); ++i) gauge << i << "," << truth.at(i, "true_force_N") << "\n";
  gauge.close();
  ASSERT_EQ(
      run("setup " + frames + " --gauge '" + at("gauge.csv") + "' --json --out '" + at("own.json") + "'"), 0)
      << text("stderr");
  const Json setup = parse_json(text("stdout"));
  for (const char* known : {"frame", "untouched image", "touch", "force"})
    EXPECT_TRUE(step(setup, known).at("known").get<bool>()) << known << ": " << step(setup, known).dump();
  for (const char* missing : {"scale", "surface"}) {
    EXPECT_FALSE(step(setup, missing).at("known").get<bool>()) << missing;
    EXPECT_NE(step(setup, missing).at("missing").get<std::string>(), "") << missing;
  }
  const Sensor sensor = load_sensor(folder_ / "own.json");
  EXPECT_EQ(sensor.signal, Signal::Brighter);
  EXPECT_FALSE(has_scale(sensor));
  ASSERT_TRUE(sensor.force);
  EXPECT_TRUE(sensor.force->fit_for_use);
  // What it says is measured: other presses of the same pad read the force that there was.
  ASSERT_EQ(run("process " + frames + " --sensor '" + at("own.json") + "' --quiet --out '" + at("out") + "'"),
            0)
      << text("stderr");
  const Table measured(text("out/measurements.csv"));
  size_t compared = 0;
  for (size_t i = 0; i < measured.rows.size(); ++i) {
    if (measured.at(i, "force_state") != "valid") continue;
    EXPECT_NEAR(measured.number(i, "force_N"), truth.number(i, "true_force_N"),
                0.02 + 4 * measured.number(i, "force_sd_N"));
    ++compared;
  }
  EXPECT_GT(compared, 20u);
  // Every step can be done again alone, as it is printed.
  for (const char* name : {"untouched image", "force"}) {
    const std::string again = step(setup, name).at("again").get<std::string>();
    ASSERT_TRUE(again.starts_with("palpate calibrate ")) << again;
    EXPECT_EQ(run(again.substr(8) + " --quiet"), 0) << again << "\n" << text("stderr");
  }
}

TEST_F(SetupCommand, AGelIsKnownFromPressesOfABall) {
  const std::string frames = simulated("palpation --mode gel --rate 6");
  const double pitch = load_sensor(folder_ / "rec/sensor.json").pitch_mm_per_px;
  ASSERT_EQ(run("setup " + frames + " --ball-mm 8 --pitch " + std::to_string(pitch) + " --json --out '" +
                at("own.json") + "'"),
            0)
      << text("stderr");
  const Json setup = parse_json(text("stdout"));
  for (const char* known : {"frame", "untouched image", "touch", "scale", "surface"})
    EXPECT_TRUE(step(setup, known).at("known").get<bool>()) << known << ": " << step(setup, known).dump();
  const Sensor sensor = load_sensor(folder_ / "own.json");
  EXPECT_EQ(sensor.signal, Signal::Either);
  EXPECT_EQ(sensor.reconstruction, Reconstruction::Photometric);
  EXPECT_TRUE(fs::exists(sensor.background.image));
}

TEST_F(SetupCommand, WhatIsMissingIsSaidAndNonsenseRefused) {
  const std::string frames = simulated("still --rate 4 --frames 8");
  ASSERT_EQ(run("setup " + frames + " --json --out '" + at("own.json") + "'"), 0) << text("stderr");
  const Json setup = parse_json(text("stdout"));
  EXPECT_FALSE(step(setup, "touch").at("known").get<bool>());
  EXPECT_NE(step(setup, "touch").at("missing").get<std::string>().find("touches the pad"), std::string::npos);
  for (const char* corners : {"1,2,3", "a,b,c,d,e,f,g,h", "1,2,3,4,5,6,7,8,9"}) {
    EXPECT_EQ(run("setup " + frames + " --corners " + corners + " --out '" + at("o.json") + "'"), 2);
    EXPECT_NE(text("stderr").find("four corners"), std::string::npos) << text("stderr");
  }
  EXPECT_EQ(run("setup '" + at("nothing") + "' --out '" + at("o.json") + "'"), 2);
  EXPECT_EQ(run("setup " + frames + " --ball-mm -3 --out '" + at("o.json") + "'"), 2);
  // Corners turn the picture into the pad.
  ASSERT_EQ(run("setup " + frames + " --corners 20,20,300,30,290,220,30,210 --out '" + at("cut.json") + "'"),
            0)
      << text("stderr");
  const Sensor cut = load_sensor(folder_ / "cut.json");
  ASSERT_TRUE(cut.quad_px);
  EXPECT_NEAR(cut.size_px[0], 280, 2);
  EXPECT_EQ(run("process " + frames + " --sensor '" + at("cut.json") + "' --quiet --out '" + at("out") + "'"),
            0)
      << text("stderr");
}

}  // namespace
}  // namespace palpate
