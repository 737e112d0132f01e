// palpate-lab evaluate on the command line: tables with a corner that is bad, simulations, and nonsense.
#include <random>
#include <string>

#include "tests/lab/lab_program.h"
#include "tests/support/json.h"

namespace palpate {
namespace {

class Evaluate : public LabProgram {
 protected:
  std::string table(const std::string& name, const std::string& text) {
    spill(folder_ / name, text);
    return folder_ / name;
  }
  /// Intervals that hold nine times of ten, and half of the time where both conditions are high.
  std::string results(bool corner) {
    std::string csv = "size_mm,depth_mm,truth,value,low,high,verdict\n";
    std::mt19937 random(3);
    for (int i = 0; i < 1200; ++i) {
      const auto even = [&random] { return static_cast<double>(random() % 1000) / 100; };
      const double size = even(), depth = even();
      const bool bad = corner && size > 7.5 && depth > 7.5;
      const bool inside = random() % 100 < (bad ? 50u : 90u);
      csv += std::to_string(size) + "," + std::to_string(depth) + (inside ? ",10" : ",12") + ",10,9,11," +
             (i % 10 == 0 ? "no lump\n" : "found\n");
    }
    return csv;
  }
};

TEST_F(Evaluate, ATablesBadCornerIsNamed) {
  const std::string bad = table("bad.csv", results(true)), good = table("good.csv", results(false));
  const Ended ended = run({"evaluate", "table", bad, "--by", "size_mm,depth_mm", "--out", folder_ / "out"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_TRUE(contains(ended.out, "below its promise")) << ended.out;
  for (const char* file : {"coverage.txt", "coverage.csv", "coverage.json", "coverage_cases.csv"})
    EXPECT_TRUE(fs::exists(folder_ / "out" / file)) << file;
  const Table cells(slurp(folder_ / "out/coverage.csv"));
  cells.expect_whole();
  EXPECT_EQ(cells.rows.size(), 2 + 2 * 16u);

  const Json json = parse_json(run({"evaluate", "table", bad, "--json"}).out);
  const Json& worst = json["worst"]["value"];
  EXPECT_TRUE(worst["quantities"]["value"]["below_promise"].get<bool>());
  EXPECT_LT(worst["quantities"]["value"]["coverage"].get<double>(), 0.65);
  EXPECT_NEAR(json["all"]["refused"].get<double>(), 120, 0);
  const Json honest = parse_json(run({"evaluate", "table", good, "--json"}).out);
  EXPECT_FALSE(honest["worst"]["value"]["quantities"]["value"]["below_promise"].get<bool>());

  // The table that was written can be judged again.
  const Json again = parse_json(run({"evaluate", "table", folder_ / "out/coverage_cases.csv", "--json"}).out);
  EXPECT_EQ(again["worst"]["value"]["cell"], worst["cell"]);
}

TEST_F(Evaluate, MatchesAreJudgedAlikeBySeed) {
  const std::vector<std::string> few = {"evaluate", "match",    "--trials", "4",     "--by",
                                        "noise",    "--fewest", "2",        "--json"};
  const Ended ended = run(few);
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json json = parse_json(ended.out);
  EXPECT_EQ(json["trials"], 4);
  EXPECT_EQ(json["all"]["count"], 4);
  EXPECT_TRUE(json["complete"].get<bool>());
  EXPECT_EQ(run(few).out, ended.out);
}

TEST_F(Evaluate, SimulatedSamplesAndForcesAreJudged) {
  const Ended modulus =
      run({"evaluate", "modulus", "--trials", "1", "--by", "stage", "--fewest", "1", "--json"});
  ASSERT_EQ(modulus.exit_code, 0) << modulus.err;
  EXPECT_EQ(parse_json(modulus.out)["all"]["count"], 2);
  const Ended force = run({"evaluate", "force", "--trials", "2", "--readings", "4", "--by",
                           "shape,calibrated", "--fewest", "1", "--out", folder_ / "out"});
  ASSERT_EQ(force.exit_code, 0) << force.err;
  const Table cases(slurp(folder_ / "out/force_cases.csv"));
  ASSERT_EQ(cases.rows.size(), 8u);
  for (size_t i = 0; i < cases.rows.size(); ++i) {
    EXPECT_GT(cases.number(i, "force_N_truth"), 0);
    if (cases.at(i, "verdict") == "reported") {
      EXPECT_LE(cases.number(i, "force_N_low"), cases.number(i, "force_N_high"));
    }
  }
}

TEST_F(Evaluate, NonsenseIsOneLine) {
  const std::string good = table("good.csv", results(false));
  expect_refusal({"evaluate", "table", folder_ / "none.csv"}, 3, {"none.csv"});
  expect_refusal({"evaluate", "table", table("empty.csv", "")}, 3, {"empty"});
  expect_refusal({"evaluate", "table", table("other.csv", "x,y\n1,2\n")}, 3, {"truth,value,low,high"});
  expect_refusal({"evaluate", "table", table("bad.csv", "truth,value,low,high,a\n1,1,2,0,1\n")}, 3,
                 {"low at most high", "line 2"});
  expect_refusal({"evaluate", "table", good, "--by", "sise_mm"}, 2, {"did you mean 'size_mm'?"});
  expect_refusal({"evaluate", "table", good, "--by", "size_mm,size_mm"}, 2, {"twice"});
  expect_refusal({"evaluate", "table", good, "--reported", "never"}, 3, {"--reported"});
  expect_refusal({"evaluate", "match", "--by", "noise,moon", "--trials", "1"}, 2, {"'moon'"});
  expect_refusal({"evaluate", "match", "--trials", "0"}, 2, {"--trials"});
}

}  // namespace
}  // namespace palpate
