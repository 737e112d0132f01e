// Each reader on the files that fuzzing found worth keeping, some bytes of each changed, and what it must
// never do: crash, hang, leave with anything but one line. What was wrong once is among these files.
#include "tests/fuzz/readers.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <ostream>
#include <random>
#include <vector>

#include "capture/files/event_log.h"
#include "capture/files/video.h"
#include "palpate/error.h"
#include "palpate/sensor.h"
#include "tests/support/test_folder.h"
#include "tests/support/thorough.h"

namespace palpate::fuzz {

void PrintTo(const Reader& reader, std::ostream* out) {
  *out << reader.name;
}

namespace {

namespace fs = std::filesystem;

fs::path corpus() {
  return fs::path(PALPATE_SOURCE_DIR) / "tests" / "fuzz" / "corpus";
}

std::vector<fs::path> corpus_of(const Reader& reader) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(corpus() / reader.name)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<uint8_t> bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class ReadersFolder : public testing::Test {
 protected:
  void SetUp() override { folder_ = test_folder("readers"); }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_;
};

class Readers : public ReadersFolder, public testing::WithParamInterface<Reader> {};
class ReadersOfImages : public ReadersFolder {};

TEST_P(Readers, ReadOrRefuseEveryFileOfTheCorpus) {
  const std::vector<fs::path> files = corpus_of(GetParam());
  ASSERT_GE(files.size(), 3u);
  for (const fs::path& file : files) EXPECT_EQ(trouble_of(GetParam(), bytes_of(file), folder_), "") << file;
}

TEST_P(Readers, ReadOrRefuseWhatIsCutAndChanged) {
  std::mt19937_64 random(7);
  for (const fs::path& file : corpus_of(GetParam())) {
    const std::vector<uint8_t> whole = bytes_of(file);
    if (whole.empty()) continue;
    for (uint32_t round = 0; round < of_sweep<uint32_t>(100, 2); ++round) {
      std::vector<uint8_t> bytes = whole;
      if (round % 2 == 0) {
        bytes.resize(random() % whole.size());
      } else {
        for (int change = 0; change < 3; ++change)
          bytes[random() % bytes.size()] = static_cast<uint8_t>(random());
        if (GetParam().mend) GetParam().mend(bytes);
      }
      ASSERT_EQ(trouble_of(GetParam(), bytes, folder_), "") << file << ", round " << round;
    }
  }
}

// Files of a few hundred bytes that claim the largest image there may be.
TEST_F(ReadersOfImages, RefuseHugeClaimsBeforeTheyTakeMemory) {
  const auto most_kB = [] {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    return used.ru_maxrss;
  };
  const long before_kB = most_kB();
  for (const char* file : {"tiff/huge8.tif", "tiff/huge16.tif", "tiff/hugetile.tif", "png/huge.png",
                           "jpeg/huge.jpg", "bmp/huge.bmp", "pnm/hugebits.pbm", "pnm/huge3.ppm"}) {
    const std::string kind(file, std::strchr(file, '/'));
    EXPECT_EQ(trouble_of(reader(kind), bytes_of(corpus() / file), folder_), "");
    EXPECT_THROW(reader(kind).read(folder_ / "image"), Error) << file;
  }
  EXPECT_LT(most_kB() - before_kB, 300'000);
}

TEST(ReadersOfEvents, LeaveOutWhatIsNoEvent) {
  const fs::path folder = test_folder("events");
  std::ofstream(folder / "events.csv")
      << "frame,time_s,event,text\n7,0.5,mark,a\n-1,0.5,mark,b\n8,1e999,mark,c\n"
         "9,nan,mark,d\n18446744073709551616,1,mark,e\n0x10,1,mark,f\n";
  const std::vector<viz::Event> events = viz::read_events(folder);
  fs::remove_all(folder);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].frame, 7u);
  EXPECT_EQ(events[0].time_s, 0.5);
  EXPECT_EQ(events[0].text, "a");
}

std::vector<std::vector<uint8_t>> pictures_of(const char* film) {
  Sensor sensor;
  sensor.name = "any";
  sensor.pitch_mm_per_px = 0.1;
  sensor.channels = 3;
  VideoFile file(corpus() / "film" / film, sensor);
  std::vector<std::vector<uint8_t>> pictures;
  for (Frame frame; file.next(frame);) pictures.push_back(frame.bytes);
  return pictures;
}

// What follows a picture of another kind was read as if it were of that kind, or shown as the one before.
TEST(ReadersOfFilms, TakeEachPictureAsItIs) {
  const auto colour_first = pictures_of("pngs.mov"), gray_first = pictures_of("pngs2.mov");
  ASSERT_EQ(colour_first.size(), 3u);
  ASSERT_EQ(gray_first.size(), 2u);
  EXPECT_TRUE(colour_first[0] == gray_first[1]);
  EXPECT_TRUE(colour_first[1] == gray_first[0]);
  EXPECT_TRUE(colour_first[2] == colour_first[0]);
  EXPECT_FALSE(colour_first[1] == colour_first[0]);
}

INSTANTIATE_TEST_SUITE_P(Files, Readers, testing::ValuesIn(readers().begin(), readers().end()),
                         [](const testing::TestParamInfo<Reader>& one) { return one.param.name; });

}  // namespace
}  // namespace palpate::fuzz
