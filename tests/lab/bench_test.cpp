// palpate-lab bench on the command line: a table is written and printed, and JSON alone where it is asked
// for.
#include "tests/lab/lab_program.h"
#include "tests/support/json.h"

namespace palpate {
namespace {

using BenchCommand = LabProgram;

TEST_F(BenchCommand, WritesWhatItPrints) {
  const Ended ended = run({"bench", "--matching", "--repetitions", "3", "--out", folder_ / "out"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const Table table(slurp(folder_ / "out/matching.csv"));
  table.expect_whole();
  EXPECT_GT(table.rows.size(), 3u);
  const std::string csv = slurp(folder_ / "out/matching.csv"),
                    last = csv.substr(csv.rfind('\n', csv.size() - 2));
  EXPECT_TRUE(contains(ended.out, last)) << ended.out;
}

TEST_F(BenchCommand, RefusesNonsenseInOneLine) {
  expect_refusal({"bench", "--repetitions", "1"}, 2, {"--repetitions"});
  expect_refusal({"bench", "--device", "no such device"}, 5, {"no such device"});
  expect_refusal({"goals", "--repetitions", "0"}, 2, {"--repetitions"});
}

}  // namespace
}  // namespace palpate
