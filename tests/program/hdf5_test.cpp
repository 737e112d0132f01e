// `palpate export --hdf5`, read by h5py as the README says and compared with the session to the last digit.
#include <cstdlib>
#include <fstream>

#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

constexpr const char* kCompare = R"(
import csv, math, sys
import h5py, numpy
episode = h5py.File(sys.argv[1])
rows = list(csv.DictReader(open(sys.argv[2])))
touch, cells = episode["touch"], 0
assert list(touch["frame"][:]) == [int(row["frame"]) for row in rows]
assert list(touch["time_s"][:]) == [float(row["time_s"]) for row in rows]
for name, column in touch.items():
    if name in ("frame", "time_s"): continue
    assert "unit" in column.attrs and column.attrs["description"], name
    values = column.asstr()[:] if column.dtype.kind == "O" else column[:]
    assert len(values) == len(rows), name
    for value, row in zip(values, rows):
        cell = row[name]
        same = value == cell if isinstance(value, str) else (math.isnan(value) if cell == "" else value == float(cell))
        assert same, (name, row["frame"], value, cell)
        cells += 1
assert touch["skin_shift_x_mm"].attrs["unit"] == "mm"
for group in ("frames", "depth", "skin"):
    assert len(episode[group]["time_s"]) == len(rows), group
    assert numpy.all(numpy.diff(episode[group]["time_s"][:]) > 0)
assert episode["frames/image"].shape == (len(rows), 240, 320, 3) and episode["frames/image"].dtype == numpy.uint8
assert episode["frames/image"].chunks[0] == 1
assert episode["depth/depth_mm"].shape == (len(rows), 240, 320)
deepest = numpy.nanmax(episode["depth/depth_mm"][-1])
assert abs(deepest - touch["depth_max_mm"][-1]) < 0.02, (deepest, touch["depth_max_mm"][-1])
points = episode["skin/points"][:]
assert points.shape[2] == 5 and numpy.all(numpy.isfinite(points))
assert "sensor" in episode.attrs and "started" in episode.attrs["session"]
print(cells)
)";

bool has_h5py() {
  return std::system("/usr/bin/python3 -c 'import h5py' 2>/dev/null") == 0;
}

std::string readme_block() {
  const std::string text = slurp(fs::path(PALPATE_SOURCE_DIR) / "capture/hdf5/README.md");
  const std::string mark = "```python\n";
  const size_t from = text.find(mark) + mark.size();
  return text.substr(from, text.find("```", from) - from);
}

class Hdf5File : public Program {
 protected:
  std::string python(const std::string& program, const std::string& arguments) {
    std::ofstream(folder_ / "program.py") << program;
    const std::string command =
        "cd '" + folder_.string() + "' && /usr/bin/python3 program.py " + arguments + " >said 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << slurp(folder_ / "said");
    return slurp(folder_ / "said");
  }
  void record(const std::string& name, const std::string& scene, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"record",       "synthetic:" + scene, "--out",
                                      folder_ / name, "--frames",           "36"};
    words.insert(words.end(), more.begin(), more.end());
    const Ended ended = run(words);
    ASSERT_EQ(ended.exit_code, 0) << ended.err;
  }
};

TEST_F(Hdf5File, SaysWhatTheSessionSaysAndTheReadmeReadsIt) {
  if (!has_h5py()) GTEST_SKIP() << "NOT CHECKED: no h5py here";
  record("session", "press?mode=gel&size=320x240&skin=texture", {"--outputs", "surface,skin"});
  const Ended ended = run({"export", folder_ / "session", "--hdf5", folder_ / "episode.h5"});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_GT(std::stoi(python(kCompare, "episode.h5 session/frames.csv")), 36 * 20);
  record("waveguide", "press?size=320x240");
  ASSERT_EQ(run({"export", folder_ / "waveguide", "--hdf5", folder_ / "episode.hdf5"}).exit_code, 0);
  fs::rename(folder_ / "episode.hdf5", folder_ / "episode.h5");
  const std::string said = python(readme_block(), "");
  EXPECT_NE(said.find("(240, 320) (240, 320)"), std::string::npos) << said;
  EXPECT_NE(said.find(" N\n"), std::string::npos) << said;
}

TEST_F(Hdf5File, AFolderOfSessionsGoesOnWhereItStopped) {
  for (const char* name : {"all/a", "all/b", "c"}) record(name, "press?mode=gel&size=97x80");
  const std::vector<std::string> words = {"export", folder_ / "all", folder_ / "c",
                                          "--hdf5", folder_ / "out", "--json"};
  const Ended first = run(words);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_EQ(parse_json(first.out).at("written").size(), 3u);
  const auto age = fs::last_write_time(folder_ / "out/a.h5");
  fs::remove(folder_ / "out/b.h5");
  const Json again = parse_json(run(words).out);
  EXPECT_EQ(again.at("written").size(), 1u);
  EXPECT_EQ(again.at("skipped").size(), 2u);
  EXPECT_TRUE(fs::exists(folder_ / "out/b.h5"));
  EXPECT_EQ(fs::last_write_time(folder_ / "out/a.h5"), age);
  fs::rename(folder_ / "c", folder_ / "a");
  expect_refusal({"export", folder_ / "all", folder_ / "a", "--hdf5", folder_ / "new"}, 2,
                 {"all/a", "names"});
  expect_refusal({"export", folder_ / "all", "--hdf5", folder_ / "one.h5"}, 2, {"a folder"});
  expect_refusal({"export", folder_ / "a", "--hdf5", folder_ / "new", "--csv"}, 2, {"--out FOLDER"});
  expect_refusal({"export", folder_ / "a", folder_ / "all/a", "--out", folder_ / "new", "--csv"}, 2,
                 {"one recording", "--hdf5"});
}

TEST_F(Hdf5File, WhatIsNotWholeLeavesNothing) {
  record("session", "press?mode=gel&size=160x120");
  expect_refusal({"export", folder_ / "session", "--hdf5", folder_ / "out"}, 7, {"session.h5"},
                 {.largest_file_bytes = 200000});
  EXPECT_TRUE(fs::is_empty(folder_ / "out"));
}

}  // namespace
}  // namespace palpate
