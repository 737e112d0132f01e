// palpate lump scan and figures on the command line.

#include "capture/files/npy.h"
#include "capture/synthetic/tissue.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

class LumpScanCommand : public Program {};

const std::vector<std::string> kSmallScan = {
    "lump",     "scan",       "--simulate", "--cells",   "16",          "16",
    "8",        "--size",     "160",        "120",       "--loads",     "2",
    "--method", "none",       "--force-N",  "0.5",       "--offset-mm", "4",
    "-3",       "--depth-mm", "3",          "--size-mm", "8",           "--stiffness-ratio",
    "10"};
std::vector<std::string> with(std::vector<std::string> arguments, const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

TEST_F(LumpScanCommand, LeavesAReportThatNeedsNothingElse) {
  const fs::path out = folder_ / "scan";
  const Ended ended = run(with(kSmallScan, {"--out", out.string(), "--json"}));
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json value = parse_json(ended.out);
  EXPECT_GT(value["map"]["seen_share"], 0.99);
  EXPECT_TRUE(value["outline"]["found"]);
  EXPECT_NEAR(value["outline"]["x_mm"]["value"].get<double>(), 4, 1);
  EXPECT_NEAR(value["outline"]["y_mm"]["value"].get<double>(), -3, 1);
  EXPECT_TRUE(value["estimate"].is_null());
  const NpyArray maps = read_npy(out / "pressure_Pa.npy");
  ASSERT_EQ(maps.shape.size(), 3u);
  EXPECT_EQ(maps.shape[0], 2u);
  const std::string html = slurp(out / "report.html");
  for (const char* part : {"not a diagnosis", "<svg", "What is felt", "seed 1", "palpate 0", "mm2"})
    EXPECT_TRUE(contains(html, part)) << part;
  for (const char* outside : {"href=\"http", "src=\"http", "<script", "<link", "<img"})
    EXPECT_FALSE(contains(html, outside)) << outside;
  for (const char* file :
       {"map.csv", "presses.csv", "outline.csv", "scan.json", "map.png", "map.svg", "profile.png"})
    EXPECT_TRUE(fs::exists(out / file)) << file;
}

// The first thing that is tried has an answer, and it is the truth.
TEST_F(LumpScanCommand, TheFirstExampleIsDecided) {
  const Ended ended = run({"lump", "scan", "--simulate", "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json estimate = parse_json(ended.out)["estimate"];
  EXPECT_EQ(estimate["verdict"], "a lump");
  for (const auto& [name, truth] :
       {std::pair{"size_mm", 12.0}, {"depth_mm", 3.0}, {"stiffness_ratio", 4.0}}) {
    EXPECT_LE(estimate[name]["low"].get<double>(), truth) << name;
    EXPECT_GE(estimate[name]["high"].get<double>(), truth) << name;
  }
}

TEST_F(LumpScanCommand, OnePressSaysWhereTheNextIsWorthMost) {
  std::vector<std::string> words = {"lump", "scan", "--simulate",  "--cells", "24",
                                    "24",   "12",   "--leave-out", "1",       "2",
                                    "3",    "5",    "6",           "--out",   folder_ / "one"};
  const Ended told = run(words);
  ASSERT_EQ(told.exit_code, 0) << told.err;
  EXPECT_EQ(told.out.rfind("A lump: 12 mm wide", 0), 0u) << told.out;
  EXPECT_TRUE(contains(told.out, "the window's middle at 0, ")) << told.out;
  EXPECT_TRUE(contains(slurp(folder_ / "one/report.html"), "The next press"));
  const Json next = parse_json(slurp(folder_ / "one/scan.json"))["next_press"];
  EXPECT_NEAR(next["force_N"].get<double>(), 2, 0.1);
  for (const Json& narrower : next["narrower"]) {
    EXPECT_LT(narrower.get<double>(), 0.95);
    EXPECT_GT(narrower.get<double>(), 0.3);
  }
}

TEST_F(LumpScanCommand, MissingPressesStayOpen) {
  const Ended ended = run(with(kSmallScan, {"--leave-out", "1", "2", "--json"}));
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json value = parse_json(ended.out);
  EXPECT_LT(value["map"]["seen_share"], 0.9);
  EXPECT_TRUE(contains(value["warnings"].dump(), "not seen"));
}

// Camera to report: recordings of the synthetic block, one of them a session, by a table of places.
TEST_F(LumpScanCommand, RecordingsBecomeAMap) {
  const std::string block = "synthetic:tissue?size=160x120&cells=16&force=0.5&loads=2&rate=15&lx=4&ly=-3&h=3";
  const fs::path session = folder_ / "session";
  const Ended recorded =
      run({"record", block + "&x=7&y=-5", "--out", session.string(), "--outputs", "force"});
  ASSERT_EQ(recorded.exit_code, 0) << recorded.err;
  // With the session a gauge whose clock is a quarter of a second late.
  const TissueSensor block_of(parse_tissue(block));
  std::string gauge = "time_s,force_N\n";
  for (uint64_t frame = 0; frame < *block_of.frame_count(); ++frame)
    gauge += std::to_string(static_cast<double>(frame) / 15 + 0.25) + "," +
             std::to_string(block_of.block_force_N(frame)) + "\n";
  spill(folder_ / "gauge.csv", gauge);
  std::string table = "recording,x_mm,y_mm,gauge\nsession,7,-5,gauge.csv\n";
  for (const char* place : {"-7 -5", "7 5", "-7 5"}) {
    const std::string text = place;
    const std::string x = text.substr(0, text.find(' ')), y = text.substr(text.find(' ') + 1);
    table += block + "&x=" + x + "&y=" + y + "," + x + "," + y + "\n";
  }
  spill(folder_ / "places.csv", table);
  const Ended ended = run({"lump", "scan", "--positions", (folder_ / "places.csv").string(), "--gauge",
                           "truth", "--loads", "2", "--method", "none", "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json value = parse_json(ended.out);
  ASSERT_EQ(value["map"]["presses"].size(), 4u);
  for (const Json& press : value["map"]["presses"]) {
    EXPECT_TRUE(press["used"]);
    EXPECT_NEAR(press["gain"].get<double>(), 1, 0.03);
  }
  EXPECT_NEAR(value["map"]["force_N"][1].get<double>(), 0.5, 0.02);
  EXPECT_TRUE(contains(value["warnings"].dump(), "gauge's clock -0.2")) << value["warnings"];
  EXPECT_TRUE(value["outline"]["found"]);
  EXPECT_NEAR(value["outline"]["x_mm"]["value"].get<double>(), 4, 1);
  EXPECT_NEAR(value["outline"]["y_mm"]["value"].get<double>(), -3, 1);
}

// Made by the simulator as pictures with a gauge's table, scanned without any place.
TEST_F(LumpScanCommand, PressesByHandFindTheLump) {
  const fs::path made = folder_ / "made", out = folder_ / "scan";
  const Ended simulated =
      run({"simulate", "tissue?hand=13&d=12&h=3&ratio=4", "--size", "320x240", "--out", made.string()});
  ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
  const Ended ended = run({"lump", "scan", "--by-hand", (made / "frames").string(), "--sensor",
                           (made / "sensor.json").string(), "--out", out.string(), "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json value = parse_json(ended.out);
  const Json& estimate = value["estimate"];
  ASSERT_TRUE(estimate["verdict"] == "a lump" ||
              estimate["verdict"] == "a lump whose stiffness cannot be determined")
      << estimate;
  for (const auto& [name, truth] :
       {std::pair{"size_mm", 12.0}, {"depth_mm", 3.0}, {"stiffness_ratio", 4.0}}) {
    EXPECT_LE(estimate[name]["low"].get<double>(), truth) << name;
    EXPECT_GE(estimate[name]["high"].get<double>(), truth) << name;
  }
  ASSERT_EQ(value["hand"].size(), 13u);
  size_t used = 0;
  for (const Json& press : value["hand"]) {
    used += press["used"].get<bool>();
    if (!press["used"].get<bool>()) continue;
    EXPECT_LT(press["at_sd_mm"][0].get<double>(), 0.3);
    EXPECT_LT(press["tilt_sd_deg"].get<double>(), 2);
  }
  EXPECT_GE(used, 9u);
  EXPECT_EQ(slurp(out / "hand.csv").rfind("press,used,x_mm,x_sd_mm", 0), 0u);
  EXPECT_TRUE(contains(slurp(out / "report.html"), "Presses by hand"));
}

TEST_F(LumpScanCommand, ASessionOfPressesByHandSaysWhatTheyDid) {
  const std::string hand = "synthetic:tissue?cells=16&hand=3&seed=2&size=320x240&rate=15&d=12&h=3&ratio=4";
  const fs::path session = folder_ / "session";
  const Ended recorded = run({"record", hand, "--out", session.string()});
  ASSERT_EQ(recorded.exit_code, 0) << recorded.err;
  const std::vector<std::string> scan = {"lump", "scan", "--by-hand", "--method", "none", "--json"};
  const Ended of_session = run(with(scan, {session.string(), "--gauge", "truth"})),
              of_block = run(with(scan, {hand}));
  ASSERT_EQ(of_session.exit_code, 0) << of_session.err;
  ASSERT_EQ(of_block.exit_code, 0) << of_block.err;
  const Json rows = parse_json(of_session.out)["hand"], wanted = parse_json(of_block.out)["hand"];
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_TRUE(rows[1]["used"].get<bool>() || rows[2]["used"].get<bool>()) << rows;
  EXPECT_EQ(rows, wanted) << "a session keeps every pixel";
}

TEST_F(LumpScanCommand, PressesByHandFindNoLumpWhereNoneIs) {
  const Ended ended =
      run({"lump", "scan", "--by-hand", "synthetic:tissue?hand=13&lump=none&size=320x240", "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_EQ(parse_json(ended.out)["estimate"]["verdict"], "no lump");
}

TEST_F(LumpScanCommand, RefusesPressesByHandThatTellNothing) {
  const std::string block = "synthetic:tissue?cells=16&lump=none&size=160x120&rate=10&hand=2";
  const std::vector<std::string> scan = {"lump", "scan", "--by-hand"};
  expect_refusal(with(scan, {block + "&texture=0"}), 3, {"no relief of 'press 1'", "texture"});
  expect_refusal(with(scan, {"synthetic:tissue?cells=16&lump=none&size=160x120&rate=10&hand=1"}), 3,
                 {"two presses by hand or more"});
  expect_refusal(with(scan, {block, "synthetic:tissue?cells=16&lump=none&size=200x150&rate=10&hand=1"}), 3,
                 {"presses of one pad"});
  expect_refusal(with(scan, {block, "--young-Pa", "1000000"}), 3, {"a press of", "--young-Pa"});
  expect_refusal(with(scan, {"synthetic:press"}), 2, {"gauge"});
  expect_refusal(with(scan, {block, "--simulate"}), 2, {"--by-hand", "one of them"});
  expect_refusal(scan, 2, {"recordings of presses by hand"});
  fs::create_directories(folder_ / "empty");
  spill(folder_ / "gauge.csv", "frame,force_N\n0,0\n1,1\n");
  expect_refusal(with(scan, {(folder_ / "empty").string()}), 3, {"empty"});
  spill(folder_ / "press.avi", "RIFF");
  expect_refusal(with(scan, {(folder_ / "press.avi").string()}), 3, {"press.avi"});
  expect_refusal(with(scan, {(folder_ / "nowhere").string(), "--gauge", "truth"}), 3, {"nowhere"});
}

TEST_F(LumpScanCommand, RefusesOptionsThatSayNothingOfPressesByHand) {
  const std::string block = "synthetic:tissue?cells=16&lump=none&size=160x120&rate=10&hand=2";
  const auto scan = [&](const std::vector<std::string>& more) {
    return with({"lump", "scan", "--by-hand", block, "--method", "none"}, more);
  };
  for (const std::vector<std::string>& of_others : std::vector<std::vector<std::string>>{
           {"--size-mm", "8"}, {"--no-inclusion"}, {"--leave-out", "1"}, {"--stage-sd-mm", "0.3"}})
    expect_refusal(scan(of_others), 2, {of_others[0], "a stage or a simulated block"});
  expect_refusal({"lump", "scan", "--simulate", "--first-mm", "1", "1"}, 2, {"--by-hand for --first-mm"});
  expect_refusal(scan({"--first-mm", "100", "0"}), 2, {"aimed at the block", "--first-mm 100 0"});
  expect_refusal(scan({"--first-mm", "nan", "0"}), 2, {"aimed at the block", "--first-mm nan 0"});
  expect_refusal(scan({"--first-sd-mm", "nan"}), 2, {"--first-sd-mm", "nan"});
  expect_refusal(scan({"--block-mm", "10", "10", "20"}), 2, {"larger than the pad", "10 x 10 mm"});
  expect_refusal(scan({"--block-mm", "40", "40", "inf"}), 2, {"sizes and modulus", "inf mm"});
  expect_refusal(scan({"--block-mm", "nan", "40", "20"}), 2, {"--block-mm", "nan"});
  expect_refusal(scan({"--force-N", "0.001"}), 2, {"--force-N of", "0.001 N"});
  expect_refusal(scan({"--force-N", "100"}), 3, {"a first press that can be read", "smaller --force-N"});
  expect_refusal(scan({"--gauge", (folder_ / "nowhere.csv").string()}), 3, {"nowhere.csv", "no such file"});
  expect_refusal(scan({"--sensor", (folder_ / "nowhere.json").string()}), 4, {"nowhere.json"});
  expect_refusal({"lump", "scan", "--by-hand", "synthetic:press?mode=gel", "--gauge", "truth"}, 4,
                 {"reads pressure"});
}

TEST_F(LumpScanCommand, RefusesAWindowByHandThatCannotTell) {
  const std::string block = "synthetic:tissue?cells=16&lump=none&size=64x48&rate=10&hand=2";
  const auto process = [&](const std::string& input, const std::vector<std::string>& more) {
    return with({"process", input, "--by-hand", "--outputs", "force", "--out", (folder_ / "out").string()},
                more);
  };
  expect_refusal(process(block, {"--window-at-mm", "1", "2"}), 2, {"--by-hand", "--window-at-mm with it"});
  expect_refusal(process(block, {"--block-mm", "10", "10", "20"}), 2, {"larger than the pad"});
  expect_refusal(process(block, {"--young-Pa", "inf"}), 2, {"sizes and modulus", "inf Pa"});
  expect_refusal(process("synthetic:press", {"--young-Pa", "4000"}), 2, {"the force on the whole block"});
  expect_refusal(process("synthetic:press", {}), 2, {"--young-Pa"});
  expect_refusal(process("synthetic:press?mode=gel", {"--young-Pa", "4000"}), 4, {"reads pressure"});
}

TEST_F(LumpScanCommand, RefusesWhatMakesNoSense) {
  expect_refusal({"lump", "scan"}, 2, {"--simulate", "--by-hand"});
  expect_refusal({"lump", "scan", "--simulate", "--size-mm", "3", "4"}, 2, {"one size or three"});
  expect_refusal({"lump", "scan", "--simulate", "--depth-mm", "18"}, 2, {"base"});
  expect_refusal({"lump", "scan", "--simulate", "--window-mm", "1", "1"}, 2, {"presses"});
  expect_refusal(with(kSmallScan, {"--leave-out", "40"}), 2, {"leave out"});
  expect_refusal({"lump", "scan", "--simulate", "--method", "oracle"}, 2, {"oracle"});
  const auto places = [&](const std::string& text) {
    spill(folder_ / "places.csv", text);
    return (folder_ / "places.csv").string();
  };
  expect_refusal({"lump", "scan", "--positions", places("recording,x_mm\n")}, 3, {"y_mm"});
  expect_refusal({"lump", "scan", "--positions", places("recording,x_mm,y_mm\n")}, 3, {"places"});
  expect_refusal({"lump", "scan", "--positions", places("recording,x_mm,y_mm\na,1,far\n")}, 3,
                 {"line 2", "y_mm"});
  expect_refusal({"lump", "scan", "other", "--positions", places("recording,x_mm,y_mm\na,1,2\n")}, 3,
                 {"other"});
  expect_refusal({"lump", "scan", "--positions", places("recording,x_mm,y_mm\nsynthetic:press,1,2\n")}, 2,
                 {"gauge"});
  expect_refusal({"lump", "scan", "--positions",
                  places("recording,x_mm,y_mm\nsynthetic:press?mode=gel,1,2\n"), "--gauge", "truth"},
                 4, {"pressure"});
  expect_refusal({"process", "synthetic:tissue?d=90", "--out", (folder_ / "x").string()}, 3, {"block"});
}

}  // namespace
}  // namespace palpate
