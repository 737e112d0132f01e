// palpate setup: sensor files from nothing but recordings and stated facts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "engine/base/text.h"
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
  const std::string frames = simulated("rig --rate 5");
  const Table truth(text("rec/truth.csv"));
  std::ofstream gauge(at("gauge.csv"));
  gauge << "frame,force_N\n";
  for (size_t i = 0; i < truth.rows.size(); ++i) gauge << i << "," << truth.at(i, "true_force_N") << "\n";
  gauge.close();
  ASSERT_EQ(run("setup " + frames + " --sequence --gauge '" + at("gauge.csv") + "' --json --out '" +
                at("own.json") + "'"),
            0)
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
  // The calibration is right: other presses of the same pad read their true force.
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
  const std::string frames = simulated("palpation --mode gel --rate 2");
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
  EXPECT_EQ(sensor.reading, SurfaceReading::Photometric);
  EXPECT_TRUE(fs::exists(sensor.background.image));
  // The sentences say what the file holds, how the error scatters and what was left out.
  const std::string surface = step(setup, "surface").at("what").get<std::string>(),
                    touch = step(setup, "touch").at("what").get<std::string>();
  for (const char* word : {"% of the caps", "depth gain", " px) to ", "presses saw "})
    EXPECT_NE(surface.find(word), std::string::npos) << word << " in: " << surface;
  const std::string threshold = palpate::text("threshold %.1f gray", sensor.threshold_gray);
  EXPECT_NE(touch.find(threshold), std::string::npos) << threshold << " in: " << touch;

  // Presses of a further ball join them; here the same ones once more.
  const size_t alone = sensor.photometric.presses.size();
  ASSERT_GT(alone, 0u);
  ASSERT_EQ(run("setup " + frames + " --ball-mm 8 --other-ball " + frames + "=8 --pitch " +
                std::to_string(pitch) + " --json --out '" + at("two.json") + "'"),
            0)
      << text("stderr");
  EXPECT_EQ(load_sensor(folder_ / "two.json").photometric.presses.size(), 2 * alone);
  ASSERT_EQ(run("setup " + frames + " --ball-mm 8 --other-ball " + frames + " --pitch " +
                std::to_string(pitch) + " --json --out '" + at("two.json") + "'"),
            0)
      << text("stderr");
  const Json unclear = step(parse_json(text("stdout")), "surface");
  EXPECT_FALSE(unclear.at("known").get<bool>());
  EXPECT_NE(unclear.at("what").get<std::string>().find("size"), std::string::npos) << unclear.dump();

  // The shape by name; another than what is pressed gives no surface, and one that is unclear nothing at all.
  const std::string shaped = "setup " + frames + " --pitch " + std::to_string(pitch) + " --json --out '" +
                             at("shaped.json") + "' --shape ";
  ASSERT_EQ(run(shaped + "ball:diameter=16"), 0) << text("stderr");
  EXPECT_EQ(load_sensor(folder_ / "shaped.json").photometric.wx, sensor.photometric.wx);
  ASSERT_EQ(run(shaped + "cylinder:radius=8"), 0) << text("stderr");
  EXPECT_FALSE(step(parse_json(text("stdout")), "surface").at("known").get<bool>());
  fs::remove(folder_ / "shaped.json");
  EXPECT_EQ(run(shaped + "cylinder:8"), 2);
  EXPECT_NE(text("stderr").find("by name"), std::string::npos) << text("stderr");
  EXPECT_FALSE(fs::exists(folder_ / "shaped.json"));

  // The diameter for the radius, and presses that contradict the ball: no surface.
  for (const char* ball : {"--ball-mm 16", "--ball-radius-mm 2"}) {
    ASSERT_EQ(run("setup " + frames + " " + ball + " --pitch " + std::to_string(pitch) + " --json --out '" +
                  at("wrong.json") + "'"),
              0)
        << text("stderr");
    const Json wrong = step(parse_json(text("stdout")), "surface");
    EXPECT_FALSE(wrong.at("known").get<bool>()) << ball << ": " << wrong.dump();
    EXPECT_NE(wrong.at("what").get<std::string>().find("ball of"), std::string::npos) << wrong.dump();
    EXPECT_EQ(load_sensor(folder_ / "wrong.json").reading, SurfaceReading::None) << ball;
  }
}

TEST_F(SetupCommand, PrintedMarkersAndThePartThatWasPressedAreSaid) {
  const std::string frames = simulated("palpation --mode gel --skin markers --rate 1.5");
  ASSERT_EQ(run("setup " + frames + " --ball-radius-mm 8 --pitch " +
                std::to_string(load_sensor(folder_ / "rec/sensor.json").pitch_mm_per_px) + " --json --out '" +
                at("own.json") + "'"),
            0)
      << text("stderr");
  const Json surface = step(parse_json(text("stdout")), "surface");
  const Sensor sensor = load_sensor(folder_ / "own.json");
  ASSERT_TRUE(sensor.skin);
  const std::string what = surface.at("what"),
                    apart = palpate::text("%.1f px (%.2f mm) apart", sensor.skin->spacing_px,
                                          sensor.skin->spacing_px * sensor.pitch_mm_per_px);
  for (const std::string& word : {std::string("printed markers, "), apart, std::string("filled under them"),
                                  std::string("presses saw ")})
    EXPECT_NE(what.find(word), std::string::npos) << word << " in: " << what;
}

// What the pictures do not show comes from the kind of sensor; depth does not.
TEST_F(SetupCommand, AKindOfSensorGivesItsScaleAndNoDepth) {
  const std::string frames = simulated("palpation --mode gel --rate 2"), own = at("own.json");
  ASSERT_EQ(run("setup " + frames + " --like gelsight_mini --json --quiet --out '" + own + "'"), 0)
      << text("stderr");
  const Json setup = parse_json(text("stdout"));
  EXPECT_NE(step(setup, "frame").at("missing").get<std::string>().find("of this unit not known"),
            std::string::npos);
  EXPECT_TRUE(step(setup, "scale").at("known").get<bool>());
  EXPECT_NE(step(setup, "scale").at("what").get<std::string>().find("nominal: not of this unit"),
            std::string::npos);
  EXPECT_FALSE(step(setup, "surface").at("known").get<bool>());
  EXPECT_EQ(step(setup, "surface").at("what").get<std::string>(), "not calibrated: no depth of this unit");
  const Sensor sensor = load_sensor(folder_ / "own.json");
  EXPECT_NEAR(sensor.pitch_mm_per_px, 0.0634, 1e-4);
  ASSERT_TRUE(sensor.layer);
  EXPECT_EQ(sensor.reading, SurfaceReading::None);
  // Neither by itself nor when asked for.
  ASSERT_EQ(run("process " + frames + " --sensor '" + own + "' --quiet --out '" + at("out") + "'"), 0)
      << text("stderr");
  EXPECT_EQ(text("out/measurements.csv").find("depth"), std::string::npos);
  EXPECT_NE(run("process " + frames + " --sensor '" + own + "' --outputs surface --quiet --out '" +
                at("asked") + "'"),
            0);
  // A scale that is stated comes first; another kind of frame is refused.
  ASSERT_EQ(run("setup " + frames + " --like gelsight_mini --pitch 0.05 --quiet --out '" + own + "'"), 0);
  EXPECT_EQ(load_sensor(folder_ / "own.json").pitch_mm_per_px, 0.05);
  expect_refusal({"setup", at("rec/frames"), "--like", "gelsight_mimi", "--out", own}, 2,
                 {"did you mean 'gelsight_mini'?"});
}

// One picture is the untouched image, and the recording is as noisy as cameras are, under light that changes.
TEST_F(SetupCommand, UntouchedPicturesShowNoTouchWhateverTheirNoise) {
  fs::create_directories(at("rest"));
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0, 5);
  const auto write = [&](const std::string& name, double light, bool touched) {
    std::ofstream file(at(name), std::ios::binary);
    file << "P6\n160 120\n255\n";
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 160; ++x)
        for (int c = 0; c < 3; ++c) {
          const double r = std::hypot(x - 80.0, y - 60.0),
                       tilt = touched && r < 20 ? (c == 0 ? x - 80.0 : y - 60.0) : 0;
          const double gray = light * (90 + 0.3 * x + 20 * c) + 4 * tilt + noise(random);
          file.put(static_cast<char>(std::lround(std::clamp(gray, 0.0, 255.0))));
        }
  };
  write("background.ppm", 1, false);
  for (int i = 0; i < 8; ++i) write("rest/" + std::to_string(i) + ".ppm", 1 + 0.004 * i, false);
  const std::string command = "setup '" + at("rest") + "' --background '" + at("background.ppm") +
                              "' --pitch 0.1 --ball-radius-mm 4 --json --out '" + at("own.json") + "'";
  ASSERT_EQ(run(command), 0) << text("stderr");
  const Json setup = parse_json(text("stdout"));
  EXPECT_FALSE(step(setup, "touch").at("known").get<bool>()) << step(setup, "touch").dump();
  EXPECT_NE(step(setup, "touch").at("missing").get<std::string>().find("touches the pad"), std::string::npos);
  EXPECT_FALSE(step(setup, "surface").at("known").get<bool>());
  for (const Json& one : setup.at("steps"))
    EXPECT_EQ(one.dump().find("; try palpate"), std::string::npos) << one.dump();
  // The file's threshold keeps noise from being contacts.
  ASSERT_EQ(
      run("process '" + at("rest") + "' --sensor '" + at("own.json") + "' --quiet --out '" + at("out") + "'"),
      0)
      << text("stderr");
  for (const double contacts : Table(text("out/measurements.csv")).numbers("contacts"))
    EXPECT_EQ(contacts, 0);
  // A touch among them is seen.
  write("rest/8.ppm", 1, true);
  ASSERT_EQ(run(command), 0) << text("stderr");
  const Json touched = step(parse_json(text("stdout")), "touch");
  EXPECT_TRUE(touched.at("known").get<bool>()) << touched.dump();
  EXPECT_NE(touched.at("what").get<std::string>().find("slopes by colour"), std::string::npos)
      << touched.dump();
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
