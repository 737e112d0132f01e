// Decoding of images and videos: bit for bit as OpenCV decodes them; PNGs are the bytes that it would write.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "capture/files/images/image_file.h"
#include "capture/files/images/images.h"
#include "capture/files/images/tiff_memory.h"
#include "capture/video/module.h"
#include "palpate/error.h"
#include "tests/support/recordings.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

class Decoding : public ::testing::Test {
 protected:
  Decoding() : folder_(fs::temp_directory_path() / ("palpate-decoding-" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~Decoding() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  static cv::Mat noise(int width, int height, int type, double top = 256) {
    cv::Mat image(height, width, type);
    cv::RNG(uint64_t{7}).fill(image, cv::RNG::UNIFORM, 0, top);
    return image;
  }

  std::string write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }

  static void expect_as_opencv(const std::string& file) {
    cv::Mat wanted = cv::imread(file, cv::IMREAD_UNCHANGED);
    ASSERT_FALSE(wanted.empty()) << file;
    if (wanted.channels() == 4) cv::cvtColor(wanted, wanted, cv::COLOR_BGRA2BGR);
    const cv::Mat found = read_image(file);
    ASSERT_EQ(found.type(), wanted.type()) << file;
    ASSERT_EQ(found.size(), wanted.size()) << file;
    EXPECT_EQ(cv::norm(wanted, found, cv::NORM_INF), 0) << file;
  }

  fs::path folder_;
};

TEST_F(Decoding, ImagesOfEveryKindAndDepth) {
  for (const char* end : {"png", "tif", "bmp", "ppm", "pgm", "jpg"})
    for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3, CV_16UC4, CV_32FC1})
      for (const auto& [width, height] : {std::pair{37, 23}, {1, 1}, {8, 3}, {513, 65}}) {
        const std::string file = path(std::to_string(type) + "_" + std::to_string(width) + "." + end);
        const bool deep = CV_MAT_DEPTH(type) == CV_16U, real = CV_MAT_DEPTH(type) == CV_32F,
                   tiff = end[0] == 't';
        const int channels = CV_MAT_CN(type);
        const std::string kind = end;
        if ((real && !tiff) || (deep && (kind == "bmp" || kind == "jpg"))) continue;
        if (channels == 4 && kind != "png" && kind != "tif" && kind != "bmp") continue;
        if ((kind == "ppm" && channels != 3) || (kind == "pgm" && channels != 1)) continue;
        ASSERT_TRUE(cv::imwrite(file, noise(width, height, type, deep ? 65536 : 256)));
        expect_as_opencv(file);
      }
}

TEST_F(Decoding, TiffsOfEveryCompression) {
  for (const int compression : {1, 5, 8, 32773})
    for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3}) {
      const std::string file = path("packed.tif");
      ASSERT_TRUE(cv::imwrite(file, noise(77, 41, type, 256), {cv::IMWRITE_TIFF_COMPRESSION, compression}));
      expect_as_opencv(file);
    }
}

TEST_F(Decoding, TiffsWithTilesTurnsAndInvertedGray) {
  for (const int bits : {8, 16})
    for (const bool tiled : {false, true})
      for (const int turn :
           {ORIENTATION_TOPLEFT, ORIENTATION_TOPRIGHT, ORIENTATION_BOTRIGHT, ORIENTATION_BOTLEFT})
        for (const int photometric : {PHOTOMETRIC_MINISBLACK, PHOTOMETRIC_MINISWHITE}) {
          const cv::Mat image = noise(64, 48, bits == 8 ? CV_8UC1 : CV_16UC1, bits == 8 ? 256 : 65536);
          TiffMemory memory;
          TiffPtr tiff = memory.create();
          TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, 64);
          TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, 48);
          TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, bits);
          TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
          TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC, photometric);
          TIFFSetField(tiff.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
          TIFFSetField(tiff.get(), TIFFTAG_ORIENTATION, turn);
          if (tiled) {
            TIFFSetField(tiff.get(), TIFFTAG_TILEWIDTH, 32);
            TIFFSetField(tiff.get(), TIFFTAG_TILELENGTH, 32);
            for (int y = 0; y < 48; y += 32)
              for (int x = 0; x < 64; x += 32) {
                cv::Mat tile(32, 32, image.type(), cv::Scalar(0));
                const cv::Mat from = image(cv::Rect(x, y, 32, std::min(32, 48 - y)));
                from.copyTo(tile(cv::Rect(0, 0, from.cols, from.rows)));
                TIFFWriteTile(tiff.get(), tile.data, static_cast<uint32_t>(x), static_cast<uint32_t>(y), 0,
                              0);
              }
          } else {
            TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP, 7);
            for (int y = 0; y < 48; ++y)
              TIFFWriteScanline(tiff.get(), const_cast<uint8_t*>(image.ptr(y)), static_cast<uint32_t>(y), 0);
          }
          TIFFFlush(tiff.get());
          tiff.reset();
          const std::vector<uint8_t> bytes = memory.take();
          SCOPED_TRACE(std::to_string(bits) + " bits, tiled " + std::to_string(tiled) + ", turn " +
                       std::to_string(turn) + ", photometric " + std::to_string(photometric));
          const std::string file = write("made.tif", std::string(bytes.begin(), bytes.end()));
          const bool mirrored = turn == ORIENTATION_TOPRIGHT || turn == ORIENTATION_BOTRIGHT;
          if (bits == 8 && tiled && mirrored) {  // OpenCV mirrors each tile by itself
            cv::Mat wanted = photometric == PHOTOMETRIC_MINISBLACK ? image : 255 - image;
            cv::flip(wanted, wanted, turn == ORIENTATION_BOTRIGHT ? -1 : 1);
            EXPECT_EQ(cv::norm(wanted, read_image(file), cv::NORM_INF), 0);
          } else {
            expect_as_opencv(file);
          }
        }
}

TEST_F(Decoding, PnmsAsTextAndBits) {
  expect_as_opencv(write("a.pgm", "P2\n# text\n3 2\n255\n0 17 255\n4 300 6\n"));
  expect_as_opencv(write("b.ppm", "P3\n2 2\n255\n1 2 3 4 5 6\n7 8 9 10 11 12\n"));
  expect_as_opencv(write("c.pgm", "P2\n3 1\n4095\n0 2048 4095\n"));
  expect_as_opencv(write("e.pgm", "P4\n10 2\n" + std::string("\xaa\x40\x0f\x80", 4)));
  expect_as_opencv(write("f.pgm", "P5\n3 1\n100\n" + std::string("\x00\x32\x64", 3)));
}

TEST_F(Decoding, BmpsOfFewColoursAndRuns) {
  const auto file = [&](uint32_t bits, uint32_t packing, bool coloured, const std::string& pixels,
                        int32_t height) {
    std::string head;
    const auto put = [&](uint32_t value, int count) {
      for (int i = 0; i < count; ++i) head += static_cast<char>(value >> 8 * i);
    };
    const uint32_t colours = bits <= 8 ? 1u << bits : 0, masks = packing == 3 ? 12 : 0;
    head = "BM";
    put(static_cast<uint32_t>(54 + masks + 4 * colours + pixels.size()), 4);
    put(0, 4);
    put(54 + masks + 4 * colours, 4);
    put(40, 4);
    put(10, 4);
    put(static_cast<uint32_t>(height), 4);
    put(1, 2);
    put(bits, 2);
    put(packing, 4);
    for (int i = 0; i < 5; ++i) put(0, 4);
    if (masks)
      for (const uint32_t mask : {0xf800u, 0x7e0u, 0x1fu}) put(mask, 4);
    for (uint32_t i = 0; i < colours; ++i)
      put(coloured ? i * 0x010307 : i * 255 / (colours - 1) * 0x010101, 4);
    return write("made.bmp", head + pixels);
  };
  std::string some;
  for (int i = 0; i < 400; ++i) some += static_cast<char>(i * 37);
  for (const bool coloured : {false, true})
    for (const int32_t height : {4, -4})
      for (const uint32_t bits : {1u, 4u, 8u})
        expect_as_opencv(file(bits, 0, coloured, some.substr(0, 48), height));
  for (const uint32_t bits : {16u, 24u, 32u})
    expect_as_opencv(file(bits, 0, false, some.substr(0, 10 * 4 * bits / 8 + 4 * (bits == 24 ? 2 : 0)), 4));
  expect_as_opencv(file(16, 3, false, some.substr(0, 80), 4));
  const std::string runs8(
      "\x0a\x05\x00\x00\x00\x05\x01\x02\x03\x04\x05\x00\x05\x07\x00\x00\x0a\x09\x00\x00\x0a\x01\x00\x01", 24);
  const std::string runs4(
      "\x0a\x35\x00\x00\x00\x05\x12\x34\x50\x00\x05\x77\x00\x00\x0a\x98\x00\x00\x0a\x11\x00\x01", 22);
  for (const bool coloured : {false, true}) {
    expect_as_opencv(file(8, 1, coloured, runs8, 4));
    expect_as_opencv(file(4, 2, coloured, runs4, 4));
  }
}

TEST_F(Decoding, PngsAreTheBytesThatOpencvWrites) {
  for (const int type : {CV_8UC1, CV_16UC1, CV_8UC3}) {
    const cv::Mat image = noise(123, 77, type, 40);
    const ImageView view{image.data,
                         123,
                         77,
                         static_cast<uint32_t>(image.channels()),
                         static_cast<uint32_t>(image.elemSize1()),
                         image.step[0]};
    std::vector<uint8_t> wanted;
    cv::imencode(".png", image, wanted, {cv::IMWRITE_PNG_COMPRESSION, 1});
    EXPECT_EQ(encode_png(view), wanted) << type;
    cv::imencode(".png", image, wanted);
    EXPECT_EQ(encode_png(view, PngPacking::Runs), wanted) << type;
    const std::vector<uint8_t> tiff = encode_tiff(view);
    EXPECT_EQ(cv::norm(cv::imdecode(tiff, cv::IMREAD_UNCHANGED), image, cv::NORM_INF), 0) << type;
  }
}

/// Every frame, the rate and the count, as cv::VideoCapture has them.
void expect_video_as_opencv(const std::string& file) {
  cv::VideoCapture wanted(file, cv::CAP_FFMPEG);
  const auto found = video_module().decode(file);
  ASSERT_TRUE(wanted.isOpened() && found) << file;
  EXPECT_EQ(found->width(), wanted.get(cv::CAP_PROP_FRAME_WIDTH)) << file;
  EXPECT_EQ(found->height(), wanted.get(cv::CAP_PROP_FRAME_HEIGHT)) << file;
  EXPECT_EQ(found->rate_Hz(), wanted.get(cv::CAP_PROP_FPS)) << file;
  EXPECT_EQ(found->frame_count(), wanted.get(cv::CAP_PROP_FRAME_COUNT)) << file;
  cv::Mat image;
  int frames = 0;
  while (wanted.read(image)) {
    ASSERT_TRUE(found->grab()) << file << " frame " << frames;
    const auto view = found->picture();
    ASSERT_TRUE(view);
    const cv::Mat decoded(static_cast<int>(view->height), static_cast<int>(view->width), CV_8UC3,
                          const_cast<uint8_t*>(view->pixels), view->row_bytes);
    ASSERT_EQ(decoded.size(), image.size()) << file;
    ASSERT_EQ(cv::norm(decoded, image, cv::NORM_INF), 0) << file << " frame " << frames;
    ++frames;
  }
  EXPECT_FALSE(found->grab()) << file;
  EXPECT_GT(frames, 0) << file;
}

TEST_F(Decoding, VideosOfManyCodecsAndSides) {
  for (const auto& [name, codec] : {std::pair{"a.avi", "MJPG"},
                                    {"b.mp4", "mp4v"},
                                    {"c.avi", "XVID"},
                                    {"d.avi", "FFV1"},
                                    {"e.avi", "MPNG"},
                                    {"f.mkv", "MJPG"},
                                    {"g.avi", "I420"}})
    for (const auto& [width, height] : {std::pair{64, 48}, {70, 54}, {322, 178}}) {
      const std::string file = path(name);
      {
        cv::VideoWriter out(file, cv::CAP_FFMPEG,
                            cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]), 24,
                            {width, height});
        ASSERT_TRUE(out.isOpened()) << name;
        for (int i = 0; i < 7; ++i) {
          cv::Mat picture = noise(width, height, CV_8UC3, 60 + 20 * i);
          cv::GaussianBlur(picture, picture, {0, 0}, 2);
          out.write(picture);
        }
      }
      expect_video_as_opencv(file);
    }
}

/// As a telephone writes it: upright only with the matrix in the track's head.
TEST_F(Decoding, VideosThatSayHowTheyAreTurned) {
  const std::string file = path("turned.mp4");
  {
    cv::VideoWriter out(file, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 24, {64, 48});
    for (int i = 0; i < 3; ++i) out.write(noise(64, 48, CV_8UC3));
  }
  std::ifstream in(file, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const size_t matrix = bytes.find("tkhd") + 4 + 40;
  for (const auto& [cosine, sine] : {std::pair{0, 1}, {-1, 0}, {0, -1}}) {
    const int32_t values[] = {cosine, sine, 0, -sine, cosine};
    for (size_t i = 0; i < 5; ++i) {
      const uint32_t fixed = static_cast<uint32_t>(values[i]) << 16;
      for (size_t k = 0; k < 4; ++k) bytes[matrix + 4 * i + k] = static_cast<char>(fixed >> (24 - 8 * k));
    }
    expect_video_as_opencv(write("turned2.mp4", bytes));
  }
}

TEST(Recordings, EveryVideoOfTheSharedDataDecodesAsOpencvDecodesIt) {
  const fs::path data = recordings_folder();
  if (!fs::exists(data)) GTEST_SKIP() << "no shared data";
  for (const auto& entry : fs::recursive_directory_iterator(data))
    if (entry.path().extension() == ".avi") expect_video_as_opencv(entry.path().string());
}

TEST_F(Decoding, WhatIsNoVideoHasNoDecoder) {
  EXPECT_EQ(video_module().decode(write("text.avi", "not a video")), nullptr);
  EXPECT_EQ(video_module().decode(path("none.avi")), nullptr);
  EXPECT_EQ(video_module().packets(path("none.avi")), nullptr);
}

}  // namespace
}  // namespace palpate
