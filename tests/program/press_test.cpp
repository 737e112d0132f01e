// Presses of a block of tissue, from a recording to the estimate of the lump in each.

#include "capture/synthetic/tissue.h"
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

class PressCommand : public Program {
 protected:
  Json json(const std::vector<std::string>& arguments) {
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return parse_json(ended.out);
  }
};

void expect_holds(const Json& estimate, const char* name, double truth, double slack) {
  const Json& value = estimate[name];
  ASSERT_TRUE(value.is_object()) << name << " " << estimate;
  EXPECT_LE(value["low"].get<double>() - slack, truth) << name << " " << value;
  EXPECT_GE(value["high"].get<double>() + slack, truth) << name << " " << value;
}

// The forward model at 24 x 24 x 12 cells, the sensor's light, noise, 8 bits, and the network of another
// grid.
TEST_F(PressCommand, TheLumpLiesWithinItsIntervals) {
  const std::string block = "synthetic:tissue?size=160x120&rate=15&repeat=2&d=10&h=3&ratio=8&lx=2&ly=-1";
  const Json value =
      json({"process", block, "--outputs", "force", "--out", (folder_ / "out").string(), "--json"});
  ASSERT_EQ(value["presses"].size(), 2u) << value;
  for (const Json& press : value["presses"]) {
    EXPECT_NEAR(press["highest_N"].get<double>(), 2, 1e-6);
    EXPECT_EQ(press["loads_N"].size(), 4u);
    const Json& e = press["estimate"];
    EXPECT_GT(e["evidence"].get<double>(), 1);
    expect_holds(e, "size_mm", 10, 0.3);
    expect_holds(e, "depth_mm", 3, 0.2);
    expect_holds(e, "stiffness_ratio", 8, 0);
    expect_holds(e, "x_mm", 2, 0.2);
    expect_holds(e, "y_mm", -1, 0.2);
  }
  EXPECT_LT(value["presses"][0]["last_frame"], value["presses"][1]["first_frame"]);
}

TEST_F(PressCommand, ABlockWithoutALumpHasNone) {
  const Json value = json({"process", "synthetic:tissue?size=160x120&rate=15&lump=none", "--outputs", "force",
                           "--out", (folder_ / "out").string(), "--json"});
  ASSERT_EQ(value["presses"].size(), 1u);
  const Json& verdict = value["presses"][0]["estimate"]["verdict"];
  EXPECT_NE(verdict, "found") << value["presses"];
  EXPECT_NE(verdict, "stiffness open") << value["presses"];
}

// Data that a user has of a real sensor: frames, a sensor file, a gauge's table and the tissue's modulus.
TEST_F(PressCommand, FramesAndAGaugesTableTellTheSame) {
  const fs::path rec = folder_ / "rec";
  const Ended made = run(
      {"simulate", "tissue?cells=16&force=1.6", "--size", "96x72", "--rate", "15", "--out", rec.string()});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_TRUE(contains(made.out, "--young-Pa 4000 --window-at-mm 0 0 --gauge")) << made.out;
  const Table gauge(slurp(rec / "gauge.csv"));
  ASSERT_GT(gauge.rows.size(), 80u);
  const std::vector<std::string> measure = {"process",   (rec / "frames").string(),
                                            "--sensor",  (rec / "sensor.json").string(),
                                            "--rate",    "15",
                                            "--outputs", "force",
                                            "--out",     (folder_ / "out").string()};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), measure.begin(), measure.end());
    return more;
  };
  EXPECT_FALSE(json(with({"--json"})).contains("presses")) << "no block is known";
  const Json read = json(with({"--young-Pa", "4000", "--gauge", (rec / "gauge.csv").string(), "--json"}));
  const Json known = json({"process", "synthetic:tissue?cells=16&force=1.6&size=96x72&rate=15", "--outputs",
                           "force", "--out", (folder_ / "known").string(), "--json"});
  ASSERT_EQ(read["presses"].size(), 1u);
  ASSERT_EQ(known["presses"].size(), 1u);
  EXPECT_EQ(read["presses"][0]["loads_N"], known["presses"][0]["loads_N"]);
  EXPECT_NEAR(read["presses"][0]["estimate"]["evidence"].get<double>(),
              known["presses"][0]["estimate"]["evidence"].get<double>(), 1e-6);
  expect_refusal(with({"--gauge", (rec / "gauge.csv").string()}), 2, {"--young-Pa"});
  expect_refusal(with({"--young-Pa", "4000", "--gauge", "truth"}), 2, {"--gauge FILE"});
  expect_refusal({"simulate", "tissue", "--mode", "gel", "--out", rec.string()}, 2, {"tissue"});
  expect_refusal({"simulate", "tissue?d=90", "--out", rec.string()}, 3, {"block"});
}

TEST_F(PressCommand, ASessionKeepsWhatItsPressesTold) {
  const std::string session = (folder_ / "session").string();
  const Json recorded = json({"record", "synthetic:tissue?cells=16&force=1.6&size=96x72&rate=15", "--outputs",
                              "force", "--out", session, "--json"});
  ASSERT_EQ(recorded["presses"].size(), 1u);
  const std::string events = slurp(fs::path(session) / "events.csv");
  EXPECT_TRUE(contains(events, ",lump,")) << events;
  EXPECT_TRUE(contains(events, "press 1, frames ")) << events;
  // A recording of the synthetic block still knows its block.
  const Json again =
      json({"process", session, "--outputs", "force", "--out", (folder_ / "out").string(), "--json"});
  ASSERT_EQ(again["presses"].size(), 1u);
  Json first = recorded["presses"][0], second = again["presses"][0];
  first["estimate"].erase("wall_s");
  second["estimate"].erase("wall_s");
  EXPECT_EQ(first, second);
}

}  // namespace
}  // namespace palpate
