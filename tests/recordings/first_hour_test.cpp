// The lines of "Your first hour" as they stand in viz/README.md, and what they reach.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "palpate/sensor.h"
#include "tests/support/csv_table.h"
#include "tests/support/recordings.h"
#include "tests/support/test_folder.h"
#include "tests/support/text_file.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = PALPATE_SOURCE_DIR;
const fs::path kData = fs::weakly_canonical(recordings_folder());

/// The block of commands, for the shell; by default without the gel with a force gauge and the gallery, which
/// take most of the time.
std::string commands() {
  const std::string text = slurp(kRoot / "viz/README.md");
  const size_t section = text.find("## Your first hour"), fence = text.find("```sh\n", section),
               start = fence + 6;
  if (section == std::string::npos || fence == std::string::npos) return "false\n";
  const size_t end = text.find(thorough() ? "```" : "# a gel with a force gauge", start);
  if (end == std::string::npos) return "false\n";
  std::string block = text.substr(start, end - start);
  for (size_t at; (at = block.find("DATA")) != std::string::npos;) block.replace(at, 4, kData.string());
  for (size_t at; (at = block.find("PALPATE")) != std::string::npos;) block.replace(at, 7, kRoot.string());
  return block;
}

/// Held-out depth error in the note of a sensor file's origin, mm.
double held_out_mm(const Origin& origin) {
  const size_t at = origin.note.find("depth ");
  return at == std::string::npos ? 1e9 : std::stod(origin.note.substr(at + 6));
}

TEST(FirstHour, TheLinesOfTheReadmeReachItsFigures) {
  if (!fs::is_directory(kData)) {
    std::fprintf(stderr, "\n*** THE FIRST HOUR IS NOT WALKED: no recordings in %s ***\n\n", kData.c_str());
    GTEST_SKIP() << "no recordings of real sensors";
  }
  const fs::path folder = test_folder("first_hour");
  std::ofstream(folder / "lines.sh") << "set -e\nexport PATH='"
                                     << fs::path(PALPATE_PROGRAM).parent_path().string() << "':\"$PATH\"\n"
                                     << commands();
  const std::string line = "cd '" + folder.string() + "' && bash lines.sh >said.txt 2>&1";
  ASSERT_EQ(std::system(line.c_str()), 0) << slurp(folder / "said.txt");

  const Table ftir(slurp(folder / "ftir/measurements.csv"));
  size_t touched = 0, five = 0;
  for (size_t i = 0; i < ftir.rows.size(); ++i) {
    touched += ftir.at(i, "contact") == "1";
    five += i >= 10 && i <= 155 && ftir.at(i, "contacts") == "5";
  }
  EXPECT_EQ(touched, 148u);
  EXPECT_GE(five, 144u) << "of the 146 frames in which five fingers rest";
  const Sensor sim2real = load_sensor(folder / "sim2real.json"),
               gelslim = load_sensor(folder / "gelslim.json"), gray = load_sensor(folder / "9dtact.json");
  EXPECT_LT(held_out_mm(sim2real.photometric.origin), 0.045);
  EXPECT_LT(held_out_mm(gelslim.photometric.origin), 0.145);
  EXPECT_LT(held_out_mm(gray.lookup.origin), 0.042);
  EXPECT_EQ(gray.signal, Signal::Darker);
  if (thorough()) {
    const Sensor wedge = load_sensor(folder / "wedge.json");
    EXPECT_EQ(wedge.signal, Signal::Either);
    EXPECT_LT(held_out_mm(wedge.photometric.origin), 0.09);
    ASSERT_TRUE(load_sensor(folder / "wedge_force.json").force);
    EXPECT_NE(slurp(folder / "gallery/index.html").find("7 of 7 sensors measured"), std::string::npos);
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace palpate
