// palpate lump compare on the command line.
#include <cmath>

#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

class LumpCompareCommand : public Program {
 protected:
  /// A day's scan of a synthetic block with a ball.
  std::string day(const std::string& name, const std::string& size_mm, const std::string& depth_mm,
                  const std::string& seed) {
    const fs::path out = folder_ / name;
    const Ended ended = run({"lump", "scan", "--simulate", "--cells", "32", "32", "16", "--method", "none",
                             "--size-mm", size_mm, "--depth-mm", depth_mm, "--stiffness-ratio", "5", "--seed",
                             seed, "--out", out.string()});
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return out.string();
  }
};

TEST_F(LumpCompareCommand, GrowthIsToldAndKept) {
  const std::string may = day("may", "10", "3", "1"), june = day("june", "11", "2.5", "2"),
                    july = day("july", "10", "3", "3");
  const fs::path out = folder_ / "compared";
  const Ended ended = run({"lump", "compare", may, june, july, "--out", out.string(), "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json days = parse_json(ended.out)["days"];
  ASSERT_EQ(days.size(), 3u);
  EXPECT_FALSE(days[0].contains("change"));
  EXPECT_EQ(days[1]["change"]["verdict"], "grown") << days[1].dump();
  EXPECT_LE(days[1]["change"]["size_mm"]["low"].get<double>(), 1.0);
  EXPECT_GE(days[1]["change"]["size_mm"]["high"].get<double>(), 1.0);
  EXPECT_EQ(days[2]["change"]["verdict"], "no change") << days[2].dump();
  EXPECT_LT(days[2]["change"]["least_growth_mm"].get<double>(), 1.0);
  for (const char* file : {"change.json", "change.csv", "change.png", "report.html"})
    EXPECT_TRUE(fs::exists(out / file)) << file;
  const std::string html = slurp(out / "report.html");
  for (const char* part : {"not a diagnosis", "<svg", "has grown by", "no change of the size"})
    EXPECT_TRUE(contains(html, part)) << part;
  const Table table(slurp(out / "change.csv"));
  EXPECT_GE(table.number(0, "size_high_mm"), 1.0);
  EXPECT_EQ(table.at(1, "verdict"), "no change");
}

// Two lumps in the block: each in every file of an estimate, and no change told of one of them.
TEST_F(LumpCompareCommand, TwoLumpsAreListedAndNotCompared) {
  const auto day_of_two = [this](const std::string& name, const std::string& seed, const char* method) {
    const fs::path out = folder_ / name;
    const Ended ended = run({"lump",
                             "scan",
                             "--simulate",
                             "--cells",
                             "24",
                             "24",
                             "12",
                             "--method",
                             method,
                             "--size-mm",
                             "7",
                             "--depth-mm",
                             "2.5",
                             "--stiffness-ratio",
                             "6",
                             "--offset-mm",
                             "-5.5",
                             "1",
                             "--second-mm",
                             "5.5",
                             "-2",
                             "--seed",
                             seed,
                             "--out",
                             out.string(),
                             "--json",
                             "--young-error",
                             "0",
                             "--thickness-error",
                             "0",
                             "--pitch-error",
                             "0"});
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    return parse_json(ended.out)["estimate"];
  };
  const Json estimate = day_of_two("may", "1", "refined");
  EXPECT_EQ(estimate["bumps_mm"].size(), 2u) << estimate.dump();
  ASSERT_EQ(estimate["lumps"].size(), 2u);
  EXPECT_FALSE(contains(estimate["reasons"].dump(), "no lump that the model knows"))
      << "one alone is no answer";
  for (const Json& lump : estimate["lumps"]) {
    // Both lumps at once are pressed on straight cells of 1 mm, which make them seem larger.
    EXPECT_NEAR(lump["size_mm"]["value"].get<double>(), 7, 1.2) << lump.dump();
    EXPECT_LE(lump["depth_mm"]["low"].get<double>(), 2.9);
    EXPECT_GE(lump["depth_mm"]["high"].get<double>(), 2.1);
    EXPECT_NEAR(std::abs(lump["x_mm"]["value"].get<double>()), 5.5, 0.6);
  }
  day_of_two("june", "2", "none");
  const Ended ended =
      run({"lump", "compare", (folder_ / "may").string(), (folder_ / "june").string(), "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json days = parse_json(ended.out)["days"];
  EXPECT_EQ(days[1]["change"]["verdict"], "not comparable") << days[1].dump();
  EXPECT_TRUE(contains(days[1]["change"]["reasons"].dump(), "more than one lump"));
  // The estimate of that day: no value of one lump alone, and both in JSON.
  const Json whole = days[0]["estimate"];
  EXPECT_EQ(whole["verdict"], "several lumps");
  EXPECT_TRUE(whole["size_mm"].is_null());
  EXPECT_EQ(whole["lumps"].size(), 2u);
}

TEST_F(LumpCompareCommand, NonsenseIsRefusedInOneLine) {
  const std::string may = day("may", "10", "3", "1");
  expect_refusal({"lump", "compare", may}, 2, {"two days"});
  expect_refusal({"lump", "compare", may, (folder_ / "june").string()}, 3, {"observation", "june"});
  fs::create_directories(folder_ / "empty");
  expect_refusal({"lump", "compare", may, (folder_ / "empty").string()}, 3, {"observation.json"});
  for (const auto& [name, text] :
       {std::pair{"junk", "{]"}, {"other", "{\"format\": \"x\"}"}, {"list", "[1]"}}) {
    const fs::path bad = folder_ / name;
    fs::create_directories(bad);
    spill(bad / "observation.json", text);
    expect_refusal({"lump", "compare", may, bad.string()}, 3, {"observation", name});
  }
  const fs::path cut = folder_ / "cut";
  fs::copy(may, cut);
  fs::resize_file(cut / "pressure_Pa.npy", fs::file_size(cut / "pressure_Pa.npy") / 2);
  expect_refusal({"lump", "compare", may, cut.string()}, 3, {"pressure_Pa.npy"});
}

}  // namespace
}  // namespace palpate
