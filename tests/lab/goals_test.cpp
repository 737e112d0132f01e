// The table of goals has every row, on the terminal and as CSV; how fast this machine is, is no test.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "tests/support/text_file.h"

namespace palpate {
namespace {

#ifdef PALPATE_GOALS

namespace fs = std::filesystem;

TEST(Goals, PrintEveryRow) {
  const fs::path folder = fs::temp_directory_path() / ("palpate-goals-" + std::to_string(getpid()));
  fs::create_directories(folder);
  const std::string line = "'" PALPATE_GOALS "' --repetitions 1 --out '" + folder.string() + "' >'" +
                           (folder / "stdout").string() + "' 2>&1";
  const int status = std::system(line.c_str());
  const std::string out = slurp(folder / "stdout"), csv = slurp(folder / "goals.csv");
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << out;
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
                        "moving scene, warm start 640x480",
                        "10 % of the tiles in contact 640x480",
                        "10 % of the tiles in contact 1392x1042",
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
  fs::remove_all(folder);
}

#endif

}  // namespace
}  // namespace palpate
