// palpate lump estimate, evaluate and train on the command line.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <sstream>
#include <string>

#include "capture/files/lump_maps.h"
#include "capture/files/npy.h"
#include "tests/support/eventually.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

const std::string kReadings = PALPATE_SOURCE_DIR "/tests/data/lump/";

std::vector<std::string> estimate_of(const std::string& name, const std::string& forces,
                                     const std::string& young, const std::string& thick) {
  std::vector<std::string> words = {"lump", "estimate"};
  for (const char* load : {"1", "2", "3", "4"}) words.push_back(kReadings + name + "_" + load + ".npy");
  for (const std::string& word : {std::string("--force-N"), forces, std::string("--young-Pa"), young,
                                  std::string("--thickness-mm"), thick, std::string("--json")})
    words.push_back(word);
  return words;
}

using LumpEstimateCommand = Program;

// Presses that the network has not seen, solved on a finer grid and read through the synthetic sensor.
TEST_F(LumpEstimateCommand, TheBuiltInNetworkReadsStoredPresses) {
  const auto truths = parse_json(slurp(kReadings + "truth.json"));
  ASSERT_GE(truths.size(), 3u);
  for (const auto& truth : truths) {
    const Ended ended =
        run(estimate_of(truth["name"], truth["forces"], truth["young_Pa"], truth["thickness_mm"]));
    ASSERT_EQ(ended.exit_code, 0) << ended.err;
    const auto found = parse_json(ended.out);
    if (truth["size_mm"].is_null()) {
      EXPECT_EQ(found["verdict"], "no lump") << ended.out;
      EXPECT_TRUE(found["size_mm"].is_null());
      continue;
    }
    EXPECT_GE(found["evidence"], 1);
    EXPECT_NEAR(found["size_mm"]["value"].get<double>() / truth["size_mm"].get<double>(), 1, 0.15)
        << ended.out;
    EXPECT_NEAR(found["depth_mm"]["value"].get<double>() / truth["depth_mm"].get<double>(), 1, 0.25)
        << ended.out;
    const double ratio = truth["stiffness_ratio"];
    EXPECT_LE(found["stiffness_ratio"]["low"], ratio * 1.5);
    EXPECT_GE(found["stiffness_ratio"]["high"], ratio / 1.5);
  }
}

TEST_F(LumpEstimateCommand, EstimateWritesATableAPlotAndWordsForPeople) {
  const auto truth = parse_json(slurp(kReadings + "truth.json")).at(0);
  std::vector<std::string> words =
      estimate_of(truth["name"], truth["forces"], truth["young_Pa"], truth["thickness_mm"]);
  words.back() = "--out";
  words.push_back(folder_ / "lump");
  const Ended ended = run(words);
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  for (const char* part : {"verdict: ", "evidence", "size", "90 % interval", "For research, not a diagnosis"})
    EXPECT_TRUE(contains(ended.out, part)) << part;
  EXPECT_TRUE(contains(slurp(folder_ / "lump/lump.csv"), "stiffness_ratio,"));
  EXPECT_GT(fs::file_size(folder_ / "lump/lump.json"), 100u);
}

// A scan of two balls of 7 mm, 2.5 mm deep, ratio 6, at -5.5, 1 and 5.5, -2 mm: palpate lump scan --simulate
// --cells 48 48 24 --method none --seed 3.
TEST_F(LumpEstimateCommand, EachOfTwoLumpsIsReported) {
  const NpyArray maps = read_npy(kReadings + "two_balls.npy");
  ASSERT_EQ(maps.shape, (std::vector<size_t>{4, 33, 33}));
  std::vector<std::string> words = {"lump", "estimate"};
  for (size_t load = 0; load < 4; ++load) {
    words.push_back(folder_ / ("load_" + std::to_string(load) + ".npy"));
    const auto first = maps.values.begin() + static_cast<std::ptrdiff_t>(load * 33 * 33);
    write_npy(words.back(), std::vector<float>(first, first + 33 * 33), {33, 33});
  }
  for (const std::string& word :
       {std::string("--force-N"), std::string("0.50206,1.003878,1.5087,2.011764"), std::string("--young-Pa"),
        std::string("4000"), std::string("--out"), std::string(folder_ / "two")})
    words.push_back(word);
  const Ended ended = run(words);
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  for (const char* part : {"verdict: several lumps", "lump 1: ", "lump 2: ", "two bumps"})
    EXPECT_TRUE(contains(ended.out, part)) << part << ended.out;
  EXPECT_FALSE(contains(ended.out, "if it were one lump")) << ended.out;
  const auto found = parse_json(slurp(folder_ / "two/lump.json"));
  EXPECT_TRUE(found["size_mm"].is_null());
  ASSERT_EQ(found["lumps"].size(), 2u);
  for (const auto& lump : found["lumps"]) {
    const double x_mm = lump["x_mm"]["value"];
    EXPECT_NEAR(std::abs(x_mm), 5.5, 0.3);
    EXPECT_NEAR(lump["y_mm"]["value"].get<double>(), x_mm < 0 ? 1 : -2, 0.3);
    for (const auto& [name, truth] :
         {std::pair{"size_mm", 7.0}, {"depth_mm", 2.5}, {"stiffness_ratio", 6.0}}) {
      EXPECT_LE(lump[name]["low"].get<double>(), truth) << lump.dump();
      EXPECT_GE(lump[name]["high"].get<double>(), truth) << lump.dump();
    }
  }
  const Table table(slurp(folder_ / "two/lumps.csv"));
  EXPECT_NEAR(table.number(0, "size_mm"), 7, 0.7);
  EXPECT_NEAR(table.number(1, "size_mm"), 7, 0.7);
  EXPECT_LT(table.number(1, "depth_mm_low"), table.number(1, "depth_mm_high"));
}

/// Seconds of the processor that a process has used.
double processor_s(pid_t process) {
  const std::string all = slurp("/proc/" + std::to_string(process) + "/stat");
  std::istringstream after_name(all.substr(std::min(all.size(), all.rfind(')') + 1)));
  std::string skipped;
  double user = 0;
  for (int field = 3; field < 14; ++field) after_name >> skipped;
  after_name >> user;
  return user / static_cast<double>(sysconf(_SC_CLK_TCK));
}

// The whole reading takes several seconds of the processor.
TEST_F(LumpEstimateCommand, CtrlCEndsADirectReadingInHand) {
  const auto truth = parse_json(slurp(kReadings + "truth.json")).at(0);
  std::vector<std::string> words =
      estimate_of(truth["name"], truth["forces"], truth["young_Pa"], truth["thickness_mm"]);
  for (const std::string& word :
       {std::string("--method"), std::string("direct"), std::string("--out"), std::string(folder_ / "lump")})
    words.push_back(word);
  const pid_t child = start(words);
  ASSERT_TRUE(eventually([&] { return processor_s(child) > 1; }));
  ASSERT_EQ(kill(child, SIGINT), 0);
  const Ended ended = finish(child);
  EXPECT_EQ(ended.exit_code, 130) << ended.err;
  EXPECT_EQ(parse_json(ended.out), Json({{"complete", false}}));
  EXPECT_FALSE(fs::exists(folder_ / "lump"));
}

TEST_F(LumpEstimateCommand, RefusesNonsenseInOneLine) {
  spill(folder_ / "words.csv", "1,2,3\n4,five,6\n");
  spill(folder_ / "ragged.csv", "1,2,3\n4,5\n");
  spill(folder_ / "no.lump", "hello");
  const std::string map = folder_ / "map.npy";
  write_npy(map, std::vector<float>(961, 100.0F), {31, 31});
  const std::vector<std::string> rest = {"--force-N", "1", "--young-Pa", "4000"};
  const auto with = [&rest](std::vector<std::string> words) {
    words.insert(words.end(), rest.begin(), rest.end());
    return words;
  };
  expect_refusal(with({"lump", "estimate", folder_ / "words.csv"}), 3, {"'five'", "words.csv"});
  expect_refusal(with({"lump", "estimate", folder_ / "ragged.csv"}), 3, {"lines of 3 and of 2"});
  expect_refusal(with({"lump", "estimate", folder_ / "none.npy"}), 3, {"none.npy"});
  expect_refusal(with({"lump", "estimate", map, map}), 2, {"a force for each of 2 maps"});
  expect_refusal(with({"lump", "estimate", map, "--network", folder_ / "no.lump"}), 3,
                 {"no.lump", "palpate-lab train"});
  expect_refusal({"lump", "estimate", map, "--force-N", "-1", "--young-Pa", "4000"}, 2, {"forces above 0 N"});
  expect_refusal({"lump", "estimate", map, "--force-N", "1", "--young-Pa", "nothing"}, 2, {"--young-Pa"});
}

/// A block that another program pressed, and its loads.
const std::string kDeepEllipsoid = PALPATE_SOURCE_DIR "/tests/data/calculix/deep_ellipsoid";
Json deep_ellipsoid() {
  return parse_json(slurp(kDeepEllipsoid + ".json"));
}
std::string of_loads(const Json& about, const char* name) {
  std::string all;
  for (const auto& load : about.at("loads")) all += (all.empty() ? "" : ",") + load.at(name).dump();
  return all;
}
std::vector<std::string> estimate_of(const Json& about, const std::vector<std::string>& always,
                                     const std::vector<std::string>& more) {
  std::vector<std::string> words = {"lump",
                                    "estimate",
                                    kDeepEllipsoid + "_1.csv",
                                    kDeepEllipsoid + "_2.csv",
                                    "--force-N",
                                    of_loads(about, "force_N")};
  words.insert(words.end(), always.begin(), always.end());
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

TEST_F(LumpEstimateCommand, TheWayOfThePlateFindsTheModulus) {
  const auto about = deep_ellipsoid();
  const std::string ways = of_loads(about, "press_mm");
  const auto with = [&](const std::vector<std::string>& more) { return estimate_of(about, {}, more); };
  const Ended ended = run(with({"--press-mm", ways, "--noise-Pa", "4", "--json"}));
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const auto young = parse_json(ended.out)["tissue"]["young_Pa"];
  EXPECT_NEAR(young["value"].get<double>() / about["young_Pa"].get<double>(), 1, 0.02);
  EXPECT_LE(young["low"], about["young_Pa"]);
  EXPECT_GE(young["high"], about["young_Pa"]);

  const Ended wrong = run(with({"--press-mm", ways, "--young-Pa", "5600+-300"}));
  EXPECT_TRUE(contains(wrong.out, "verdict: inconsistent")) << wrong.out;
  EXPECT_TRUE(contains(wrong.out, "by the way of the plate the tissue's modulus is")) << wrong.out;

  // Two days of tissue that nobody told are told one.
  for (const char* day : {"may", "june"}) {
    const Ended kept = run(with({"--press-mm", ways, "--noise-Pa", "4", "--out", folder_ / day}));
    ASSERT_EQ(kept.exit_code, 0) << kept.err;
  }
  const Ended compared = run({"lump", "compare", folder_ / "may", folder_ / "june", "--json"});
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_TRUE(contains(compared.out, "\"no change\"")) << compared.out;

  expect_refusal(with({}), 2, {"the tissue's modulus, or the way of the plate", "--press-mm"});
  expect_refusal(with({"--press-mm", "2"}), 2, {"a way of the plate for each of 2 forces"});
  expect_refusal(with({"--press-mm", "3,2"}), 2, {"rise with the force"});
  expect_refusal(with({"--press-mm", "2,nan"}), 2, {"nan"});
  expect_refusal(with({"--young-Pa", "4000+-4000"}), 2, {"--young-Pa", "at most 30 %"});
  expect_refusal(with({"--young-Pa", "4kPa"}), 2, {"--young-Pa", "'4kPa'"});
  expect_refusal(with({"--young-Pa", "4000", "--thickness-mm", "-1+-0.1"}), 2, {"--thickness-mm"});
}

TEST_F(LumpEstimateCommand, ASkinThatIsToldIsTakenOffAndKept) {
  const auto about = deep_ellipsoid();
  const auto with = [&](const std::vector<std::string>& more) {
    return estimate_of(about, {"--young-Pa", "4000", "--noise-Pa", "4"}, more);
  };
  // One as stiff as the tissue is none.
  const Ended bare = run(with({"--json"})), skin = run(with({"--skin-mm", "2+-0.1", "--skin-ratio", "1",
                                                             "--json", "--out", (folder_ / "out").string()}));
  ASSERT_EQ(skin.exit_code, 0) << skin.err;
  const auto without = parse_json(bare.out), under = parse_json(skin.out);
  EXPECT_NEAR(under["size_mm"]["value"].get<double>() / without["size_mm"]["value"].get<double>(), 1, 0.02);
  EXPECT_TRUE(contains(skin.out, "skin's thickness"));
  EXPECT_FALSE(contains(bare.out, "skin"));
  const auto kept = parse_json(slurp(folder_ / "out" / "observation.json"));
  EXPECT_EQ(kept["skin"]["thickness_mm"].get<double>(), 2);
  EXPECT_NEAR(kept["skin"]["thickness_sd"].get<double>(), 0.05, 1e-6);

  const std::string help = run({"lump", "estimate", "--help-all"}).out;
  for (const char* option : {"--skin-mm MM", "--plate-friction NUM", "--check-plate"})
    EXPECT_TRUE(contains(help, option)) << option;
  expect_refusal(with({"--skin-mm", "2"}), 2, {"--skin-mm alone", "--skin-ratio 3"});
  expect_refusal(with({"--skin-ratio", "2"}), 2, {"--skin-ratio alone"});
  expect_refusal(with({"--skin-mm", "12", "--skin-ratio", "2"}), 2, {"--skin-mm", "0.05 to 10", "12"});
  expect_refusal(with({"--skin-mm", "2", "--skin-ratio", "stiff"}), 2, {"--skin-ratio", "'stiff'"});
}

TEST_F(LumpEstimateCommand, APlateThatIsToldIsTakenOffAndKept) {
  const auto about = deep_ellipsoid();
  const auto with = [&](const std::vector<std::string>& more) {
    return estimate_of(about, {"--young-Pa", "4000", "--noise-Pa", "4"}, more);
  };
  // These maps are of a plate that slides: one without friction changes nothing.
  const Ended bare = run(with({"--json"})),
              slides =
                  run(with({"--plate-friction", "0+-0.02", "--json", "--out", (folder_ / "out").string()}));
  ASSERT_EQ(slides.exit_code, 0) << slides.err;
  const auto without = parse_json(bare.out), under = parse_json(slides.out);
  EXPECT_NEAR(under["size_mm"]["value"].get<double>() / without["size_mm"]["value"].get<double>(), 1, 0.02);
  EXPECT_TRUE(contains(slides.out, "plate's friction"));
  EXPECT_FALSE(contains(bare.out, "plate"));
  const auto kept = parse_json(slurp(folder_ / "out" / "observation.json"));
  EXPECT_EQ(kept["plate"]["sticks"].get<bool>(), false);
  EXPECT_EQ(kept["plate"]["friction_sd"].get<double>(), 0.02);

  expect_refusal(with({"--plate-friction", "3"}), 2, {"--plate-friction", "0 to 2", "'3'"});
  expect_refusal(with({"--plate-friction", "0.1+-2"}), 2, {"at most 0.5", "0.1+-0.03"});
  expect_refusal(with({"--plate-friction", "oil"}), 2, {"--plate-friction", "'oil'"});
  expect_refusal(with({"--plate-friction", "0.1", "--plate-sticks"}), 2, {"sticks", "one of the two"});
}

TEST_F(LumpEstimateCommand, RelaxationThatIsToldIsTakenBack) {
  const auto about = deep_ellipsoid();
  const auto with = [&](const std::vector<std::string>& more) {
    return estimate_of(about, {"--noise-Pa", "4", "--uneven-sd", "0"}, more);
  };
  // Long rests leave 0.8 of the modulus right after a step.
  const Ended slow = run(with({"--young-Pa", "4000", "--json"})),
              told = run(with({"--young-Pa", "5000", "--relaxation", "0.15:3,0.05:30", "--rest-s", "1e5",
                               "--relaxation-error", "0", "--json", "--out", (folder_ / "out").string()})),
              doubted = run(with(
                  {"--young-Pa", "5000", "--relaxation", "0.15:3,0.05:30", "--rest-s", "1e5", "--json"}));
  ASSERT_EQ(told.exit_code, 0) << told.err;
  const auto one = parse_json(slow.out), other = parse_json(told.out), wide = parse_json(doubted.out);
  for (const char* name : {"size_mm", "depth_mm", "stiffness_ratio"})
    for (const char* end : {"value", "low", "high"})
      EXPECT_NEAR(other[name][end].get<double>() / one[name][end].get<double>(), 1, 2e-3) << name << end;
  EXPECT_TRUE(contains(doubted.out, "\"relaxation\""));
  EXPECT_GT(wide["stiffness_ratio"]["high"].get<double>(), other["stiffness_ratio"]["high"].get<double>());
  // Kept as tissue that does not relax.
  const auto kept = parse_json(slurp(folder_ / "out" / "observation.json"));
  EXPECT_NEAR(kept["force_N"][0].get<double>(), about["loads"][0]["force_N"].get<double>() / 0.8, 1e-6);

  for (const char* series : {"0.2", "0.2:", ":3", "0.2:3,", "0.2:-3", "0:3", "0.2:3;0.1:30", "x:3", "nan:3"})
    expect_refusal(with({"--young-Pa", "4000", "--relaxation", series}), 2,
                   {"shares and times above 0", "--relaxation 0.2:3,0.1:30"});
  expect_refusal(with({"--young-Pa", "4000", "--relaxation", "0.7:3,0.3:30"}), 2, {"below 1 in all", "1"});
}

TEST(LumpMaps, NoiseIsThatOfTheMapWhateverItsShape) {
  PressureMap map;
  map.width = 60;
  map.height = 50;
  uint64_t state = 1;
  for (uint32_t y = 0; y < map.height; ++y)
    for (uint32_t x = 0; x < map.width; ++x) {
      double noise = -6;  // twelve even numbers make a normal one
      for (int i = 0; i < 12; ++i) {
        state = state * 6364136223846793005ULL + 1442695040888963407ULL;
        noise += static_cast<double>(state >> 11) / 9007199254740992.0;
      }
      map.values.push_back(static_cast<float>(
          500 * std::exp(-((x - 30.0) * (x - 30.0) + (y - 20.0) * (y - 20.0)) / 100) + 3 * noise));
    }
  EXPECT_NEAR(lump::roughness(map), 3, 0.3);
}

}  // namespace
}  // namespace palpate
