// palpate lump limit on the command line.
#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

using LumpLimitCommand = Program;

TEST_F(LumpLimitCommand, ATableAPlotAndWhatNoiseCosts) {
  const fs::path out = folder_ / "limit";
  const Ended ended = run({"lump", "limit", "--force-N", "0.5,1,1.5,2", "--young-Pa", "4000", "--noise-Pa",
                           "5,50", "--out", out.string(), "--json"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Json limits = parse_json(ended.out)["limits"];
  ASSERT_GT(limits.size(), 4u);
  EXPECT_EQ(limits.front()["noise_Pa"], 5);
  EXPECT_EQ(limits.back()["noise_Pa"], 50);
  const size_t half = limits.size() / 2;
  for (size_t i = 0; i < half; ++i)
    if (!limits[half + i]["size_mm"].is_null()) {
      ASSERT_FALSE(limits[i]["size_mm"].is_null());
      EXPECT_LE(limits[i]["size_mm"].get<double>(), 1.02 * limits[half + i]["size_mm"].get<double>()) << i;
    }
  EXPECT_TRUE(fs::exists(out / "limit.png"));
  const Table table(slurp(out / "limit.csv"));
  EXPECT_EQ(table.number(0, "depth_mm"), 2);
}

TEST_F(LumpLimitCommand, NonsenseIsRefusedInOneLine) {
  const auto with = [](const std::string& forces, const std::string& young, const std::string& noise) {
    return std::vector<std::string>{"lump",       "limit", "--force-N",  forces,
                                    "--young-Pa", young,   "--noise-Pa", noise};
  };
  expect_refusal(with("1", "4000", "1e6"), 2, {"highest pressure"});
  expect_refusal(with("1", "4000", "-1"), 2, {"--noise-Pa"});
  expect_refusal(with("2,1", "4000", "5"), 2, {"rise"});
  expect_refusal(with("0", "4000", "5"), 2, {"force"});
  expect_refusal(with("100", "4000", "5"), 2, {"the model knows"});
  std::vector<std::string> thin = with("1", "4000", "5");
  thin.insert(thin.end(), {"--thickness-mm", "3"});
  expect_refusal(thin, 2, {"3 mm", "the model knows"});
}

}  // namespace
}  // namespace palpate
