// palpate calibrate photometric on the command line: from a synthetic gel's presses to a sensor file that
// measures.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "engine/base/text.h"
#include "palpate/sensor.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

constexpr const char* kHeader = "image,center_x_px,center_y_px,contact_radius_px,ball_radius_mm\n";

class Calibrate : public TypedProgram {
 protected:
  std::string calibrate(const std::string& rest) const {
    return "calibrate photometric '" + at("rec/frames") + "' --sensor '" + at("rec/sensor.json") +
           "' --balls '" + at("balls.csv") + "' --background '" + at("rec/background.png") + "' --out '" +
           at("out.json") + "' " + rest;
  }
  int simulate() {
    return run("simulate palpation --mode gel --size 320x240 --rate 2 --radius 5 --quiet --out '" +
               at("rec") + "'");
  }
};

TEST_F(Calibrate, FindsTheSensorOfASyntheticGel) {
  ASSERT_EQ(simulate(), 0) << text("stderr");
  std::ofstream balls(folder_ / "balls.csv");
  balls << kHeader;
  const Table truth(text("rec/truth.csv"));
  ASSERT_GE(truth.columns.size(), 3u);
  ASSERT_EQ(truth.columns[0], "frame");
  ASSERT_EQ(truth.columns[1], "time_s");
  ASSERT_EQ(truth.columns[2], "true_contact");
  int presses = 0;
  for (const std::vector<std::string>& cells : truth.rows) {
    if (cells[2] != "1" || std::stod(cells[9]) < 20) continue;
    balls << palpate::text("%06d.png", std::stoi(cells[0])) << ',' << cells[7] << ',' << cells[8] << ','
          << cells[9] << ",5\n";
    ++presses;
  }
  balls.close();
  ASSERT_GE(presses, 10);

  ASSERT_EQ(run(calibrate("--json")), 0) << text("stderr");
  const Json found = parse_json(text("stdout"));
  EXPECT_EQ(found["presses"].size(), static_cast<size_t>(presses));
  EXPECT_EQ(found["ridge"], 0);
  EXPECT_LT(found["normal_rms_held_out"], 0.03);
  EXPECT_NEAR(found["depth_gain_held_out"], 1, 0.03);
  EXPECT_LT(found["depth_rmse_held_out_mm"], 0.02);

  // The simulator knows its own coefficients; near the middle ours say the same of a colour change.
  const Sensor ours = load_sensor(folder_ / "out.json"), its = load_sensor(folder_ / "rec/sensor.json");
  EXPECT_EQ(ours.reading, SurfaceReading::Photometric);
  EXPECT_EQ(ours.pitch_mm_per_px, its.pitch_mm_per_px);
  EXPECT_EQ(ours.background.image, at("out_background.png"));
  double difference = 0, size = 0;
  for (int c = 0; c < 3; ++c) {
    difference += std::pow(ours.photometric.wx[c][0] - its.photometric.wx[c][0], 2);
    size += std::pow(its.photometric.wx[c][0], 2);
  }
  EXPECT_LT(std::sqrt(difference / size), 0.1);
}

TEST_F(Calibrate, FindsTheBallsByItself) {
  ASSERT_EQ(simulate(), 0) << text("stderr");
  const std::string rest = "' --sensor '" + at("rec/sensor.json") + "' --background '" +
                           at("rec/background.png") + "' --out '" + at("out.json") + "' ";
  const std::string frames = "calibrate photometric '" + at("rec/frames") + rest;
  ASSERT_EQ(run(frames + "--ball-mm 5 --json"), 0) << text("stderr");
  const Json found = parse_json(text("stdout"));
  EXPECT_GE(found["presses"].size(), 8u);
  EXPECT_GE(found["untouched_frames"], 2);
  EXPECT_FALSE(found["markers_masked"]);
  std::printf("held out: depth %.4f mm, normals %.2f deg, gain %.3f\n",
              found["depth_rmse_held_out_mm"].get<double>(), found["normal_angle_deg_held_out"].get<double>(),
              found["depth_gain_held_out"].get<double>());
  EXPECT_LT(found["depth_rmse_held_out_mm"], 0.006);
  EXPECT_LT(found["normal_angle_deg_held_out"], 1.5);
  EXPECT_NEAR(found["depth_gain_held_out"], 1, 0.01);
  const Sensor ours = load_sensor(folder_ / "out.json");
  EXPECT_EQ(ours.size_px, (std::array<uint32_t, 2>{320, 240}));
  EXPECT_FALSE(ours.photometric.origin.empty());
  ASSERT_EQ(run(frames + "--shape ball:radius=5 --json"), 0) << text("stderr");
  EXPECT_EQ(parse_json(text("stdout"))["presses"], found["presses"]);

  // Where each press stands in the truth is where it was found.
  std::map<int, std::array<double, 3>> truth;
  for (const std::vector<std::string>& cells : Table(text("rec/truth.csv")).rows) {
    if (cells[2] == "1")
      truth[std::stoi(cells[0])] = {std::stod(cells[7]), std::stod(cells[8]), std::stod(cells[9])};
  }
  for (const Json& p : found["presses"]) {
    const auto it = truth.find(std::stoi(p["press"].get<std::string>()));
    ASSERT_NE(it, truth.end()) << p["press"];
    EXPECT_NEAR(p["center_x_px"], it->second[0], 0.3);
    EXPECT_NEAR(p["center_y_px"], it->second[1], 0.3);
    EXPECT_NEAR(p["contact_radius_px"], it->second[2], 0.03 * it->second[2]);
  }
  fs::remove(folder_ / "out.json");

  const auto refused = [&](const std::string& arguments, int code, const std::string& says) {
    EXPECT_EQ(run(arguments + " --quiet"), code) << arguments;
    EXPECT_NE(text("stderr").find(says), std::string::npos) << text("stderr");
    EXPECT_FALSE(fs::exists(folder_ / "out.json"));
  };
  refused(frames + "--ball-mm 1", 3, "wider than the ball");
  refused(frames, 2, "--ball-mm");
  refused(frames + "--ball-mm 5 --shape cylinder:radius=5", 2, "several of them");
  refused(frames + "--shape cylinder:radius=5", 3, "a cylinder of 5 mm radius");
  refused(frames + "--shape cone:half-angle=60:tip-radius", 2, "tip-radius of 0.001 to 1000 mm");
  // Nothing but untouched frames.
  fs::create_directories(folder_ / "rest");
  for (const char* name : {"1.png", "2.png", "3.png"})
    fs::copy_file(folder_ / "rec/background.png", folder_ / "rest" / name);
  refused("calibrate photometric '" + at("rest") + rest + "--ball-mm 5", 3, "3 untouched frames");
  // A sensor file of another size, another number of channels.
  Sensor other = load_sensor(folder_ / "rec/sensor.json");
  other.size_px = {640, 480};
  other.background.image.clear();
  save_sensor(other, folder_ / "other.json");
  refused("calibrate photometric '" + at("rec/frames") + "' --ball-mm 5 --sensor '" + at("other.json") +
              "' --out '" + at("out.json") + "'",
          3, "640x480");
  refused("calibrate lookup '" + at("rec/frames") + rest + "--ball-mm 5", 4, "gray sensor");
}

// The error is the same share of the caps whatever size is stated, and the shading shows which size is right.
TEST_F(Calibrate, ADiameterGivenForTheRadiusIsNamedOrRefused) {
  ASSERT_EQ(simulate(), 0) << text("stderr");
  const std::string frames = "calibrate photometric '" + at("rec/frames") + "' --sensor '" +
                             at("rec/sensor.json") + "' --background '" + at("rec/background.png") +
                             "' --quiet --json --out '" + at("out.json") + "' ";
  const auto share = [&](const std::string& size) {
    EXPECT_EQ(run(frames + size), 0) << size << ": " << text("stderr");
    EXPECT_TRUE(fs::exists(folder_ / "out.json")) << size;
    fs::remove(folder_ / "out.json");
    return parse_json(text("stdout"));
  };
  const Json right = share("--ball-radius-mm 5"), by_diameter = share("--ball-diameter-mm 10"),
             insisted = share("--ball-radius-mm 10");
  EXPECT_EQ(right["doubt"], "");
  EXPECT_EQ(right["depth_rmse_held_out_mm"], by_diameter["depth_rmse_held_out_mm"]);
  EXPECT_NE(insisted["doubt"].get<std::string>().find("diameter"), std::string::npos);
  EXPECT_NEAR(insisted["depth_share_of_caps"].get<double>(), right["depth_share_of_caps"].get<double>(),
              0.5 * right["depth_share_of_caps"].get<double>());
  EXPECT_LT(insisted["depth_rmse_held_out_mm"].get<double>(),
            0.75 * right["depth_rmse_held_out_mm"].get<double>());
  // The verdict is the first line, with the scatter and the selection.
  const std::string verdict = right["verdict"];
  for (const char* word : {"mm RMS", "% of the caps", "depth gain", "from ", " px) to "})
    EXPECT_NE(verdict.find(word), std::string::npos) << word << " in: " << verdict;

  const auto refused = [&](const std::string& size, int code, const std::string& says) {
    EXPECT_EQ(run(frames + size), code) << size;
    EXPECT_NE(text("stderr").find(says), std::string::npos) << text("stderr");
    EXPECT_FALSE(fs::exists(folder_ / "out.json")) << size;
  };
  refused("--ball-mm 10", 3, "--ball-diameter-mm 10");
  refused("--ball-radius-mm 31", 3, "as under a ball of");
  refused("--ball-diameter-mm 31 --ball-radius-mm 5", 2, "once");
  // Some presses of the same ball are wider, others are not: nothing is fitted to those.
  refused("--ball-radius-mm 2.3", 3, "wider than the ball");
}

// From nothing but pictures, a scale and a ball: what measures afterwards is in the sensor file.
TEST_F(Calibrate, PressesSayWhatAContactIsAndTheUntouchedImageIsKept) {
  ASSERT_EQ(simulate(), 0) << text("stderr");
  std::ofstream(folder_ / "bare.json")
      << palpate::text(R"({"palpate_sensor":1,"name":"bare","pitch_mm_per_px":%.8g,)"
                       R"("frame":{"channels":3,"bit_depth":8}})",
                       load_sensor(folder_ / "rec/sensor.json").pitch_mm_per_px);
  const std::string command = "calibrate photometric '" + at("rec/frames") + "' --sensor '" +
                              at("bare.json") + "' --ball-mm 5 --background '" + at("rec/background.png") +
                              "' --json --out '";
  ASSERT_EQ(run(command + at("ours.json") + "'"), 0) << text("stderr");
  const Json contact = parse_json(text("stdout"))["contact"];
  const Sensor ours = load_sensor(folder_ / "ours.json");
  EXPECT_EQ(ours.signal, Signal::Either);  // one side of a ball is brighter, the other darker
  EXPECT_GT(contact["contact_gray"], ours.threshold_gray);
  EXPECT_GT(ours.threshold_gray, contact["untouched_gray"].get<double>());
  EXPECT_NEAR(ours.gradient_gray_per_px, contact["gradient_gray_per_px"].get<double>(), 1e-9);
  EXPECT_EQ(ours.background.image, at("ours_background.png"));
  EXPECT_EQ(text("ours_background.png"), text("rec/background.png"));
  ASSERT_EQ(run(command + at("kept.json") + "' --keep-contact"), 0) << text("stderr");
  EXPECT_EQ(load_sensor(folder_ / "kept.json").signal,
            Signal::Brighter);  // The image that was given is not needed any more.
  fs::remove(folder_ / "rec/background.png");
  ASSERT_EQ(run("process '" + at("rec/frames") + "' --sensor '" + at("ours.json") + "' --quiet --out '" +
                at("measured") + "'"),
            0)
      << text("stderr");
  const Table measured(text("measured/measurements.csv")), truth(text("rec/truth.csv"));
  const std::vector<double> touching = truth.numbers("true_contact"), area = truth.numbers("true_radius_px"),
                            contacts = measured.numbers("contacts");
  ASSERT_EQ(touching.size(), contacts.size());
  int clear = 0, one = 0, none = 0, untouched = 0;
  for (size_t i = 0; i < contacts.size(); ++i) {
    if (touching[i] == 0) ++untouched, none += contacts[i] == 0;
    if (touching[i] == 1 && area[i] > 20) ++clear, one += contacts[i] == 1;
  }
  ASSERT_GE(clear, 10);
  EXPECT_EQ(one, clear);
  EXPECT_EQ(none, untouched);
}

// A calibration asks for nothing that it makes itself, and starts from the pictures alone.
TEST_F(Calibrate, StartsWithoutASensorFile) {
  ASSERT_EQ(simulate(), 0) << text("stderr");
  const double pitch = load_sensor(folder_ / "rec/sensor.json").pitch_mm_per_px;
  const std::string presses = "calibrate photometric '" + at("rec/frames") + "' --ball-mm 5 --background '" +
                              at("rec/background.png") + "' --quiet --out '" + at("gel.json") + "'",
                    scale = palpate::text(" --pitch %.10g", pitch);
  EXPECT_EQ(run(presses), 2);
  EXPECT_NE(text("stderr").find("--pitch"), std::string::npos) << text("stderr");
  ASSERT_EQ(run(presses + scale), 0) << text("stderr");
  const Sensor from_nothing = load_sensor(folder_ / "gel.json");
  EXPECT_EQ(from_nothing.name, "gel");
  EXPECT_EQ(from_nothing.channels, 3u);
  EXPECT_NEAR(from_nothing.pitch_mm_per_px, pitch, 1e-9);
  // A file that says how the surface is to be read, and has no weights for it yet.
  std::ofstream(folder_ / "begun.json")
      << R"({"palpate_sensor":1,"frame":{"channels":3},"surface":{"reading":"photometric","max_slope":2}})";
  EXPECT_EQ(
      run("process '" + at("rec/frames") + "' --sensor '" + at("begun.json") + "' --out '" + at("o") + "'"),
      4);
  ASSERT_EQ(run(presses + scale + " --sensor '" + at("begun.json") + "'"), 0) << text("stderr");
  const Sensor from_begun = load_sensor(folder_ / "gel.json");
  EXPECT_EQ(from_begun.reading, SurfaceReading::Photometric);
  EXPECT_EQ(from_begun.max_slope, 2);
  EXPECT_EQ(from_begun.photometric.wx, from_nothing.photometric.wx);
  // Frames without a sensor file are measured in pixels.
  ASSERT_EQ(run("process '" + at("rec/frames") + "' --background '" + at("rec/background.png") +
                "' --quiet --out '" + at("bare") + "'"),
            0)
      << text("stderr");
  const Table bare(text("bare/measurements.csv"));
  EXPECT_EQ(std::count(bare.columns.begin(), bare.columns.end(), "ellipse_major_px"), 1);
  EXPECT_EQ(std::count(bare.columns.begin(), bare.columns.end(), "area_mm2"), 0);
}

TEST_F(Calibrate, BackgroundFlatAndScaleWriteSensorFilesThatLoad) {
  ASSERT_EQ(run("simulate press --mode waveguide --size 160x120 --rate 20 --quiet --out '" + at("rec") + "'"),
            0)
      << text("stderr");
  const std::string frames =
      " '" + at("rec/frames") + "' --sensor '" + at("rec/sensor.json") + "' --out '" + at("out.json") + "' ";
  ASSERT_EQ(run("calibrate background" + frames + "--frames 6 --set-threshold --json"), 0) << text("stderr");
  Json found = parse_json(text("stdout"));
  EXPECT_EQ(found["frames_used"], 6);
  EXPECT_EQ(found["warning"], "");
  EXPECT_GT(found["noise_gray"], 0.2);
  EXPECT_LT(found["noise_gray"], 3);
  const Sensor with = load_sensor(folder_ / "out.json");
  EXPECT_EQ(with.background.image, at("out_background.png"));
  EXPECT_EQ(with.threshold_gray, found["suggested_threshold_gray"]);
  EXPECT_LE(found["untouched_frames_that_touch"].get<double>(),
            0.1 * found["untouched_frames"].get<double>());
  EXPECT_GT(found["touched_frames"], 10);
  const size_t untouched = found["untouched_frames"].get<size_t>();

  // Without a sensor file: what a touch does to the picture is found too.
  ASSERT_EQ(run("calibrate background '" + at("rec/frames") + "' --json --out '" + at("own.json") + "'"), 0)
      << text("stderr");
  EXPECT_EQ(parse_json(text("stdout"))["signal"], "brighter");
  EXPECT_EQ(load_sensor(folder_ / "own.json").signal, Signal::Brighter);
  // The same pictures backwards: what is untouched is found at the end.
  const Table truth(text("rec/truth.csv"));
  fs::create_directories(at("backwards"));
  std::vector<fs::path> pictures;
  for (const auto& entry : fs::directory_iterator(at("rec/frames")))
    if (entry.path().extension() == ".png") pictures.push_back(entry.path());
  std::ranges::sort(pictures);
  // From the deepest press on, so that the recording begins touched and ends untouched.
  size_t deepest = 0;
  for (size_t i = 0; i < truth.rows.size(); ++i)
    if (truth.number(i, "true_force_N") > truth.number(deepest, "true_force_N")) deepest = i;
  for (size_t i = 0; i <= deepest; ++i)
    fs::copy_file(pictures[deepest - i], at("backwards/" + std::to_string(1000 + i) + ".png"));
  ASSERT_EQ(run("calibrate background '" + at("backwards") + "' --sensor '" + at("rec/sensor.json") +
                "' --json --out '" + at("own.json") + "'"),
            0)
      << text("stderr");
  found = parse_json(text("stdout"));
  size_t right = 0;
  for (const Json& number : found["untouched"]) {
    const size_t frame = deepest - number.get<size_t>();
    EXPECT_LT(truth.number(frame, "true_force_N"), 0.05) << "frame " << frame;
    right += truth.number(frame, "true_force_N") == 0;
  }
  EXPECT_GE(right, 3u);
  EXPECT_GE(untouched, right);
  // A picture of the pad at rest is enough; a frame that is known to be touched is what was asked for.
  ASSERT_EQ(
      run("calibrate background '" + pictures.front().string() + "' --json --out '" + at("one.json") + "'"),
      0)
      << text("stderr");
  found = parse_json(text("stdout"));
  EXPECT_EQ(found["frames_used"], 1);
  EXPECT_EQ(found["noise_gray"], 0);
  EXPECT_EQ(
      run("calibrate background '" + at("backwards") + "' --like 9999 --quiet --out '" + at("o.json") + "'"),
      3);
  EXPECT_NE(text("stderr").find("frame 9999"), std::string::npos) << text("stderr");

  ASSERT_EQ(run("calibrate flat" + frames + "--frames 6 --json"), 0) << text("stderr");
  found = parse_json(text("stdout"));
  EXPECT_LT(found["unevenness_after"], 0.3 * found["unevenness_before"].get<double>());
  EXPECT_EQ(load_sensor(folder_ / "out.json").flat->image, at("out_flat.png"));

  fs::remove(folder_ / "out.json");
  EXPECT_EQ(run("calibrate scale '" + pictures.front().string() + "' --sensor '" + at("rec/sensor.json") +
                "' --out '" + at("out.json") + "' --grid 9x6 --spacing-mm 2 --quiet"),
            3);
  EXPECT_EQ(run("calibrate scale" + frames + "--grid 9by6 --spacing-mm 2 --quiet"), 2);
  EXPECT_EQ(run("calibrate scale" + frames + "--quiet"), 2);
  // A ball alone: refused, with what it does say.
  EXPECT_EQ(
      run("calibrate scale" + frames + "--ball-mm 8 --background '" + at("rec/background.png") + "' --quiet"),
      3);
  EXPECT_NE(text("stderr").find("pitch is below"), std::string::npos) << text("stderr");
  EXPECT_FALSE(fs::exists(folder_ / "out.json"));
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
