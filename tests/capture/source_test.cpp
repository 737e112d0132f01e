// Recordings from files: frames are read as written, and every bad input gives one clear line.
#include "capture/open_source.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <random>

#include "capture/files/images/image_header.h"
#include "capture/files/images/images.h"
#include "capture/files/video.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

class SourceTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              ("palpate_source_test_" + std::string(test->name()) + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    sensor_.pitch_mm_per_px = 0.1;
    sensor_.name = "test";
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  static cv::Mat random_image(int width, int height, int type, double top, uint64_t seed = 1) {
    cv::Mat image(height, width, type);
    cv::RNG(seed).fill(image, cv::RNG::UNIFORM, 0, top + 1);
    return image;
  }

  /// A film whose frame n is gray 20 + 10 n; returns its path.
  std::string film(const std::string& name, int frames, int width = 64, int height = 48,
                   const char* fourcc = "MJPG") const {
    cv::VideoWriter out(path(name), cv::CAP_FFMPEG,
                        cv::VideoWriter::fourcc(fourcc[0], fourcc[1], fourcc[2], fourcc[3]), 25,
                        {width, height});
    EXPECT_TRUE(out.isOpened());
    for (int i = 0; i < frames; ++i) out.write(cv::Mat(height, width, CV_8UC3, cv::Scalar::all(20 + 10 * i)));
    return path(name);
  }

  /// Truncates a file to its first `fraction`.
  static void cut(const std::string& file, double fraction) {
    fs::resize_file(file, static_cast<uintmax_t>(static_cast<double>(fs::file_size(file)) * fraction));
  }

  /// Opens and reads all; expects Error(Failure::Input) whose line holds each of the words.
  void expect_refused(const std::string& input, const std::vector<std::string>& words) {
    ::testing::internal::CaptureStderr();
    struct Quiet {  // our one line is all that a person should see
      std::string input;
      ~Quiet() { EXPECT_EQ(::testing::internal::GetCapturedStderr(), "") << input; }
    } quiet{input};
    try {
      const auto source = open_source(input, sensor_);
      Frame frame;
      while (source->next(frame)) {
      }
      ADD_FAILURE() << input << " was accepted";
    } catch (const Error& e) {
      EXPECT_EQ(e.failure(), Failure::Input) << e.what();
      for (const std::string& word : words)
        EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << "'" << word << "' in: " << e.what();
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    }
  }

  fs::path folder_;
  Sensor sensor_;
};

TEST_F(SourceTest, NaturalOrder) {
  EXPECT_TRUE(natural_less("a2.png", "a10.png"));
  EXPECT_FALSE(natural_less("a10.png", "a2.png"));
  EXPECT_TRUE(natural_less("a002.png", "a10.png"));
  EXPECT_TRUE(natural_less("a", "a1"));
  EXPECT_TRUE(natural_less("a1b2", "a1b10"));
  EXPECT_NE(natural_less("a01", "a1"), natural_less("a1", "a01"));
  EXPECT_FALSE(natural_less("a1", "a1"));
  EXPECT_TRUE(natural_less("a99999999999999999999998", "a99999999999999999999999"));
}

TEST_F(SourceTest, DecimalsAreOneNumber) {
  EXPECT_TRUE(natural_less("s_0.25.png", "s_0.5.png"));
  EXPECT_TRUE(natural_less("s_0.75.png", "s_1.0.png"));
  EXPECT_TRUE(natural_less("9.75.png", "10.5.png"));
  EXPECT_TRUE(natural_less("s_0.5", "s_0.50"));  // the same number: the longer name is later
  EXPECT_TRUE(natural_less("1.png", "1.5.png"));
  EXPECT_FALSE(natural_less("1.5.png", "1.png"));
  EXPECT_TRUE(natural_less("frame.001.png", "frame.010.png"));
  EXPECT_TRUE(natural_less("v1.2.9", "v1.2.10"));
  EXPECT_TRUE(natural_less("1.9", "1.10", false));
  EXPECT_TRUE(natural_less("1.10", "1.9"));
  const auto sorted = [](std::vector<fs::path> files) {
    std::reverse(files.begin(), files.end());
    sort_naturally(files);
    return files;
  };
  const auto expect_kept = [&](const std::vector<fs::path>& files) { EXPECT_EQ(sorted(files), files); };
  expect_kept({"s_0.25.png", "s_0.5.png", "s_0.75.png", "s_1.0.png"});
  expect_kept({"0.10.png", "0.25.png", "0.50.png", "1.00.png"});
  expect_kept({"rest.png", "run1.8.png", "run1.9.png", "run1.10.png", "run1.11.png"});
  expect_kept({"-0.5.png", "a 2.5N.png", "a 10N.png"});
  expect_kept({"2026.11.2.png", "2026.11.23.png"});
  expect_kept({"frame000.png", "frame001.png", "frame010.png"});
}

TEST_F(SourceTest, GrayImagesArriveExactly) {
  for (const char* end : {"png", "tif", "pgm", "bmp"}) {
    for (const int type : {CV_8UC1, CV_16UC1}) {
      if (type == CV_16UC1 && std::string(end) == "bmp") continue;
      const std::string file = path("image" + std::to_string(type) + "." + end);
      const cv::Mat image = random_image(37, 23, type, type == CV_8UC1 ? 255 : 65535);
      cv::imwrite(file, image);
      sensor_.bit_depth = type == CV_8UC1 ? 8 : 16;
      const auto source = open_source(file, sensor_);
      EXPECT_EQ(source->format(), (FrameFormat{37, 23, 1, sensor_.bit_depth}));
      EXPECT_EQ(source->frame_count(), 1u);
      Frame frame;
      ASSERT_TRUE(source->next(frame)) << file;
      for (int y = 0; y < 23; ++y) {
        for (int x = 0; x < 37; ++x) {
          const uint32_t wanted = type == CV_8UC1 ? image.at<uint8_t>(y, x) : image.at<uint16_t>(y, x);
          ASSERT_EQ(frame.at(0, static_cast<uint32_t>(x), static_cast<uint32_t>(y)), wanted)
              << file << ' ' << x << ' ' << y;
        }
      }
      EXPECT_FALSE(source->next(frame));
    }
  }
}

TEST_F(SourceTest, ColourArrivesAsPlanesRedGreenBlue) {
  const cv::Mat image = random_image(31, 19, CV_8UC3, 255);
  cv::imwrite(path("c.png"), image);
  sensor_.channels = 3;
  Frame frame;
  ASSERT_TRUE(open_source(path("c.png"), sensor_)->next(frame));
  ASSERT_EQ(frame.format, (FrameFormat{31, 19, 3, 8}));
  for (uint32_t y = 0; y < 19; ++y)
    for (uint32_t x = 0; x < 31; ++x)
      for (uint32_t c = 0; c < 3; ++c)
        ASSERT_EQ(frame.at(c, x, y),
                  image.at<cv::Vec3b>(static_cast<int>(y), static_cast<int>(x))[2 - static_cast<int>(c)]);
  // For a gray sensor it is turned gray.
  sensor_.channels = 1;
  ASSERT_TRUE(open_source(path("c.png"), sensor_)->next(frame));
  const cv::Vec3b p = image.at<cv::Vec3b>(7, 11);
  EXPECT_NEAR(frame.at(0, 11, 7), 0.114 * p[0] + 0.587 * p[1] + 0.299 * p[2], 0.6);
}

TEST_F(SourceTest, FolderIsReadInNaturalOrderWithoutItsBackground) {
  for (int i : {1, 2, 10, 9, 100})
    cv::imwrite(path("f" + std::to_string(i) + ".png"), cv::Mat(4, 5, CV_8UC1, cv::Scalar(i)));
  cv::imwrite(path("empty.png"), cv::Mat(4, 5, CV_8UC1, cv::Scalar(77)));
  std::ofstream(path("notes.txt")) << "not an image";
  sensor_.background.image = path("empty.png");
  const auto source = open_source(folder_.string(), sensor_);
  EXPECT_EQ(source->frame_count(), 5u);
  EXPECT_EQ(source->rate_Hz(), 0);
  Frame frame;
  uint64_t sequence = 0;
  for (uint32_t wanted : {1u, 2u, 9u, 10u, 100u}) {
    ASSERT_TRUE(source->next(frame));
    EXPECT_EQ(frame.at(0, 0, 0), wanted);
    EXPECT_EQ(frame.sequence, sequence++);
  }
  EXPECT_FALSE(source->next(frame));
  EXPECT_EQ(load_background(folder_.string(), sensor_, *source).at(0, 2, 2), 77u);
}

TEST_F(SourceTest, CropAndQuadRectify) {
  // A ramp seen through a perspective: the rectified image must be the ramp again.
  const int w = 120, h = 90;
  cv::Mat ramp(h, w, CV_16UC1);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) ramp.at<uint16_t>(y, x) = static_cast<uint16_t>(1000 + 200 * x + 100 * y);
  const cv::Point2f flat[4] = {{0, 0}, {w - 1.0f, 0}, {w - 1.0f, h - 1.0f}, {0, h - 1.0f}};
  const cv::Point2f seen[4] = {{40, 30}, {360, 50}, {330, 290}, {60, 260}};
  cv::Mat picture;
  cv::warpPerspective(ramp, picture, cv::getPerspectiveTransform(flat, seen), {400, 320}, cv::INTER_LINEAR,
                      cv::BORDER_REPLICATE);
  cv::Mat framed;
  cv::copyMakeBorder(picture, framed, 20, 5, 30, 7, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::imwrite(path("seen.png"), framed);
  sensor_.bit_depth = 16;
  sensor_.crop_px = {30, 20, 400, 320};
  sensor_.quad_px.emplace();
  for (int i = 0; i < 4; ++i) (*sensor_.quad_px)[static_cast<size_t>(i)] = {seen[i].x, seen[i].y};
  sensor_.size_px = {w, h};
  Frame frame;
  ASSERT_TRUE(open_source(path("seen.png"), sensor_)->next(frame));
  ASSERT_EQ(frame.format, (FrameFormat{w, h, 1, 16}));
  for (int y = 2; y < h - 2; ++y)
    for (int x = 2; x < w - 2; ++x)
      ASSERT_NEAR(frame.at(0, static_cast<uint32_t>(x), static_cast<uint32_t>(y)), ramp.at<uint16_t>(y, x),
                  30)
          << x << ' ' << y;

  sensor_.quad_px.reset();
  sensor_.size_px = {};
  ASSERT_TRUE(open_source(path("seen.png"), sensor_)->next(frame));
  EXPECT_EQ(frame.format, (FrameFormat{400, 320, 1, 16}));
  EXPECT_EQ(frame.at(0, 100, 200), picture.at<uint16_t>(200, 100));
}

TEST_F(SourceTest, MismatchBetweenSensorAndImagesIsNamed) {
  cv::imwrite(path("g8.png"), random_image(20, 10, CV_8UC1, 255));
  cv::imwrite(path("g16.png"), random_image(20, 10, CV_16UC1, 65535));
  sensor_.bit_depth = 12;
  expect_refused(path("g8.png"), {"16-bit", "12 bits", "8-bit gray", "bit_depth"});
  expect_refused(path("g16.png"), {"up to 4095", "12 bits", "g16.png", "\"bit_depth\": 16"});
  sensor_.bit_depth = 8;
  expect_refused(path("g16.png"), {"8-bit images", "16-bit gray", "bit_depth"});
  sensor_.channels = 3;
  expect_refused(path("g8.png"), {"3 channels", "gray", "channels"});
  sensor_.channels = 1;
  sensor_.camera_px = {40, 20};
  expect_refused(path("g8.png"), {"40x20", "camera_px", "20x10", "camera mode"});
  sensor_.camera_px = {20, 10};
  sensor_.crop_px = {5, 5, 16, 4};
  expect_refused(path("g8.png"), {"crop_px", "16x4", "20x10"});
  sensor_.crop_px.reset();
  sensor_.size_px = {21, 10};
  expect_refused(path("g8.png"), {"21x10", "20x10"});
  sensor_.quad_px = {{{0, 0}, {19, 0}, {40, 9}, {0, 9}}};
  expect_refused(path("g8.png"), {"quad_px", "40", "20x10"});
}

TEST_F(SourceTest, TwelveBitsInSixteenAreAccepted) {
  cv::imwrite(path("g12.png"), random_image(20, 10, CV_16UC1, 4095));
  sensor_.bit_depth = 12;
  Frame frame;
  ASSERT_TRUE(open_source(path("g12.png"), sensor_)->next(frame));
  EXPECT_EQ(frame.format.bit_depth, 12u);
}

TEST_F(SourceTest, GraymapsOfTwelveBitsKeepTheirValues) {
  std::ofstream out(path("camera.pgm"), std::ios::binary);
  out << "P5\n# exposure 4 ms\n4 1\n4095\n"
      << std::string("\x00\x00\x00\x01\x08\x00\x0f\xff", 8);  // big endian
  out.close();
  sensor_.bit_depth = 12;
  Frame frame;
  ASSERT_TRUE(open_source(path("camera.pgm"), sensor_)->next(frame));
  const uint32_t wanted[] = {0, 1, 0x800, 0xfff};
  for (uint32_t x = 0; x < 4; ++x) EXPECT_EQ(frame.at(0, x, 0), wanted[x]);
}

TEST_F(SourceTest, ChangingSizeNamesFileAndBothSizes) {
  cv::imwrite(path("a1.png"), random_image(20, 10, CV_8UC1, 255));
  cv::imwrite(path("a2.png"), random_image(21, 10, CV_8UC1, 255));
  expect_refused(folder_.string(), {"20x10", "21x10", "a2.png"});
  cv::imwrite(path("a2.png"), random_image(20, 10, CV_16UC1, 255));
  expect_refused(folder_.string(), {"a2.png", "16-bit"});
}

TEST_F(SourceTest, MissingEmptyAndForeignFiles) {
  expect_refused(path("none.avi"), {"nothing at", "none.avi"});
  expect_refused(folder_.string(), {"none in", folder_.string()});
  std::ofstream(path("empty.avi")).close();
  std::ofstream(path("empty.png")).close();
  std::ofstream(path("text.avi")) << "this is not a video, whatever its name says";
  std::ofstream(path("text.png")) << "this is not an image";
  expect_refused(path("empty.avi"), {"empty.avi"});
  expect_refused(path("empty.png"), {"empty.png"});
  expect_refused(path("text.avi"), {"text.avi"});
  expect_refused(path("text.png"), {"text.png"});
}

TEST_F(SourceTest, ImagesCutShortOrDamagedAreRefused) {
  const cv::Mat image = random_image(200, 150, CV_8UC3, 255);
  for (const char* end : {"png", "jpg", "bmp", "ppm", "tif"}) {
    const std::string file = path(std::string("cut.") + end);
    for (const double fraction : {0.9, 0.5, 0.1, 0.001}) {
      cv::imwrite(file, image);
      cut(file, fraction);
      expect_refused(file, {"cut."});
    }
    fs::remove(file);
  }
  cv::imwrite(path("bad.png"), image);
  std::fstream file(path("bad.png"), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>(fs::file_size(path("bad.png")) / 2));
  file.put('\x5a').put('\xa5');
  file.close();
  expect_refused(path("bad.png"), {"PNG", "damaged"});

  // Inside a JPEG there are no check sums: only the decoder notices.
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", image, bytes);
  std::fill(bytes.begin() + static_cast<long>(bytes.size() / 2), bytes.end() - 2, uint8_t{0x12});
  std::ofstream(path("bad.jpg"), std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  expect_refused(path("bad.jpg"), {"JPEG", "damaged"});
}

TEST_F(SourceTest, AbsurdSizesAreRefusedByTheirHeader) {
  std::ofstream(path("huge.pgm")) << "P5\n# lies\n60000 50000\n255\nabc";
  expect_refused(path("huge.pgm"), {"60000x50000", "16384"});
  cv::imwrite(path("wide.png"), cv::Mat(1, static_cast<int>(kMaxSide_px) + 1, CV_8UC1, cv::Scalar(3)));
  expect_refused(path("wide.png"), {"16385x1", "16384"});
  cv::imwrite(path("widest.png"), cv::Mat(1, static_cast<int>(kMaxSide_px), CV_8UC1, cv::Scalar(3)));
  Frame frame;
  EXPECT_TRUE(open_source(path("widest.png"), sensor_)->next(frame));
}

TEST_F(SourceTest, HeadersAreReadWithoutDecoding) {
  for (const char* end : {"png", "jpg", "bmp", "ppm", "pgm", "tif"}) {
    for (const int type : {CV_8UC1, CV_8UC3}) {
      if ((std::string(end) == "ppm") != (type == CV_8UC3) && std::string(end)[0] == 'p' &&
          std::string(end)[1] != 'n')
        continue;
      std::vector<uint8_t> bytes;
      cv::imencode(std::string(".") + end, random_image(123, 45, type, 255), bytes);
      const auto header = read_image_header(bytes);
      ASSERT_TRUE(header) << end;
      EXPECT_EQ(header->width, 123u) << end;
      EXPECT_EQ(header->height, 45u) << end;
      EXPECT_TRUE(header->whole) << end;
      // No prefix and no damaged byte may crash or hang it.
      std::mt19937 random(3);
      for (int i = 0; i < 300; ++i) {
        std::vector<uint8_t> other(bytes.begin(), bytes.begin() + static_cast<long>(random() % bytes.size()));
        if (!other.empty()) other[random() % other.size()] = static_cast<uint8_t>(random());
        if (!other.empty() && i % 2)
          other[random() % std::min<size_t>(other.size(), 64)] = static_cast<uint8_t>(random());
        read_image_header(other);
      }
    }
  }
}

TEST_F(SourceTest, VideoFramesComeInOrderWithTheirTimes) {
  const auto source = open_source(film("film.avi", 10), sensor_);
  EXPECT_EQ(source->format(), (FrameFormat{64, 48, 1, 8}));
  EXPECT_DOUBLE_EQ(source->rate_Hz(), 25);
  EXPECT_EQ(source->frame_count(), 10u);
  Frame frame;
  for (uint32_t i = 0; i < 10; ++i) {
    ASSERT_TRUE(source->next(frame));
    EXPECT_EQ(frame.sequence, i);
    EXPECT_EQ(frame.time_ns, i * 40'000'000ll);
    EXPECT_NEAR(frame.at(0, 30, 20), 20.0 + 10 * i, 2);
  }
  EXPECT_FALSE(source->next(frame));
  EXPECT_EQ(source->warning(), "");
  sensor_.channels = 3;
  EXPECT_EQ(open_source(path("film.avi"), sensor_)->format().channels, 3u);
}

TEST_F(SourceTest, TruncatedVideoGivesWhatDecodesAndSaysSo) {
  const std::string file = film("cut.avi", 40);
  cut(file, 0.5);
  const auto source = open_source(file, sensor_);
  EXPECT_EQ(source->warning(), "");  // not known before the end
  Frame frame;
  uint64_t read = 0;
  while (source->next(frame)) ++read;
  EXPECT_GT(read, 5u);
  EXPECT_LT(read, 40u);
  EXPECT_NE(source->warning().find("announces 40"), std::string::npos) << source->warning();
  EXPECT_NE(source->warning().find(std::to_string(read)), std::string::npos) << source->warning();
  EXPECT_FALSE(source->next(frame));
}

TEST_F(SourceTest, VideoWithoutFramesIsRefused) {
  const std::string file = film("none.avi", 5);
  // Headers only: cut where the frames' list begins.
  std::ifstream in(file, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const size_t movi = bytes.find("movi");
  ASSERT_NE(movi, std::string::npos);
  fs::resize_file(file, movi + 4);
  expect_refused(file, {"none.avi"});
  // An MP4 that lost its index cannot be opened at all.
  const std::string mp4 = film("lost.mp4", 30, 64, 48, "mp4v");
  cut(mp4, 0.6);
  expect_refused(mp4, {"lost.mp4"});
}

TEST_F(SourceTest, VideoThatChangesSizeNamesTheFrame) {
  // Motion JPEG without container: one image after the other.
  std::ofstream out(path("changing.mjpg"), std::ios::binary);
  for (const auto& [width, height] : {std::pair{64, 48}, {64, 48}, {80, 48}, {80, 48}}) {
    std::vector<uint8_t> bytes;
    cv::imencode(".jpg", random_image(width, height, CV_8UC3, 255), bytes);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  out.close();
  expect_refused(path("changing.mjpg"), {"64x48", "80x48", "frame 2"});
}

TEST_F(SourceTest, VideoForADeepSensorIsRefusedWithAHint) {
  film("film.avi", 3);
  sensor_.bit_depth = 12;
  expect_refused(path("film.avi"), {"12 bits", "video", "16-bit images"});
}

TEST_F(SourceTest, ADamagedPictureIsNoPartOfTheBackground) {
  for (const int bad : {0, 2, 3}) {
    const std::string folder = path("begins" + std::to_string(bad));
    fs::create_directories(folder);
    for (int i = 0; i < 6; ++i) {
      cv::Mat image =
          random_image(160, 120, CV_8UC3, 8, static_cast<uint64_t>(i) + 1) + cv::Scalar(90, 100, 110);
      if (i == bad) image.rowRange(60, 120) = cv::Scalar(0, 135, 0);  // as a camera starts
      cv::imwrite(folder + "/" + std::to_string(i) + ".png", image);
    }
    sensor_.channels = 3;
    sensor_.background.first_frames = 4;
    const auto source = open_source(folder, sensor_);
    const Frame background = load_background(folder, sensor_, *source);
    for (const uint32_t channel : {0u, 1u, 2u})
      EXPECT_NEAR(background.at(channel, 80, 100), 114 - 10.0 * channel, 6) << bad;
  }
}

TEST_F(SourceTest, BackgroundFromFirstFrames) {
  film("film.avi", 10);
  sensor_.background.first_frames = 3;
  const auto source = open_source(path("film.avi"), sensor_);
  Frame frame;
  ASSERT_TRUE(source->next(frame));
  const Frame background = load_background(path("film.avi"), sensor_, *source);
  EXPECT_EQ(background.format, source->format());
  EXPECT_NEAR(background.at(0, 10, 10), 30, 2);  // mean of 20, 30, 40
  ASSERT_TRUE(source->next(frame));              // the open source lost nothing
  EXPECT_EQ(frame.sequence, 1u);

  sensor_.background.first_frames = 11;
  EXPECT_THROW(load_background(path("film.avi"), sensor_, *source), Error);
}

TEST_F(SourceTest, BackgroundThatDoesNotFit) {
  cv::imwrite(path("one.png"), random_image(20, 10, CV_8UC1, 255));
  cv::imwrite(path("other.png"), random_image(22, 10, CV_8UC1, 255));
  const auto source = open_source(path("one.png"), sensor_);
  EXPECT_THROW(load_background(path("one.png"), sensor_, *source),
               Error);  // the image would be its own background
  sensor_.background.image = path("other.png");
  try {
    load_background(path("one.png"), sensor_, *source);
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("20x10"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("22x10"), std::string::npos) << e.what();
  }
  sensor_.background.image = path("missing.png");
  EXPECT_THROW(load_background(path("one.png"), sensor_, *source), Error);
}

TEST_F(SourceTest, AlphaIsDropped) {
  cv::imwrite(path("alpha.png"), random_image(20, 10, CV_8UC4, 255));
  sensor_.channels = 3;
  Frame frame;
  EXPECT_TRUE(open_source(path("alpha.png"), sensor_)->next(frame));
}

}  // namespace
}  // namespace palpate
