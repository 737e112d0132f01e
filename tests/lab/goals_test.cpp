// The table of goals has every row, on the terminal and as CSV; how fast this machine is, is no test.
#include <algorithm>

#include "tests/lab/lab_program.h"
#include "tests/support/json.h"

namespace palpate {
namespace {

using Goals = LabProgram;

TEST_F(Goals, PrintEveryRow) {
  const Ended ended = run({"goals", "--repetitions", "1", "--out", folder_ / "out"});
  const std::string &out = ended.out, csv = slurp(folder_ / "out/goals.csv");
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_EQ(out.find("DIFFERENT WORK"), std::string::npos) << out;
  const char* rows[] = {"contact 1392x1042",
                        "moments alone 1392x1042",
                        "Poisson 640x480",
                        "Poisson 1392x1042",
                        "frame to height 640x480, shading",
                        "frame to height 640x480, photometric",
                        "frame to height 1392x1042, shading",
                        "frame to height 1392x1042, photometric",
                        "throughput 640x480",
                        "throughput 1392x1042",
                        "round pad, live 640x480",
                        "round pad and a highlight, live 640x480",
                        "round pad, converged 640x480",
                        "round pad and a highlight, converged 640x480",
                        "force only 1392x1042",
                        "skin of markers 640x480",
                        "skin of texture 640x480",
                        "skin of markers 1392x1042",
                        "skin of texture 1392x1042"};
  for (const char* row : rows) {
    EXPECT_NE(out.find(row), std::string::npos) << row;
    EXPECT_NE(csv.find(std::string("\"") + row + "\","), std::string::npos) << row;
  }
  // A header and every row; contact has two rivals.
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 2 + static_cast<std::ptrdiff_t>(std::size(rows)));
}

}  // namespace
}  // namespace palpate
