// Files of `palpate export` asked for together are those asked for alone, for every pair of options, of a
// recording whose truth nobody knows.
#include <algorithm>

#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

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
  for (size_t a = 0; a < kOptions.size(); ++a)
    for (size_t b = a + 1; b < kOptions.size(); ++b) {
      const ExportOption &one = kOptions[a], &other = kOptions[b];
      if (one.words[0] == "--images" && other.words[0] == "--images") continue;  // one format at a time
      SCOPED_TRACE(one.files + " and " + other.files);
      std::vector<std::string> words = one.words;
      words.insert(words.end(), other.words.begin(), other.words.end());
      const fs::path out = folder_ / "pair";
      const Ended ended = exported(words, out);
      ASSERT_EQ(ended.exit_code, 0) << ended.err;
      EXPECT_TRUE(slurp(out / one.files) == alone[a]);
      EXPECT_TRUE(slurp(out / other.files) == alone[b]);
      fs::remove_all(out);
    }
}

}  // namespace
}  // namespace palpate
