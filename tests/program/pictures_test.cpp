// Folders of pictures: separate presses unless stated otherwise; and headlines that say what the largest
// value is worth.
#include <algorithm>
#include <cmath>
#include <functional>

#include "capture/files/images/images.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

class Pictures : public Program {
 protected:
  static constexpr int kFrames = 30, kStep = 3;

  /// Some pictures of a press, in a folder of their own: folder_/presses.
  std::vector<std::string> process_of(const std::string& out) {
    const fs::path rec = recording(kFrames), presses = folder_ / "presses";
    fs::create_directories(presses);
    for (int i = 0; i < kFrames; i += kStep) {
      const std::string name = std::to_string(1000000 + i).substr(1) + ".png";
      fs::copy_file(rec / "frames" / name, presses / name, fs::copy_options::overwrite_existing);
    }
    return {"process",      presses.string(),
            "--sensor",     (rec / "sensor.json").string(),
            "--background", (rec / "background.png").string(),
            "--out",        (folder_ / out).string()};
  }
  static bool has(const Table& table, const char* column) {
    return std::ranges::count(table.columns, column) == 1;
  }
};

TEST_F(Pictures, WithoutARateAreSeparatePresses) {
  const Ended ended = run(process_of("out"));
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Table table(slurp(folder_ / "out/measurements.csv"));
  for (const char* column : {"shift_x_mm", "shift_y_mm", "shear_x_N", "shear_state", "slip", "time_s"})
    EXPECT_FALSE(has(table, column)) << column;
  EXPECT_TRUE(has(table, "force_N"));
  const Json summary = parse_json(slurp(folder_ / "out/summary.json"));
  EXPECT_EQ(summary.at("separate_pictures"), true);
  // Each picture that is touched is a touch of its own.
  size_t touched = 0;
  for (size_t i = 0; i < table.rows.size(); ++i) touched += table.at(i, "contact") == "1";
  ASSERT_GE(touched, 2u);
  EXPECT_EQ(summary.at("touches").get<size_t>(), touched);
  const Table touches(slurp(folder_ / "out/summary.csv"));
  ASSERT_EQ(touches.rows.size(), touched);
  for (size_t i = 0; i < touched; ++i) EXPECT_EQ(touches.at(i, "frames"), "1");
  EXPECT_NE(ended.out.find("10 separate pictures, " + std::to_string(touched) + " of them touched"),
            std::string::npos)
      << ended.out;
  EXPECT_NE(ended.out.find("--sequence"), std::string::npos) << ended.out;
  EXPECT_EQ(ended.out.find("1 touch,"), std::string::npos) << ended.out;
}

// What is asked for by name and cannot be had is refused; what the sensor can by itself is left out.
TEST_F(Pictures, HaveNoSkinThatMoves) {
  std::vector<std::string> command = process_of("out");
  command.insert(command.end(), {"--outputs", "force,skin", "--quiet"});
  const Ended refused = run(command);
  EXPECT_EQ(refused.exit_code, 2) << refused.out;
  EXPECT_EQ(std::ranges::count(refused.err, '\n'), 1) << refused.err;
  for (const char* word : {"for the output skin", "each of them a press of its own", "--sequence"})
    EXPECT_NE(refused.err.find(word), std::string::npos) << refused.err;
  command[0] = "record";
  EXPECT_EQ(run(command).exit_code, 2);
  EXPECT_FALSE(fs::exists(folder_ / "out/session.json"));
  command.push_back("--sequence");
  EXPECT_EQ(run(command).err.find("press of its own"), std::string::npos);
}

TEST_F(Pictures, AreOneSequenceWhereThatIsSaid) {
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--sequence"}, std::vector<std::string>{"--rate", "10"}}) {
    std::vector<std::string> command = process_of("out");
    command.insert(command.end(), more.begin(), more.end());
    const Ended ended = run(command);
    ASSERT_EQ(ended.exit_code, 0) << ended.err;
    const Table table(slurp(folder_ / "out/measurements.csv"));
    EXPECT_TRUE(has(table, "shift_x_mm")) << more[0];
    EXPECT_EQ(has(table, "time_s"), more[0] == "--rate");
    const Json summary = parse_json(slurp(folder_ / "out/summary.json"));
    EXPECT_FALSE(summary.contains("separate_pictures"));
    EXPECT_EQ(summary.at("touches"), 1);
    EXPECT_NE(ended.out.find("1 touch,"), std::string::npos) << ended.out;
  }
}

// A weak press, a strong one and the weak one again: the sensor's force has a curve for loading and one for
// unloading, and which of them holds is known within a sequence only.
TEST_F(Pictures, OfOneTouchGiveOneStrainAndOneModulus) {
  const fs::path rec = recording(kFrames), three = folder_ / "three";
  fs::create_directories(three);
  for (const auto& [from, to] :
       {std::pair{"000023.png", "0.png"}, {"000028.png", "1.png"}, {"000023.png", "2.png"}})
    fs::copy_file(rec / "frames" / from, three / to);
  Json sensor = parse_json(slurp(rec / "sensor.json"));
  Json& force = sensor["force"];
  for (const auto& [curve, factor] : {std::pair{"loading", 1.1}, {"unloading", 0.9}})
    force[curve] = {{"c0_N", 0},
                    {"c1", factor * force.at("c1_N_per_gray").get<double>()},
                    {"residual_sd_N", force.at("residual_sd_N")}};
  spill(rec / "both.json", sensor.dump());
  const auto command = [&](const char* name, std::vector<std::string> more, bool sequence) {
    std::vector<std::string> words = {
        name,     three,    "--sensor", rec / "both.json", "--background", rec / "background.png",
        "--json", "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    if (sequence) words.emplace_back("--sequence");
    return run(words);
  };
  for (const bool sequence : {false, true}) {
    const Ended strain = command("strain", {"--frames", "0,2"}, sequence);
    ASSERT_EQ(strain.exit_code, 0) << strain.err;
    const Json answer = parse_json(strain.out);
    const double before_N = answer["before"]["force_N"], after_N = answer["after"]["force_N"];
    ASSERT_GT(before_N, 0);
    EXPECT_EQ(after_N == before_N, !sequence) << before_N << " N, " << after_N << " N";
    EXPECT_EQ(answer.contains("separate_pictures"), !sequence);

    const Ended modulus =
        command("modulus", {"--sample", "sphere,20mm", "--out", folder_ / "modulus"}, sequence);
    ASSERT_EQ(modulus.exit_code, 0) << modulus.err;
    EXPECT_EQ(modulus.out.find("each is a press of its own") != std::string::npos, !sequence);
    const Table presses(slurp(folder_ / "modulus/presses.csv"));
    ASSERT_EQ(presses.rows.size(), 3u);
    EXPECT_EQ(presses.at(0, "force_N") == presses.at(1, "force_N"), !sequence)
        << slurp(folder_ / "modulus/presses.csv");
  }
  // The strong one lies between them: in any order it is the peak, and its half is there.
  fs::rename(three / "0.png", three / "3.png");
  EXPECT_EQ(command("strain", {}, false).exit_code, 0);
  EXPECT_EQ(command("strain", {}, true).exit_code, 3) << "none before the peak";
}

// A wide press hides which light it is seen under: small ones of the same series say so, whatever measures
// it.
class PicturesOfASeries : public Pictures {
 protected:
  /// Frames of a scene, `brighter` gray levels above what they were.
  void add(const fs::path& folder, const char* scene, const std::vector<uint64_t>& frames, int brighter) {
    fs::create_directories(folder);
    SyntheticRun run(scene);
    for (const uint64_t k : frames) {
      Frame frame = run.frame(k);
      for (uint8_t& gray : frame.bytes) gray = static_cast<uint8_t>(std::min(gray + brighter, 250));
      const std::vector<uint8_t> png = encode_image(frame, ".png");
      spill(folder / (std::to_string(pictures_++) + ".png"), std::string(png.begin(), png.end()));
    }
  }
  /// The first number that `read` finds in what a command makes of a folder's pictures.
  double value_of(const std::string& folder, std::vector<std::string> command,
                  const std::function<double(const fs::path& out, const std::string& text)>& read) {
    const fs::path out = folder_ / (command.front() + "_" + folder);
    command.insert(command.begin() + 1, (folder_ / folder).string());
    for (const fs::path& more : {fs::path("--sensor"), folder_ / "gel.json", fs::path("--background"),
                                 folder_ / "untouched.png", fs::path("--quiet")})
      command.push_back(more.string());
    if (command.front() != "strain") command.insert(command.end(), {"--out", out.string()});
    const Ended ended = run(command);
    EXPECT_EQ(ended.exit_code, 0) << command.front() << ": " << ended.err;
    return ended.exit_code == 0 ? read(out, ended.out) : 0;
  }

 private:
  int pictures_ = 100;
};

TEST_F(PicturesOfASeries, ShareTheirLightWhateverMeasuresThem) {
  constexpr const char *kWide = "press?mode=gel&size=320x240&rate=5&radius=20&force=5",
                       *kSmall = "press?mode=gel&size=320x240&rate=5&radius=4&force=1";
  for (const auto& [folder, brighter] : {std::pair{"series", 4}, {"alone", 4}, {"truth", 0}}) {
    add(folder_ / folder, kWide, {23, 12}, brighter);
    if (folder != std::string("alone"))
      add(folder_ / folder, kSmall, {5, 12, 14, 20, 23, 25, 28, 32}, brighter);
  }
  SyntheticRun run(kWide);
  run.sensor.force = ForceCalibration{.c1_N_per_gray = 1e-5, .residual_sd_N = 0.01, .gray_max = 1e9};
  spill(folder_ / "gel.json", sensor_text(run.sensor));
  const std::vector<uint8_t> png = encode_image(run.background, ".png");
  spill(folder_ / "untouched.png", std::string(png.begin(), png.end()));

  const auto cell = [](const char* file, const char* column) {
    return
        [=](const fs::path& out, const std::string&) { return Table(slurp(out / file)).number(0, column); };
  };
  using Command = std::pair<std::vector<std::string>,
                            std::function<double(const fs::path& out, const std::string& text)>>;
  for (const auto& [command, read] : std::vector<Command>{
           {{"process"}, cell("measurements.csv", "depth_max_mm")},
           {{"record"}, cell("frames.csv", "depth_max_mm")},
           {{"wrench"}, cell("wrench.csv", "fz_N")},
           {{"modulus", "--sample", "sphere,40mm", "--pad-kPa", "200", "--pad-thickness-mm", "6"},
            cell("presses.csv", "force_N")},
           {{"strain", "--frames", "0,1", "--json"}, [](const fs::path&, const std::string& text) {
              return parse_json(text)["before"]["force_N"].get<double>();
            }}}) {
    const double truth = value_of("truth", command, read);
    ASSERT_GT(truth, 0.1) << command.front();
    const double alone = std::abs(value_of("alone", command, read) - truth);
    EXPECT_LT(std::abs(value_of("series", command, read) - truth), 0.5 * alone) << command.front();
  }
}

TEST_F(Pictures, AFilmIsOneSequenceByItself) {
  const Ended ended =
      run({"process", "synthetic:press?size=160x120", "--frames", "30", "--out", folder_ / "out"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_EQ(ended.out.find("separate"), std::string::npos) << ended.out;
  EXPECT_TRUE(has(Table(slurp(folder_ / "out/measurements.csv")), "shift_x_mm"));
}

TEST_F(Pictures, ARateForAFilmIsSaidNotToBeUsed) {
  for (const char* rate : {"7", ""}) {
    std::vector<std::string> command = {"process",  "synthetic:press?size=96x72&rate=20",
                                        "--frames", "5",
                                        "--out",    (folder_ / "out").string()};
    if (*rate) command.insert(command.end(), {"--rate", rate});
    const Ended ended = run(command);
    ASSERT_EQ(ended.exit_code, 0) << ended.err;
    const bool said = ended.out.find(
                          "the rate of 7 frames/s is not used: the recording has times of its own "
                          "(20 frames/s)") != std::string::npos;
    EXPECT_EQ(said, *rate != 0) << ended.out;
    const Table table(slurp(folder_ / "out/measurements.csv"));
    EXPECT_NEAR(table.number(4, "time_s"), 0.2, 1e-9);
  }
}

// A calibration up to a tenth of what is pressed, and one that is not fit for use.
TEST_F(Pictures, TheHeadlineSaysWhatTheLargestForceIsWorth) {
  std::vector<std::string> command = process_of("out");
  ASSERT_EQ(run(command).exit_code, 0);
  const Table table(slurp(folder_ / "out/measurements.csv"));
  double most_N = 0, most_gray = 0;
  for (size_t i = 0; i < table.rows.size(); ++i)
    if (table.at(i, "contact") == "1") {
      most_N = std::max(most_N, table.number(i, "force_N"));
      most_gray = std::max(most_gray, table.number(i, "gray_sum"));
    }
  const Json valid = parse_json(slurp(folder_ / "out/summary.json"));
  EXPECT_EQ(valid.at("largest_force_state"), "valid");
  EXPECT_FALSE(valid.contains("largest_valid_force_N"));

  const fs::path file = folder_ / "rec/sensor.json";
  Json sensor = parse_json(slurp(file));
  sensor["force"]["gray_max"] = 0.9 * most_gray;
  spill(file, sensor.dump());
  command[3] = (folder_ / "rec/sensor.json").string();
  const auto again = [&] {
    const Ended ended = run({command.begin(), command.end()});
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return ended.out.substr(0, ended.out.find('\n'));
  };
  const std::string above = again();
  EXPECT_NE(above.find(" N (above calibrated range; the largest valid one "), std::string::npos) << above;
  const Json doubtful = parse_json(slurp(folder_ / "out/summary.json"));
  EXPECT_EQ(doubtful.at("largest_force_state"), "above calibrated range");
  EXPECT_NEAR(doubtful.at("largest_force_N").get<double>(), most_N, 0.02 * most_N);
  EXPECT_LT(doubtful.at("largest_valid_force_N").get<double>(), most_N);

  sensor["force"]["fit_for_use"] = false;
  spill(file, sensor.dump());
  const std::string unfit = again();
  EXPECT_NE(unfit.find(" N (calibration not fit for use)"), std::string::npos) << unfit;
  EXPECT_EQ(unfit.find("valid one"), std::string::npos) << unfit;
}

}  // namespace
}  // namespace palpate
