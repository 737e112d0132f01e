// palpate calibrate photometric as its user meets it: a synthetic gel's presses in, a sensor file out that
// measures.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "engine/sensor.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr const char* kHeader = "image,center_x_px,center_y_px,contact_radius_px,ball_radius_mm\n";

class Calibrate : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("palpate-calibrate-" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Runs the program and returns its exit code; stdout and stderr lie in files beside.
  int run(const std::string& arguments) const {
    const std::string command = std::string("'") + PALPATE_PROGRAM + "' " + arguments + " > '" +
                                at("stdout") + "' 2> '" + at("stderr") + "'";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  std::string text(const std::string& name) const {
    std::ifstream in(folder_ / name);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::string calibrate(const std::string& rest) const {
    return "calibrate photometric '" + at("rec/frames") + "' --sensor '" + at("rec/sensor.json") +
           "' --balls '" + at("balls.csv") + "' --background '" + at("rec/background.png") + "' --out '" +
           at("out.json") + "' " + rest;
  }
  int simulate() const {
    return run("simulate palpation --mode gel --size 320x240 --rate 2 --radius 5 --quiet --out '" +
               at("rec") + "'");
  }

  fs::path folder_;
};

TEST_F(Calibrate, FindsTheSensorOfASyntheticGel) {
  ASSERT_EQ(simulate(), 0) << text("stderr");
  std::ofstream balls(folder_ / "balls.csv");
  balls << kHeader;
  std::istringstream truth(text("rec/truth.csv"));
  std::string line;
  std::getline(truth, line);
  ASSERT_EQ(line.rfind("frame,time_s,true_contact,", 0), 0u) << line;
  int presses = 0;
  while (std::getline(truth, line)) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    if (cells[2] != "1" || std::stod(cells[9]) < 20) continue;
    char name[32];
    std::snprintf(name, sizeof name, "%06d.png", std::stoi(cells[0]));
    balls << name << ',' << cells[7] << ',' << cells[8] << ',' << cells[9] << ",5\n";
    ++presses;
  }
  balls.close();
  ASSERT_GE(presses, 10);

  ASSERT_EQ(run(calibrate("--json")), 0) << text("stderr");
  const Json found = Json::parse(text("stdout"));
  EXPECT_EQ(found["presses"].size(), static_cast<size_t>(presses));
  EXPECT_EQ(found["ridge"], 0);
  EXPECT_LT(found["normal_rms_held_out"], 0.03);
  EXPECT_NEAR(found["depth_gain_held_out"], 1, 0.03);
  EXPECT_LT(found["depth_rmse_held_out_mm"], 0.02);

  // The simulator knows its own coefficients; near the middle ours say the same of a colour change.
  const Sensor ours = load_sensor(folder_ / "out.json"), its = load_sensor(folder_ / "rec/sensor.json");
  EXPECT_EQ(ours.reading, Reading::Photometric);
  EXPECT_EQ(ours.pitch_mm_per_px, its.pitch_mm_per_px);
  EXPECT_EQ(ours.background.image, at("rec/background.png"));
  double difference = 0, size = 0;
  for (int c = 0; c < 3; ++c) {
    difference += std::pow(ours.photometric.wx[c][0] - its.photometric.wx[c][0], 2);
    size += std::pow(its.photometric.wx[c][0], 2);
  }
  EXPECT_LT(std::sqrt(difference / size), 0.1);
}

TEST_F(Calibrate, RefusesWhatItCannotUse) {
  ASSERT_EQ(simulate(), 0) << text("stderr");
  const auto with = [&](const std::string& rows) {
    std::ofstream(folder_ / "balls.csv") << rows;
    const int code = run(calibrate("--quiet"));
    const std::string said = text("stderr");
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
    EXPECT_FALSE(fs::exists(folder_ / "out.json"));
    return code;
  };
  const std::string press = "000015.png,199.7,148.2,31.1,5\n";
  EXPECT_EQ(with(""), 3);
  EXPECT_EQ(with("image,x,y,r,R\n" + press), 3);
  EXPECT_EQ(with(kHeader), 3);
  EXPECT_EQ(with(kHeader + press), 3);  // one press: none to judge by
  EXPECT_EQ(with(kHeader + press + "000015.png,199.7,148.2,31.1\n"), 3);
  EXPECT_EQ(with(kHeader + press + "000015.png,199.7,148.2,nan,5\n"), 3);
  EXPECT_EQ(with(kHeader + press + "000015.png,199.7,148.2,31.1 px,5\n"), 3);
  EXPECT_EQ(with(kHeader + press + "000015.png,199.7,148.2,80,5\n"), 3);      // larger than the ball
  EXPECT_EQ(with(kHeader + press + "000015.png,-400,148.2,31.1,5\n"), 3);     // outside the frame
  EXPECT_EQ(with(kHeader + press + "000015.png#1,199.7,148.2,31.1,5\n"), 3);  // an image has one frame
  EXPECT_EQ(with(kHeader + press + "nothing.png,199.7,148.2,31.1,5\n"), 3);
  // Nobody presses in frames 0 and 1: no colour changes to learn from.
  EXPECT_EQ(with(kHeader + std::string("000000.png,100,100,30,5\n000001.png,200,100,30,5\n")), 3);
  EXPECT_EQ(run("calibrate photometric '" + at("nowhere") + "' --sensor a --balls b --out c"), 2);
  EXPECT_EQ(run("calibrate"), 2);
}

}  // namespace
}  // namespace palpate
