// palpate calibrate force and shear on the command line: from a rig's recording and a gauge's table to a
// sensor file that measures.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "capture/open_source.h"
#include "capture/run/input.h"
#include "capture/synthetic/synthetic.h"
#include "palpate/sensor.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

class CalibrateForce : public TypedProgram {
 protected:
  Json json() const { return parse_json(text("stdout")); }
  /// A refusal is one line; what it says.
  std::string refusal(const std::string& arguments, int code = 3) {
    EXPECT_EQ(run(arguments + " --quiet"), code) << text("stderr");
    const std::string said = text("stderr");
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
    EXPECT_FALSE(fs::exists(folder_ / "out.json"));
    return said;
  }
  /// The truth of a synthetic recording as a gauge with a clock of its own, 50 readings a second, has it.
  void write_gauge(const std::string& scene, const std::string& name, double offset_s) {
    ASSERT_EQ(run("simulate " + scene + " --quiet --out '" + at("rec") + "'"), 0) << text("stderr");
    const Table truth(text("rec/truth.csv"));
    const std::vector<double> time_s = truth.numbers("time_s"), force_N = truth.numbers("true_force_N");
    std::ofstream gauge(folder_ / name);
    gauge << "time_ms,force_mN\n";
    size_t i = 0;
    for (double t = 0; t < time_s.back(); t += 0.02) {
      while (i + 2 < time_s.size() && time_s[i + 1] < t) ++i;
      const double fraction = (t - time_s[i]) / (time_s[i + 1] - time_s[i]);
      gauge << 1e3 * (t - offset_s) << ',' << 1e3 * (force_N[i] + fraction * (force_N[i + 1] - force_N[i]))
            << '\n';
    }
  }
};

constexpr const char* kSmallFrame = "size=320x240";

// A sensor file whose pad is a quarter too thick and too soft: wide and small balls say so.
TEST_F(CalibrateForce, FindsThicknessAndModulusOfAPad) {
  Sensor wrong = synthetic_sensor(parse_synthetic("synthetic:press?mode=gel&size=320x240"));
  const LayerCalibration truth = *wrong.layer;
  wrong.layer->thickness_mm *= 1.25;
  wrong.layer->young_MPa /= 1.25;
  save_sensor(wrong, folder_ / "wrong.json");
  std::string command = "calibrate force";
  for (const char* ball :
       {"radius=4&force=1", "radius=8&force=1.5", "radius=16&force=4", "radius=30&force=8"})
    command += std::string(" 'synthetic:press?mode=gel&size=320x240&rate=4&") + ball + "'";
  ASSERT_EQ(run(command + " --gauge truth --model layer --sensor '" + at("wrong.json") + "' --out '" +
                at("out.json") + "' --json --quiet"),
            0)
      << text("stderr");
  const Json found = json()["thickness"];
  EXPECT_EQ(found["decided"], true) << found;
  EXPECT_LT(found["held_out_error_N"], 0.3 * found["held_out_error_by_modulus_alone_N"].get<double>())
      << found;
  const Sensor sensor = load_sensor(folder_ / "out.json");
  std::printf("thickness %.3f of %.3f mm, modulus %.4f of %.4f MPa\n", sensor.layer->thickness_mm,
              truth.thickness_mm, sensor.layer->young_MPa, truth.young_MPa);
  EXPECT_NEAR(sensor.layer->thickness_mm, truth.thickness_mm, 0.05 * truth.thickness_mm);
  EXPECT_NEAR(sensor.layer->young_MPa, truth.young_MPa, 0.05 * truth.young_MPa);
}

TEST_F(CalibrateForce, ReadsOtherSeedsToOnePercent) {
  const std::string calibrate = std::string("calibrate force 'synthetic:press?seed=11&") + kSmallFrame +
                                "' 'synthetic:press?seed=12&" + kSmallFrame + "' --gauge truth --out '" +
                                at("out.json") + "' --json --quiet --check 'synthetic:palpation?seed=13&" +
                                kSmallFrame + "' --check-gauge truth";
  ASSERT_EQ(run(calibrate), 0) << text("stderr");
  const Json found = json();
  EXPECT_GT(found["r_squared"], 0.999);
  EXPECT_LT(found["checks"][0]["median_relative_error"], 0.01);
  EXPECT_GT(found["checks"][0]["readings"], 100);
  EXPECT_GE(found["candidates"].size(), 12u);
  for (const char* file : {"out_force.csv", "out_force.png", "out_force.svg"})
    EXPECT_GT(fs::file_size(folder_ / file), 2000u) << file;
  const Sensor sensor = load_sensor(folder_ / "out.json");
  ASSERT_TRUE(sensor.force);
  EXPECT_FALSE(sensor.force->origin.empty());
  EXPECT_NE(sensor.force->origin.from.find("seed=11"), std::string::npos);
}

// Trials of one ball are left out together, and a gel on one day is read by its layer.
TEST_F(CalibrateForce, LeavesOutObjectsThatAreNamed) {
  std::string command = "calibrate force";
  for (const char* press : {"seed=1&radius=4", "seed=2&radius=4", "seed=3&radius=8", "seed=4&radius=12"})
    command += std::string(" 'synthetic:press?mode=gel&size=320x240&rate=4&force=1&") + press + "'";
  command += " --gauge truth --json --quiet --out '" + at("out.json") + "'";
  ASSERT_EQ(run(command + " --object small small middle large"), 0) << text("stderr");
  const Json named = json();
  EXPECT_EQ(named["blocks"], 3);
  EXPECT_EQ(named["blocks_are"], "objects");
  EXPECT_EQ(named["recordings"][1]["object"], "small");
  EXPECT_EQ(named["objects_left_out"], true);
  EXPECT_EQ(named["days_left_out"], false);
  EXPECT_EQ(named["signal"].get<std::string>().find("layer"), 0u) << named["signal"];
  fs::remove(folder_ / "out.json");
  EXPECT_NE(refusal(command + " --object small large", 2).find("4 recordings and 2 objects"),
            std::string::npos);
}

TEST_F(CalibrateForce, FindsHysteresisDriftAndTheClock) {
  ASSERT_EQ(
      run(std::string("calibrate force 'synthetic:rig?seed=21&hysteresis=0.05&drift=0.02&") + kSmallFrame +
          "' --gauge truth --signal gray-sum --json --quiet --out '" + at("h.json") + "'"),
      0)
      << text("stderr");
  const Json lossy = json();
  EXPECT_NEAR(lossy["hysteresis"].get<double>(), 0.05, 0.015);
  EXPECT_LT(lossy["drift_N_per_min"], 0);  // more light: the gauge falls behind the curve
  ASSERT_NO_FATAL_FAILURE(write_gauge("rig --size 320x240 --seed 21", "gauge.csv", 0.731));
  ASSERT_EQ(run("calibrate force '" + at("rec/frames") + "' --background '" + at("rec/background.png") +
                "' --gauge '" + at("gauge.csv") + "' --sensor '" + at("rec/sensor.json") +
                "' --rate 30 --signal gray-sum --json --quiet --out '" + at("out.json") + "'"),
            0)
      << text("stderr");
  const Json found = json();
  EXPECT_NEAR(found["recordings"][0]["offset_s"].get<double>(), 0.731, 0.005);
  EXPECT_LT(found["hysteresis"], 0.01);
  EXPECT_GT(found["r_squared"], 0.999);
}

TEST_F(CalibrateForce, RefusesWhatItCannotUse) {
  const std::string to = " --out '" + at("out.json") + "'",
                    small = std::string("'synthetic:press?") + kSmallFrame + "'";
  const auto with = [&](const std::string& table) {
    std::ofstream(folder_ / "gauge.csv") << table;
    return refusal("calibrate force " + small + " --gauge '" + at("gauge.csv") + "'" + to);
  };
  EXPECT_NE(with("time_s,force\n0,1\n1,2\n2,3\n").find("a unit"), std::string::npos);
  EXPECT_NE(with("time_s,force_N\n0,1\n2,2\n1,3\n").find("times that rise"), std::string::npos);
  EXPECT_NE(with("frame,force_N\n0,1\n1,2\n").find("at least 3 readings"), std::string::npos);
  EXPECT_NE(with("frame,force_N\n9000,1\n9001,2\n9002,2\n").find("none there"), std::string::npos);
  EXPECT_NE(with("frame,force_N\n0,0\n1,0\n60,1\n").find("at least"), std::string::npos);
  std::string noise = "time_s,force_N\n";
  for (int i = 0; i < 200; ++i)
    noise += std::to_string(i * 0.05) + "," + std::to_string((i * 7919) % 101) + "\n";
  EXPECT_NE(with(noise).find("at best"), std::string::npos);
  // Nothing touches; and too much light.
  EXPECT_NE(refusal(std::string("calibrate force 'synthetic:press?force=0.0001&") + kSmallFrame +
                    "' --gauge truth" + to)
                .find("something presses"),
            std::string::npos);
  EXPECT_NE(
      refusal("calibrate force " + small + " " + small + " --gauge a.csv --gauge b.csv --gauge c.csv" + to, 2)
          .find("2 recordings and 3 gauge tables"),
      std::string::npos);
  EXPECT_NE(refusal("calibrate force " + small + " --gauge truth --align soon" + to, 2).find("--align auto"),
            std::string::npos);
  EXPECT_NE(refusal("calibrate shear " + small + " --gauge truth" + to).find("none along x"),
            std::string::npos);
}

TEST_F(CalibrateForce, ShearOfAGaugeThatWasNotTared) {
  const auto recorded = [&](const std::string& scene) {
    const std::string input = "synthetic:" + scene + "?seed=5&" + kSmallFrame;
    const std::unique_ptr<Source> source = open_source(input, find_input(1, input, {}).sensor);
    std::ofstream table(folder_ / (scene + ".csv"));
    table << "frame,force_N,fx_N,fy_N\n";
    for (uint64_t i = 0; i < source->frame_count().value_or(0); ++i) {
      const Truth truth = *source->truth(i);
      table << i << ',' << truth.force_N + 0.5 << ',' << truth.shear_x_N + 0.7 << ',' << truth.shear_y_N - 0.4
            << '\n';
    }
    return "'" + input + "' ";
  };
  const std::string inputs = recorded("pull") + recorded("slide");
  ASSERT_EQ(run("calibrate shear " + inputs + "--gauge truth --quiet --out '" + at("right.json") + "'"), 0);
  ASSERT_EQ(run("calibrate shear " + inputs + "--gauge '" + at("pull.csv") + "' --gauge '" + at("slide.csv") +
                "' --quiet --out '" + at("out.json") + "'"),
            0)
      << text("stderr");
  for (const char* part : {"fx of ", "reads +0.7 +- ", "fy of ", "reads -0.4 +- ", "reads +0.5 +- "})
    EXPECT_NE(text("stdout").find(part), std::string::npos) << part << "\n" << text("stdout");
  const Sensor found = load_sensor(folder_ / "out.json"), right = load_sensor(folder_ / "right.json");
  EXPECT_NEAR(found.shear->kx_N_per_mm, right.shear->kx_N_per_mm, 1e-3 * right.shear->kx_N_per_mm);
  EXPECT_NEAR(found.shear->ky_N_per_mm, right.shear->ky_N_per_mm, 1e-3 * right.shear->ky_N_per_mm);
  EXPECT_NEAR(found.shear->friction, right.shear->friction, 1e-3);
}

TEST_F(CalibrateForce, ShearOfTheSyntheticPad) {
  ASSERT_EQ(run(std::string("calibrate shear 'synthetic:pull?seed=5&") + kSmallFrame +
                "' 'synthetic:slide?seed=6&" + kSmallFrame + "' --gauge truth --json --quiet --out '" +
                at("out.json") + "'"),
            0)
      << text("stderr");
  const Json found = json();
  const Sensor sensor = load_sensor(folder_ / "out.json");
  ASSERT_TRUE(sensor.shear);
  EXPECT_NEAR(sensor.shear->friction, 0.5, 0.01);
  EXPECT_EQ(found["friction_from"], "from slip");
  EXPECT_GT(found["x"]["r_squared"], 0.99);
  EXPECT_GT(found["y"]["r_squared"], 0.99);
  EXPECT_GT(fs::file_size(folder_ / "out_shear.png"), 2000u);
  // Turns and slides far longer than the pad stretches: no softer spring.
  ASSERT_EQ(
      run(std::string("calibrate shear 'synthetic:pull?seed=5&") + kSmallFrame + "' 'synthetic:drag?seed=5&" +
          kSmallFrame + "' --gauge truth --quiet --out '" + at("drag.json") + "'"),
      0)
      << text("stderr");
  const Sensor dragged = load_sensor(folder_ / "drag.json");
  EXPECT_NEAR(dragged.shear->kx_N_per_mm, sensor.shear->kx_N_per_mm, 0.05 * sensor.shear->kx_N_per_mm);
  EXPECT_NEAR(dragged.shear->ky_N_per_mm, sensor.shear->ky_N_per_mm, 0.05 * sensor.shear->ky_N_per_mm);
  EXPECT_NEAR(dragged.shear->friction, 0.5, 0.02);
}

}  // namespace
}  // namespace palpate
