// palpate lump compare on the command line.
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
