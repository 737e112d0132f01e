// Files of `palpate export` asked for together are those asked for alone, for every pair of options, of a
// recording whose truth nobody knows.
#include <algorithm>

#include "tests/support/json.h"
#include "tests/support/program_fixture.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

/// An option of `palpate export`, as typed, and where its files go below --out.
struct ExportOption {
  std::vector<std::string> words;
  std::string files;
};

const std::vector<ExportOption> kOptions = {{{"--csv"}, "measurements.csv"},
                                            {{"--npy"}, "depth/000004.npy"},
                                            {{"--png16"}, "depth/000004.png"},
                                            {{"--tiff"}, "depth/000004.tif"},
                                            {{"--ply"}, "depth/000004.ply"},
                                            {{"--obj"}, "depth/000004.obj"},
                                            {{"--traction", "npy"}, "traction/000004.npy"},
                                            {{"--traction", "tiff"}, "traction/000004.tif"},
                                            {{"--traction", "ply"}, "traction/000004.ply"},
                                            {{"--mp4"}, "recording.mp4"},
                                            {{"--images", "png"}, "images/000004.png"},
                                            {{"--images", "tiff"}, "images/000004.tif"}};

/// Options that are asked for together: each pair in a thorough run. Otherwise eleven sets, the quadratic
/// residues of 11 moved along: each pair stands together in two of them, and each option in others without
/// the other. Images have one format at a time, PNG in the sets that hold it and TIFF in the others.
std::vector<std::vector<size_t>> together() {
  const size_t png = kOptions.size() - 2, tiff = kOptions.size() - 1;
  std::vector<std::vector<size_t>> sets;
  if (thorough()) {
    for (size_t a = 0; a < kOptions.size(); ++a)
      for (size_t b = a + 1; b < kOptions.size(); ++b)
        if (a != png || b != tiff) sets.push_back({a, b});
    return sets;
  }
  for (size_t move = 0; move < 11; ++move) {
    std::vector<size_t>& set = sets.emplace_back();
    for (const size_t residue : {1, 3, 4, 5, 9}) set.push_back((residue + move) % 11);
    if (std::ranges::find(set, png) == set.end()) set.push_back(tiff);
  }
  return sets;
}

class ExportPairs : public Program {
 protected:
  /// Five pictures of a press with its sensor file, whose layer makes traction known.
  void SetUp() override {
    Program::SetUp();
    const fs::path made = folder_ / "session", raw = folder_ / "raw";
    ASSERT_EQ(
        run({"record", "synthetic:press?mode=gel&size=97x80", "--out", made, "--frames", "36", "--no-drop"})
            .exit_code,
        0);
    ASSERT_EQ(run({"export", made, "--images", "png", "--frames", "31:36", "--out", raw}).exit_code, 0);
    ASSERT_TRUE(parse_json(slurp(raw / "sensor.json")).contains("layer"));
  }

  Ended exported(const std::vector<std::string>& options, const fs::path& out) {
    std::vector<std::string> words = {"export",   folder_ / "raw" / "images",
                                      "--sensor", folder_ / "raw" / "sensor.json",
                                      "--rate",   "30",
                                      "--frames", "4",
                                      "--out",    out};
    words.insert(words.end(), options.begin(), options.end());
    return run(words);
  }
};

TEST_F(ExportPairs, FilesAreThoseOfEachOptionAlone) {
  std::vector<std::string> alone;
  for (const ExportOption& option : kOptions) {
    const fs::path out = folder_ / "alone";
    const Ended ended = exported(option.words, out);
    ASSERT_EQ(ended.exit_code, 0) << option.files << ": " << ended.err;
    alone.push_back(slurp(out / option.files));
    EXPECT_GT(alone.back().size(), 100u) << option.files;
    fs::remove_all(out);
  }
  for (const std::vector<size_t>& set : together()) {
    std::vector<std::string> words;
    std::string names;
    for (const size_t i : set) {
      words.insert(words.end(), kOptions[i].words.begin(), kOptions[i].words.end());
      names += kOptions[i].files + " ";
    }
    SCOPED_TRACE(names);
    const fs::path out = folder_ / "together";
    const Ended ended = exported(words, out);
    ASSERT_EQ(ended.exit_code, 0) << ended.err;
    for (const size_t i : set) EXPECT_TRUE(slurp(out / kOptions[i].files) == alone[i]) << kOptions[i].files;
    fs::remove_all(out);
  }
}

}  // namespace
}  // namespace palpate
