// palpate check: a calibration that is still true, and what makes it untrue.
#include <gtest/gtest.h>

#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/calibrate/force/weighed_presses.h"
#include "capture/open_source.h"
#include "capture/synthetic/synthetic.h"
#include "palpate/sensor.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

/// A gel that was set up from presses of a ball of 8 mm radius, and presses of the same gel with other noise.
class CheckCommand : public TypedProgram {
 protected:
  void SetUp() override {
    TypedProgram::SetUp();
    if (made_.empty())
      make_recordings();
    else
      for (const char* name : {"calibrated", "today"})
        fs::create_directory_symlink(made_ / name, folder_ / name);
    if (!HasFatalFailure()) save_sensor(load_sensor(made_ / "made.json"), folder_ / "own.json");
  }
  void TearDown() override {
    if (folder_ != made_) TypedProgram::TearDown();
  }
  static void TearDownTestSuite() { fs::remove_all(made_); }
  /// In the folder of the first test, which stays for the others.
  void make_recordings() {
    simulate("calibrated", 1);
    simulate("today", 2);
    const double pitch = load_sensor(folder_ / "calibrated/sensor.json").pitch_mm_per_px;
    ASSERT_EQ(TypedProgram::run("setup " + frames("calibrated") + " --ball-radius-mm 8 --pitch " +
                                std::to_string(pitch) + " --quiet --out '" + at("made.json") + "'"),
              0)
        << text("stderr");
    made_ = folder_;
  }
  void simulate(const std::string& name, int seed) {
    ASSERT_EQ(TypedProgram::run("simulate palpation --mode gel --size 320x240 --rate 2 --quiet --seed " +
                                std::to_string(seed) + " --out '" + at(name) + "'"),
              0)
        << text("stderr");
  }
  std::string frames(const std::string& name) const { return "'" + at(name + "/frames") + "'"; }
  /// Today's frames, each changed.
  std::string changed(const std::function<void(cv::Mat&)>& change) {
    const fs::path to = folder_ / "changed/frames";
    fs::create_directories(to);
    for (const auto& entry : fs::directory_iterator(folder_ / "today/frames")) {
      cv::Mat image = cv::imread(entry.path().string(), cv::IMREAD_COLOR);
      change(image);
      cv::imwrite((to / entry.path().filename()).string(), image);
    }
    return frames("changed");
  }
  /// The first frame, in which nothing touches.
  std::string first_of(const std::string& name) const {
    std::string first;
    for (const auto& entry : fs::directory_iterator(folder_ / name / "frames"))
      if (first.empty() || entry.path().string() < first) first = entry.path().string();
    return first;
  }
  Json check(const std::string& input, int exit_code, const std::string& options = "--ball-radius-mm 8") {
    const std::string typed = "check '" + at("own.json") + "' " + input + " " + options + " --quiet --json";
    EXPECT_EQ(TypedProgram::run(typed), exit_code) << text("stderr") << text("stdout");
    Json found = parse_json(text("stdout"));
    EXPECT_EQ(found.at("holds").get<bool>(), exit_code == 0) << found.dump(2);
    EXPECT_EQ(found.at("sentence").get<std::string>().starts_with("as calibrated: "), exit_code == 0);
    return found;
  }
  static Json row(const Json& found, const std::string& name) {
    for (const Json& one : found.at("rows"))
      if (one.at("name") == name) return one;
    ADD_FAILURE() << "no row " << name << " in " << found.dump(2);
    return {};
  }
  static inline fs::path made_{};

  static std::string state(const Json& found, const std::string& name) {
    return row(found, name).at("state");
  }
};

TEST_F(CheckCommand, TheSameGelIsAsCalibrated) {
  const Json found = check(frames("today"), 0);
  for (const char* name :
       {"same pad", "brightness", "colours", "pattern", "specks", "flaws", "noise", "ball"})
    EXPECT_EQ(state(found, name), "as calibrated") << found.dump(2);
  EXPECT_NEAR(row(found, "ball").at("value").get<double>(), 1, 0.1);
  EXPECT_TRUE(found.at("again").empty());
  // Without a ball the pad alone is judged, and the ball is said not to be.
  EXPECT_EQ(state(check(frames("today"), 0, ""), "ball"), "not judged");
}

TEST_F(CheckCommand, AnotherExposureIsNamedAndWhatItAsksForMakesItTrueAgain) {
  const std::string darker = changed([](cv::Mat& image) { image.convertTo(image, -1, 0.85); });
  const Json found = check(darker, 3);
  EXPECT_EQ(state(found, "brightness"), "changed");
  EXPECT_NEAR(row(found, "brightness").at("value").get<double>(), -15, 2);
  EXPECT_EQ(state(found, "colours"), "as calibrated");
  const std::string sentence = found.at("sentence");
  EXPECT_NE(sentence.find("needs the untouched image and the surface again"), std::string::npos) << sentence;
  ASSERT_EQ(found.at("again").size(), 2u);
  for (const Json& remedy : found.at("again")) {
    const std::string command = remedy.at("command");
    EXPECT_NE(sentence.find(command), std::string::npos) << sentence;
    ASSERT_TRUE(command.starts_with("palpate ")) << command;
    ASSERT_EQ(TypedProgram::run(command.substr(8) + " --quiet"), 0) << command << "\n" << text("stderr");
  }
  check(darker, 0);
}

TEST_F(CheckCommand, AnotherWhiteBalanceIsNamed) {
  const Json found = check(changed([](cv::Mat& image) {
                             cv::multiply(image, cv::Scalar(1, 1, 0.85), image);  // blue, green, red
                           }),
                           3, "");
  EXPECT_EQ(state(found, "colours"), "changed") << found.dump(2);
  EXPECT_NE(row(found, "colours").at("what").get<std::string>().find("red -1"), std::string::npos);
}

TEST_F(CheckCommand, ASpeckAsksForTheUntouchedImageAlone) {
  const std::string dirty = changed([](cv::Mat& image) {
    cv::circle(image, {40, 40}, 8, {20, 20, 20}, cv::FILLED);
  });
  // Every frame shows it, so that the pad at rest has to be given.
  const Json found = check(dirty, 3, "--background '" + first_of("changed") + "'");
  EXPECT_EQ(state(found, "specks"), "changed");
  EXPECT_GT(row(found, "specks").at("value").get<double>(), 150);
  EXPECT_EQ(state(found, "brightness"), "as calibrated");
  ASSERT_EQ(found.at("again").size(), 1u) << found.dump(2);
  EXPECT_EQ(found.at("again")[0].at("step"), "the untouched image");
}

TEST_F(CheckCommand, AHairOnThePadIsNamedAndProcessFillsIt) {
  const std::string dirty = changed([](cv::Mat& image) {
    cv::line(image, {30, 40}, {150, 60}, {20, 20, 20}, 2, cv::LINE_AA);
  });
  // With the pad at rest, and by presses alone.
  for (const std::string& rest : {" --background '" + first_of("changed") + "'", std::string()}) {
    const Json found = check(dirty, 3, rest);
    EXPECT_EQ(state(found, "flaws"), "changed") << found.dump(2);
    EXPECT_NE(row(found, "flaws").at("what").get<std::string>().find("in 1 thin place"), std::string::npos)
        << found.dump(2);
    EXPECT_NE(state(found, "pattern"), "changed");
    EXPECT_NE(found.at("sentence").get<std::string>().find("the untouched image again"), std::string::npos);
  }
  for (const std::string& pictures : {frames("today"), dirty}) {
    ASSERT_EQ(TypedProgram::run("process " + pictures + " --sensor '" + at("own.json") + "' --quiet --out '" +
                                at("out") + "'"),
              0)
        << text("stderr");
    const Json summary = parse_json(slurp(folder_ / "out/summary.json"));
    if (pictures == dirty) {
      EXPECT_GT(summary.at("flaw_px").get<int>(), 240);
      EXPECT_LT(summary.at("flaw_px").get<int>(), 2400);
    } else {
      EXPECT_EQ(summary.at("flaw_px").get<int>(), 0);
    }
  }
}

TEST_F(CheckCommand, ColoursInAnotherOrderAreNoSameGel) {
  check(changed([](cv::Mat& image) { cv::cvtColor(image, image, cv::COLOR_BGR2RGB); }), 3);
}

TEST_F(CheckCommand, WhatShowsNothingIsNotTaken) {
  // Nothing to compare with, and no ball.
  Sensor bare = load_sensor(folder_ / "own.json");
  bare.background.image.clear();
  save_sensor(bare, folder_ / "own.json");
  EXPECT_NE(check(frames("today"), 3, "").at("sentence").get<std::string>().find("cannot be judged"),
            std::string::npos);
  // A ball alone shows it.
  EXPECT_EQ(
      state(check(frames("today"), 0, "--ball-radius-mm 8 --background '" + first_of("today") + "'"), "ball"),
      "as calibrated");
  const std::string own = at("own.json"), today = at("today/frames");
  expect_refusal({"check", own, today, "--ball-radius-mm", "8", "--ball-diameter-mm", "16"}, 2,
                 {"ball's size"});
  expect_refusal({"check", at("none.json"), today}, 2, {"none.json"});
  expect_refusal({"check", own, at("none")}, 2, {"none"});
}

TEST_F(CheckCommand, PicturesThatAreNotOfThisPadAreCounted) {
  int n = 0;
  const std::string some = changed([&](cv::Mat& image) {
    if (n++ % 5 == 0) cv::cvtColor(image, image, cv::COLOR_BGR2RGB);
  });
  const Json found = check(some, 3, "");
  EXPECT_EQ(state(found, "same pad"), "as calibrated");
  EXPECT_EQ(state(found, "pictures"), "changed");
  EXPECT_NEAR(row(found, "pictures").at("value").get<double>(), 20, 8);
  const std::string sentence = found.at("sentence");
  EXPECT_TRUE(sentence.starts_with("cannot be judged by this recording: ")) << sentence;
  EXPECT_NE(sentence.find("colours exchanged"), std::string::npos) << sentence;
}

TEST_F(CheckCommand, SetupRefusesTheUntouchedImageOfAnotherLightOrCameraMode) {
  cv::Mat rest = cv::imread(first_of("today"), cv::IMREAD_COLOR), bright, small;
  rest.convertTo(bright, -1, 1.3);
  cv::resize(rest, small, {}, 0.5, 0.5);
  cv::imwrite(at("bright.png"), bright);
  cv::imwrite(at("small.png"), small);
  const std::string setup = "setup " + frames("today") + " --ball-radius-mm 8 --pitch 0.05 --quiet --json" +
                            " --out '" + at("again.json") + "' --background ";
  ASSERT_EQ(TypedProgram::run(setup + "'" + at("bright.png") + "'"), 0) << text("stderr");
  const Json found = parse_json(text("stdout"));
  for (const Json& step : found.at("steps")) {
    if (step.at("step") == "touch") {
      EXPECT_FALSE(step.at("known").get<bool>());
      EXPECT_NE(step.at("missing").get<std::string>().find("another exposure"), std::string::npos) << step;
    }
    if (step.at("step") == "surface") {
      EXPECT_FALSE(step.at("known").get<bool>());
    }
  }
  EXPECT_EQ(TypedProgram::run(setup + "'" + at("small.png") + "'"), 3);
  EXPECT_NE(text("stderr").find("wanted a --background of 320 x 240 px"), std::string::npos)
      << text("stderr");
}

// A modulus that is half of the pad's: the scale shows it, its mended file is true, and reads the force.
TEST_F(CheckCommand, WeightsJudgeTheForceAndMendIt) {
  const std::string scene = "synthetic:palpation?mode=gel&size=320x240&rate=10";
  Sensor sensor = synthetic_sensor(parse_synthetic(scene));
  ASSERT_TRUE(sensor.layer && !sensor.force);
  sensor.layer->relative_sd = 0.1;
  save_sensor(sensor, folder_ / "own.json");
  // What the scale shows: the largest force of each press.
  std::vector<double> weight_g;
  const std::unique_ptr<Source> source = open_source(scene, sensor);
  Frame frame;
  double before_N = 0;
  while (source->next(frame)) {
    const double force_N = source->truth(frame.sequence)->force_N;
    if (force_N > 0 && before_N == 0) weight_g.push_back(0);
    if (force_N > 0) weight_g.back() = std::max(weight_g.back(), 1e3 * force_N / 9.80665);
    before_N = force_N;
  }
  ASSERT_GE(weight_g.size(), 2u);
  std::string weights = " --weight-g ";
  for (const double one : weight_g) weights += std::to_string(one) + ",";
  weights.pop_back();

  const std::string input = "'" + scene + "'";
  sensor.layer->young_MPa /= 2;
  save_sensor(sensor, folder_ / "own.json");
  const Json found = check(input, 3, weights);
  EXPECT_EQ(state(found, "force"), "changed");
  EXPECT_NEAR(row(found, "force").at("value").get<double>(), 0.5, 0.03);
  ASSERT_EQ(found.at("again").size(), 1u);
  const std::string command = found.at("again")[0].at("command");
  ASSERT_TRUE(command.starts_with("palpate check ")) << command;
  EXPECT_EQ(TypedProgram::run(command.substr(8) + " --quiet"), 3) << text("stderr");
  EXPECT_TRUE(text("stdout").starts_with("force mended")) << text("stdout");
  EXPECT_NEAR(row(check(input, 0, weights), "force").at("value").get<double>(), 1, 0.05);
  const LayerCalibration mended = load_sensor(folder_ / "own.json").layer.value();
  EXPECT_NEAR(mended.young_MPa, 2 * sensor.layer->young_MPa, 0.06 * mended.young_MPa);
  EXPECT_GT(mended.relative_sd, 0.05) << "other objects may read otherwise";
  EXPECT_LT(mended.relative_sd, 0.2);

  // Weights that no one modulus can read: none is written, and the force is to be calibrated again.
  std::string disagreeing = " --weight-g ";
  for (size_t i = 0; i < weight_g.size(); ++i)
    disagreeing += std::to_string(weight_g[i] * (i % 2 ? 3 : 0.3)) + (i + 1 < weight_g.size() ? "," : "");
  const Json apart = check(input, 3, disagreeing + " --out '" + at("none.json") + "'");
  EXPECT_EQ(state(apart, "force"), "changed");
  EXPECT_NE(row(apart, "force").at("what").get<std::string>().find("does not mend"), std::string::npos)
      << apart.dump();
  ASSERT_EQ(apart.at("again").size(), 1u);
  EXPECT_TRUE(std::string(apart.at("again")[0].at("command")).starts_with("palpate calibrate force "))
      << apart.dump();
  EXPECT_FALSE(fs::exists(folder_ / "none.json"));

  const std::string own = "check '" + at("own.json") + "' " + input;
  EXPECT_EQ(TypedProgram::run(own + " --weight-g 100,200,300,400,500,600,700"), 3);
  EXPECT_NE(text("stderr").find("a weight each"), std::string::npos) << text("stderr");
  EXPECT_EQ(TypedProgram::run(own + " --weight-g -5"), 2);
  EXPECT_EQ(TypedProgram::run(own + " --out '" + at("other.json") + "'"), 2);
  EXPECT_FALSE(fs::exists(folder_ / "other.json"));
}

// Presses of a wide ball under an exposure that is a fifth more today: each of them hides its own light,
// which the series has. Alone such a press shows no light, and weighs nothing.
TEST_F(CheckCommand, WidePressesAreWeighedInTheLightOfTheirSeries) {
  ASSERT_EQ(
      TypedProgram::run("simulate press --mode gel --size 320x240 --rate 2 --radius 12 --force 20 --quiet "
                        "--out '" +
                        at("wide") + "'"),
      0)
      << text("stderr");
  Sensor sensor = load_sensor(folder_ / "wide/sensor.json");
  sensor.background.image = (folder_ / "wide/background.png").string();
  save_sensor(sensor, folder_ / "own.json");
  const Table truth(text("wide/truth.csv"));
  const std::vector<double> force_N = truth.numbers("true_force_N");
  std::string weights;
  for (const char* series : {"all", "one"}) fs::create_directories(folder_ / series);
  size_t pressed = 0, i = 0;
  while (i < force_N.size()) {
    const fs::path file =
        folder_ / ("wide/frames/" + std::string(i < 10 ? "00000" : "0000") + std::to_string(i) + ".png");
    cv::Mat image = cv::imread(file.string(), cv::IMREAD_COLOR);
    ASSERT_FALSE(image.empty()) << file;
    image.convertTo(image, -1, 1.2);
    const double force = force_N.at(i++);
    cv::imwrite((folder_ / "all" / file.filename()).string(), image);
    if (force < 2.5 || force > 15) continue;  // a brush; deeper than linear theory goes
    if (pressed++ == 4) cv::imwrite((folder_ / "one" / file.filename()).string(), image);
    weights += (weights.empty() ? " --weight-g " : ",") + std::to_string(1e3 * force / 9.80665);
  }
  const Json found = check("'" + at("all") + "'", 3, weights);
  EXPECT_EQ(state(found, "brightness"), "changed");
  EXPECT_EQ(state(found, "force"), "as calibrated") << found.dump(2);
  EXPECT_NEAR(row(found, "force").at("value").get<double>(), 0.95, 0.05);
  EXPECT_EQ(TypedProgram::run("check '" + at("own.json") + "' '" + at("one") + "' --weight-g 1360"), 3);
  EXPECT_NE(text("stderr").find("found 0 of them"), std::string::npos) << text("stderr");
}

WeighedPress pressed(double weight_N, double force_N, double own_sd = 0.1, double stated_sd = 0.2) {
  return {weight_N, force_N, own_sd * force_N, stated_sd * force_N, false};
}

TEST(Weighed, GainIsWeighedWithTheCalibration) {
  const WeighedPress three[] = {pressed(11, 10), pressed(22, 20), pressed(5.5, 5)};
  const WeighedGain found = weigh(three);
  EXPECT_NEAR(found.gain, 1.1, 1e-12);
  EXPECT_NEAR(found.sd, 1.1 * 0.1 / std::sqrt(3.0), 1e-12);
  EXPECT_LT(found.gain, found.limit);
  EXPECT_GT(found.mended, 1);
  EXPECT_LT(found.mended, found.gain);
  EXPECT_LT(found.mended_sd, std::min(found.sd, 0.2));
  // Contradicted by three, the calibration has no say; by one, both have, and the error grows.
  const WeighedPress far[] = {pressed(20, 10), pressed(40, 20), pressed(10, 5)};
  EXPECT_GT(weigh(far).gain, weigh(far).limit);
  EXPECT_NEAR(weigh(far).mended, 2, 1e-12);
  const WeighedGain one = weigh(std::span(far).first(1));
  EXPECT_GT(one.mended, 1.2);
  EXPECT_LT(one.mended, 1.8);
  EXPECT_GE(one.mended_sd, 0.5);
  // Presses that scatter more than they state.
  const WeighedPress apart[] = {pressed(8.5, 10), pressed(10, 10), pressed(11.5, 10)};
  EXPECT_TRUE(weigh(apart).agree);
  EXPECT_NEAR(weigh(apart).sd, 1.4826 * 0.15 / std::sqrt(3.0), 1e-6);
}

// One object reads half of its weight and another twice its: no factor mends both.
TEST(Weighed, PressesThatDisagreeMendNothing) {
  const WeighedPress two[] = {pressed(5, 10), pressed(16, 10)},
                     three[] = {pressed(7, 10), pressed(10, 10), pressed(13.5, 10)};
  for (const WeighedGain& found : {weigh(two), weigh(three)}) {
    EXPECT_FALSE(found.agree);
    EXPECT_EQ(found.mended, 1);
    EXPECT_NEAR(found.mended_sd, 0.2, 1e-12);
  }
  EXPECT_NEAR(weigh(two).least, 0.5, 1e-12);
  EXPECT_NEAR(weigh(two).most, 1.6, 1e-12);
  // Poor presses may differ as much, and one press contradicts none.
  const WeighedPress poor[] = {pressed(5, 10, 0.5), pressed(16, 10, 0.5)};
  EXPECT_TRUE(weigh(poor).agree);
  EXPECT_TRUE(weigh(std::span(two).first(1)).agree);
}

TEST(Weighed, MendsTheCurveOrTheModulus) {
  Sensor sensor;
  sensor.layer = LayerCalibration{.young_MPa = 0.2, .thickness_mm = 4, .relative_sd = 0.3};
  WeighedGain gain;
  gain.mended = 1.5;
  gain.mended_sd = 0.15;
  set_gain(sensor, gain, "today.avi");
  EXPECT_NEAR(sensor.layer->young_MPa, 0.3, 1e-12);
  EXPECT_NEAR(sensor.layer->relative_sd, 0.1, 1e-12);
  EXPECT_EQ(sensor.layer->origin.from, "today.avi");
  ForceCalibration& force = sensor.force.emplace();
  force.signal = ForceSignal::Gradient;
  force.model = ForceModel::Spline;
  force.knots = {{0, 0}, {10, 4}};
  force.loading = ForceCurve{.c1 = 2, .c0_N = 1, .knots = {{0, 0}, {10, 6}}};
  force.unloading = force.loading;
  force.force_max_N = 4;
  set_gain(sensor, gain, "today.avi");
  EXPECT_NEAR(sensor.layer->young_MPa, 0.3, 1e-12) << "not what the force is read by";
  EXPECT_EQ(force.knots[1], (std::array<double, 2>{10, 6}));
  EXPECT_EQ(force.unloading->knots[1], (std::array<double, 2>{10, 9}));
  EXPECT_NEAR(force.force_max_N, 6, 1e-12);
  EXPECT_NEAR(force.residual_fraction, 0.1, 1e-12);
  force.signal = ForceSignal::Layer;
  set_gain(sensor, gain, "today.avi");
  EXPECT_NEAR(sensor.layer->young_MPa, 0.45, 1e-12);
  EXPECT_NEAR(force.force_max_N, 6, 1e-12) << "the curve's force is mended by its signal";
}

}  // namespace
}  // namespace palpate
