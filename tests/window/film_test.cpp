#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <utility>

#include "palpate/error.h"
#include "tests/support/text_file.h"
#include "viz/display/picture.h"

namespace palpate::viz {
namespace {

namespace fs = std::filesystem;

class FilmTest : public ::testing::Test {
 protected:
  FilmTest() : folder_(fs::temp_directory_path() / ("palpate-film-" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~FilmTest() override { fs::remove_all(folder_); }

  static RgbImage picture(uint8_t red, uint8_t green, uint8_t blue) {
    RgbImage image{96, 64, {}};
    for (uint32_t i = 0; i < image.width * image.height; ++i)
      image.rgb.insert(image.rgb.end(), {red, green, blue});
    return image;
  }
  size_t files() const { return static_cast<size_t>(std::distance(fs::directory_iterator(folder_), {})); }

  fs::path folder_;
};

TEST_F(FilmTest, PngKeepsEveryPixelAndTheOrderOfColours) {
  RgbImage image = picture(200, 100, 50);
  image.rgb[3 * (96 * 10 + 20)] = 7;  // x = 20, y = 10
  const fs::path file = folder_ / "picture.png";
  write_png(image, file);
  const cv::Mat back = cv::imread(file.string());
  ASSERT_EQ(back.size(), cv::Size(96, 64));
  EXPECT_EQ(back.at<cv::Vec3b>(0, 0), cv::Vec3b(50, 100, 200));
  EXPECT_EQ(back.at<cv::Vec3b>(10, 20), cv::Vec3b(50, 100, 7));
  EXPECT_EQ(files(), 1u);
}

TEST_F(FilmTest, HoldsEveryPictureInBothContainers) {
  for (const char* name : {"film.mp4", "film.avi"}) {
    const fs::path file = folder_ / name;
    Film film(file, 96, 64, 25);
    for (int i = 0; i < 7; ++i) film.add(picture(static_cast<uint8_t>(30 * i), 40, 200));
    EXPECT_FALSE(fs::exists(file)) << "an unfinished film must not look whole";
    film.finish();
    cv::VideoCapture back(file.string());
    ASSERT_TRUE(back.isOpened()) << name;
    EXPECT_NEAR(back.get(cv::CAP_PROP_FPS), 25, 0.01);
    cv::Mat frame;
    int count = 0;
    for (; back.read(frame); ++count) {
      // The codecs lose little on a plain picture.
      const cv::Vec3b middle = frame.at<cv::Vec3b>(32, 48);
      EXPECT_NEAR(middle[0], 200, 12) << name << " picture " << count;
      EXPECT_NEAR(middle[2], 30 * count, 12) << name << " picture " << count;
    }
    EXPECT_EQ(count, 7) << name;
  }
}

/// A page as Chromium shows it, as HTML; empty where there is no Chromium.
std::string shown_by_chromium(const fs::path& page, const fs::path& profile) {
  const std::string command =
      "timeout 600 chromium --headless --no-sandbox --disable-gpu --disable-dev-shm-usage --user-data-dir='" +
      profile.string() + "' --dump-dom 'file://" + page.string() + "' 2>/dev/null";
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return {};
  std::string html;
  for (int c; (c = std::fgetc(pipe)) != EOF;) html += static_cast<char>(c);
  pclose(pipe);
  return html;
}

TEST_F(FilmTest, ABrowserPlaysIt) {
  if (std::system("command -v chromium >/dev/null") != 0) GTEST_SKIP() << "no chromium on this machine";
  Film film(folder_ / "film.mp4", 96, 64, 2);
  for (int i = 0; i < 6; ++i) film.add(picture(static_cast<uint8_t>(30 * i), 40, 200));
  film.finish();
  // The index comes before the pictures, so that a browser need not wait for the end.
  const std::string bytes = slurp(folder_ / "film.mp4");
  EXPECT_LT(bytes.find("moov"), bytes.find("mdat"));
  // A film in a codec that no browser knows, and one that is none, must be told apart from it.
  std::ofstream(folder_ / "none.mp4") << "not a film";
  for (const auto& [name, said] : {std::pair{"film.mp4", "plays 96x64 for 3 s"}, {"none.mp4", "refused"}}) {
    std::ofstream(folder_ / "page.html")
        << "<body><video muted preload=auto src=" << name
        << "></video><script>const v = document.querySelector('video');"
           "v.onerror = () => document.body.append('ref' + 'used');"
           "v.onloadeddata = () => document.body.append('plays ' + v.videoWidth + 'x' + v.videoHeight + "
           "' for ' + v.duration + ' s');</script></body>";
    const std::string html = shown_by_chromium(folder_ / "page.html", folder_ / "profile");
    EXPECT_NE(html.find(said), std::string::npos) << name << ": " << html;
  }
}

TEST_F(FilmTest, WithoutFinishNothingStaysBehind) {
  {
    Film film(folder_ / "film.mp4", 96, 64, 25);
    film.add(picture(1, 2, 3));
  }
  EXPECT_EQ(files(), 0u);
}

TEST_F(FilmTest, UnwritablePlacesAreErrors) {
  const fs::path nowhere = folder_ / "missing" / "film.mp4";
  try {
    Film film(nowhere, 96, 64, 25);
    FAIL() << "a film in a folder that does not exist";
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::Output);
    EXPECT_NE(std::string(error.what()).find(nowhere.string()), std::string::npos) << error.what();
  }
  EXPECT_THROW(write_png(picture(1, 2, 3), folder_ / "missing" / "picture.png"), Error);
}

}  // namespace
}  // namespace palpate::viz
