// Every pixel format against plain loops: sizes, padding, short and damaged buffers.
#include "capture/camera/formats.h"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>

namespace palpate {
namespace {

struct Buffer {
  std::vector<uint8_t> bytes;
  RawImage raw;
};

const PixelFormat& format_of(const char* name) {
  return *find_pixel_format(std::string_view(name));
}

/// Random pixels within the format's bits; rows padded by `padding` bytes of 0xAA, none after the last.
Buffer random_buffer(const PixelFormat& format, uint32_t width, uint32_t height, uint32_t padding,
                     unsigned seed = 1) {
  Buffer b;
  std::mt19937 random(seed);
  const size_t row = least_stride_bytes(format, width), stride = row + padding;
  b.bytes.assign(stride * (height - 1) + row, 0xAA);
  for (uint32_t y = 0; y < height; ++y)
    for (size_t i = 0; i < row; ++i) {
      const bool high = format.layout == PixelLayout::Gray16 && i % 2 == 1;
      b.bytes[y * stride + i] =
          static_cast<uint8_t>(random() & (high ? (1u << (format.bit_depth - 8)) - 1 : 0xffu));
    }
  b.raw = {b.bytes, width, height, static_cast<uint32_t>(stride)};
  return b;
}

int byte_at(const RawImage& raw, int x, int y) {
  return raw.bytes[size_t(y) * raw.stride_bytes + size_t(x)];
}

TEST(V4l2Formats, GrayIsThePixelsThemselves) {
  for (const char* name : {"GREY", "Y10", "Y12", "Y16", "NV12", "YUYV", "UYVY"}) {
    const PixelFormat& format = format_of(name);
    for (const auto& [w, h] : {std::pair{1u, 1u}, {2u, 3u}, {7u, 5u}, {64u, 48u}, {31u, 17u}}) {
      for (const uint32_t padding : {0u, 1u, 4u, 60u}) {
        const Buffer b = random_buffer(format, w, h, padding);
        cv::Mat image;
        ASSERT_EQ(decode(format, b.raw, 1, image), "") << name << w << "x" << h << "+" << padding;
        ASSERT_EQ(image.size(), cv::Size(int(w), int(h)));
        for (int y = 0; y < int(h); ++y) {
          for (int x = 0; x < int(w); ++x) {
            int wanted = 0, found = 0;
            if (format.layout == PixelLayout::Gray16) {
              wanted = byte_at(b.raw, 2 * x, y) + 256 * byte_at(b.raw, 2 * x + 1, y);
              found = image.at<uint16_t>(y, x);
            } else {
              const bool packed = format.layout == PixelLayout::Yuyv || format.layout == PixelLayout::Uyvy;
              wanted = byte_at(b.raw, packed ? 2 * x + (format.layout == PixelLayout::Uyvy) : x, y);
              found = image.at<uint8_t>(y, x);
            }
            ASSERT_EQ(found, wanted) << name << " " << w << "x" << h << "+" << padding << " at " << x << ","
                                     << y;
          }
        }
      }
    }
  }
}

TEST(V4l2Formats, ColourOfPackedYuvIsBt601) {
  for (const char* name : {"YUYV", "UYVY"}) {
    const PixelFormat& format = format_of(name);
    const bool y_first = format.layout == PixelLayout::Yuyv;
    for (const uint32_t w : {2u, 16u, 15u, 1u}) {
      const Buffer b = random_buffer(format, w, 9, 12);
      cv::Mat image;
      ASSERT_EQ(decode(format, b.raw, 3, image), "");
      for (int y = 0; y < 9; ++y) {
        for (int x = 0; x < int(w); ++x) {
          const int pair = x / 2 * 4, luma = pair + x % 2 * 2 + (y_first ? 0 : 1),
                    chroma = pair + (y_first ? 1 : 0);
          const double l = 1.164 * (byte_at(b.raw, luma, y) - 16), u = byte_at(b.raw, chroma, y) - 128.0,
                       v = byte_at(b.raw, chroma + 2, y) - 128.0;
          const double bgr[3] = {l + 2.018 * u, l - 0.391 * u - 0.813 * v, l + 1.596 * v};
          for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(image.at<cv::Vec3b>(y, x)[c], std::clamp(std::max(-18.63, bgr[c]), 0.0, 255.0),
                        20.0 * (byte_at(b.raw, luma, y) < 16) + 1.6)
                << name << " width " << w << " at " << x << "," << y << " channel " << c;
        }
      }
    }
  }
}

/// Colour that the mosaic holds at a place: 0 blue, 1 green, 2 red.
int colour_at(const PixelFormat& format, int x, int y) {
  const std::string order(format.name, 4);
  const char c = order[size_t(y % 2 * 2 + x % 2)];
  return c == 'B' ? 0 : c == 'G' ? 1 : 2;
}

TEST(V4l2Formats, MosaicsAreInterpolatedBilinearly) {
  for (const char* name : {"RGGB8", "GRBG8", "GBRG8", "BGGR8"}) {
    const PixelFormat& format = format_of(name);
    for (const auto& [w, h] : {std::pair{8u, 6u}, {9u, 7u}, {33u, 20u}}) {
      for (const uint32_t padding : {0u, 5u}) {
        const Buffer b = random_buffer(format, w, h, padding);
        cv::Mat colour, gray;
        ASSERT_EQ(decode(format, b.raw, 3, colour), "");
        ASSERT_EQ(decode(format, b.raw, 1, gray), "");
        for (int y = 1; y + 1 < int(h); ++y) {
          for (int x = 1; x + 1 < int(w); ++x) {
            double wanted[3];
            for (int c = 0; c < 3; ++c) {
              // The nearest of that colour: itself, else the mean of those beside it, else of the corners.
              double sum = 0;
              int n = 0;
              const auto add = [&](int dx, int dy) {
                if (colour_at(format, x + dx, y + dy) != c) return;
                sum += byte_at(b.raw, x + dx, y + dy);
                ++n;
              };
              add(0, 0);
              if (n == 0) add(-1, 0), add(1, 0), add(0, -1), add(0, 1);
              if (n == 0) add(-1, -1), add(1, -1), add(-1, 1), add(1, 1);
              wanted[c] = sum / n;
              ASSERT_NEAR(colour.at<cv::Vec3b>(y, x)[c], wanted[c], 0.76)
                  << name << " at " << x << "," << y << " channel " << c;
            }
            ASSERT_NEAR(gray.at<uint8_t>(y, x), 0.114 * wanted[0] + 0.587 * wanted[1] + 0.299 * wanted[2], 2)
                << name << " at " << x << "," << y;
          }
        }
        // The border repeats what is next to it.
        for (int x = 1; x + 1 < int(w); ++x)
          ASSERT_EQ(colour.at<cv::Vec3b>(0, x), colour.at<cv::Vec3b>(1, x)) << name;
        for (int y = 0; y < int(h); ++y)
          ASSERT_EQ(colour.at<cv::Vec3b>(y, 0), colour.at<cv::Vec3b>(y, 1)) << name;
      }
    }
    cv::Mat image;
    const Buffer tiny = random_buffer(format, 2, 2, 0);
    EXPECT_EQ(decode(format, tiny.raw, 3, image), "a mosaic of 2x2 px");
  }
}

std::vector<uint8_t> jpeg_of(const cv::Mat& image) {
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, 95});
  return bytes;
}

cv::Mat smooth_picture(int type) {
  cv::Mat image(48, 64, type);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      if (type == CV_8UC1) {
        image.at<uint8_t>(y, x) = static_cast<uint8_t>(2 * x + y);
      } else {
        image.at<cv::Vec3b>(y, x) = {static_cast<uint8_t>(3 * x), static_cast<uint8_t>(4 * y),
                                     static_cast<uint8_t>(x + y)};
      }
    }
  return image;
}

TEST(V4l2Formats, MotionJpegDecodesAndItsDamageShows) {
  const PixelFormat& format = format_of("MJPEG");
  const cv::Mat picture = smooth_picture(CV_8UC3);
  std::vector<uint8_t> bytes = jpeg_of(picture);
  bytes.resize(bytes.size() + 100);  // cameras pad
  cv::Mat image;
  ASSERT_EQ(decode(format, {bytes, 64, 48, 0}, 3, image), "");
  EXPECT_LT(cv::norm(image, picture, cv::NORM_L1) / double(picture.total() * 3), 3);
  cv::Mat gray;
  ASSERT_EQ(decode(format, {bytes, 64, 48, 0}, 1, gray), "");
  EXPECT_EQ(gray.type(), CV_8UC1);
  const auto p = image.at<cv::Vec3b>(20, 30);
  EXPECT_NEAR(gray.at<uint8_t>(20, 30), 0.114 * p[0] + 0.587 * p[1] + 0.299 * p[2], 1);

  EXPECT_EQ(decode(format, {bytes, 32, 48, 0}, 3, image), "a JPEG of 64x48 px");
  const std::vector<uint8_t> of_gray = jpeg_of(smooth_picture(CV_8UC1));
  EXPECT_EQ(decode(format, {of_gray, 64, 48, 0}, 3, image), "a gray JPEG");
  EXPECT_EQ(decode(format, {of_gray, 64, 48, 0}, 1, gray), "");
  EXPECT_EQ(decode(format, {{}, 64, 48, 0}, 3, image), "a damaged JPEG");
  // Cut short anywhere: refused, never filled up with gray.
  for (size_t length = 0; length + 102 < bytes.size(); length += 37)
    EXPECT_EQ(decode(format, {std::span(bytes).first(length), 64, 48, 0}, 3, image), "a damaged JPEG")
        << length;
}

TEST(V4l2Formats, MotionJpegMayLackItsHuffmanTables) {
  const std::vector<uint8_t> whole = jpeg_of(smooth_picture(CV_8UC3));
  std::vector<uint8_t> bare(whole.begin(), whole.begin() + 2);
  for (size_t i = 2; i + 4 < whole.size();) {
    const size_t length = 2 + size_t(whole[i + 2]) * 256 + whole[i + 3];
    if (whole[i + 1] == 0xDA) {  // the rest is pixels
      bare.insert(bare.end(), whole.begin() + long(i), whole.end());
      break;
    }
    if (whole[i + 1] != 0xC4)
      bare.insert(bare.end(), whole.begin() + long(i), whole.begin() + long(i + length));
    i += length;
  }
  ASSERT_LT(bare.size() + 100, whole.size());
  cv::Mat image, wanted;
  ASSERT_EQ(decode(format_of("MJPEG"), {bare, 64, 48, 0}, 3, image), "");
  ASSERT_EQ(decode(format_of("MJPEG"), {whole, 64, 48, 0}, 3, wanted), "");
  EXPECT_EQ(cv::norm(image, wanted, cv::NORM_INF), 0);
}

// Bytes by hand, after the GenICam Pixel Format Naming Convention and GigE Vision: 0xABC, 0x123, 0xDEF.
TEST(V4l2Formats, TwelveBitsInABufferOfTheirOwnOrder) {
  const std::vector<uint8_t> p = {0xBC, 0x3A, 0x12, 0xEF, 0x0D, 0x77},
                             packed = {0xAB, 0x3C, 0x12, 0xDE, 0x0F, 0x77};
  for (const auto& [name, bytes] : {std::pair{"Mono12p", &p}, {"mono12packed", &packed}}) {
    cv::Mat image;
    ASSERT_EQ(decode(format_of(name), {*bytes, 3, 1, 6}, 1, image), "") << name;
    ASSERT_EQ(image.type(), CV_16UC1);
    EXPECT_EQ(image.at<uint16_t>(0, 0), 0xABC) << name;
    EXPECT_EQ(image.at<uint16_t>(0, 1), 0x123) << name;
    EXPECT_EQ(image.at<uint16_t>(0, 2), 0xDEF) << name;
    EXPECT_EQ(least_stride_bytes(format_of(name), 3), 5u);
    EXPECT_EQ(least_stride_bytes(format_of(name), 4), 6u);
  }
}

TEST(V4l2Formats, AMosaicOfTwelveBitsIsThatOfItsUpperEight) {
  for (const char* colours : {"RG", "GR", "GB", "BG"}) {
    std::mt19937 random(5);
    std::vector<uint8_t> eight(6 * 4), low(36), packed(36);
    for (size_t i = 0; i < eight.size(); i += 2) {
      const uint32_t a = random() & 0xfff, b = random() & 0xfff;
      eight[i] = static_cast<uint8_t>(a >> 4);
      eight[i + 1] = static_cast<uint8_t>(b >> 4);
      uint8_t* l = &low[i / 2 * 3];
      l[0] = static_cast<uint8_t>(a), l[1] = static_cast<uint8_t>(a >> 8 | (b & 15) << 4),
      l[2] = static_cast<uint8_t>(b >> 4);
      uint8_t* g = &packed[i / 2 * 3];
      g[0] = static_cast<uint8_t>(a >> 4), g[1] = static_cast<uint8_t>((a & 15) | (b & 15) << 4),
      g[2] = static_cast<uint8_t>(b >> 4);
    }
    const std::string name = std::string("Bayer") + colours;
    for (const uint32_t channels : {1u, 3u}) {
      cv::Mat wanted, image;
      ASSERT_EQ(decode(format_of((name + "8").c_str()), {eight, 6, 4, 6}, channels, wanted), "");
      ASSERT_EQ(decode(format_of((name + "12p").c_str()), {low, 6, 4, 9}, channels, image), "");
      EXPECT_EQ(cv::norm(wanted, image, cv::NORM_INF), 0) << name;
      ASSERT_EQ(decode(format_of((name + "12Packed").c_str()), {packed, 6, 4, 9}, channels, image), "");
      EXPECT_EQ(cv::norm(wanted, image, cv::NORM_INF), 0) << name;
    }
  }
}

TEST(V4l2Formats, RedGreenBlueIsWhatItSays) {
  const std::vector<uint8_t> bytes = {10, 20, 30, 200, 0, 50, 0xAA};
  for (const bool red_first : {true, false}) {
    const PixelFormat& format = format_of(red_first ? "RGB8" : "BGR8");
    cv::Mat colour, gray;
    ASSERT_EQ(decode(format, {bytes, 2, 1, 7}, 3, colour), "");
    EXPECT_EQ(colour.at<cv::Vec3b>(0, 0), red_first ? cv::Vec3b(30, 20, 10) : cv::Vec3b(10, 20, 30));
    EXPECT_EQ(colour.at<cv::Vec3b>(0, 1), red_first ? cv::Vec3b(50, 0, 200) : cv::Vec3b(200, 0, 50));
    ASSERT_EQ(decode(format, {bytes, 2, 1, 7}, 1, gray), "");
    EXPECT_NEAR(gray.at<uint8_t>(0, 0),
                0.299 * (red_first ? 10 : 30) + 0.587 * 20 + 0.114 * (red_first ? 30 : 10), 1);
  }
}

TEST(V4l2Formats, ShortBuffersAreRefused) {
  for (const PixelFormat& format : pixel_formats()) {
    if (format.layout == PixelLayout::Jpeg) continue;
    Buffer b = random_buffer(format, 16, 8, 6);
    ASSERT_EQ(b.bytes.size(), needed_bytes(format, b.raw)) << format.name;
    for (const uint32_t channels : {1u, format.channels}) {
      cv::Mat image;
      EXPECT_EQ(decode(format, b.raw, channels, image), "") << format.name;
      RawImage cut = b.raw;
      cut.bytes = cut.bytes.first(b.bytes.size() - 1);
      EXPECT_NE(decode(format, cut, channels, image).find("in place of"), std::string::npos) << format.name;
      cut.bytes = {};
      EXPECT_NE(decode(format, cut, channels, image), "") << format.name;
      RawImage narrow = b.raw;
      narrow.stride_bytes = uint32_t(least_stride_bytes(format, 16)) - 1;
      EXPECT_NE(decode(format, narrow, channels, image).find("rows of"), std::string::npos) << format.name;
    }
    cv::Mat image;
    EXPECT_EQ(decode(format, b.raw, 3, image), format.channels == 1 ? "gray pixels" : "") << format.name;
    EXPECT_NE(decode(format, b.raw, 2, image), "");
  }
}

TEST(V4l2Formats, ValuesBeyondTheBitsAreRefused) {
  for (const char* name : {"Y10", "Y12"}) {
    const PixelFormat& format = format_of(name);
    Buffer b = random_buffer(format, 5, 4, 2);
    cv::Mat image;
    EXPECT_EQ(decode(format, b.raw, 1, image), "");
    b.bytes[2 * size_t{b.raw.stride_bytes} + 7] = 0x80;  // the high byte of a pixel in the third row
    EXPECT_NE(decode(format, b.raw, 1, image).find("in " + std::to_string(format.bit_depth) + " bits"),
              std::string::npos);
    b.bytes[2 * size_t{b.raw.stride_bytes} + 7] = 0;
    b.bytes[b.raw.stride_bytes - 1] = 0xff;  // padding may hold anything
    EXPECT_EQ(decode(format, b.raw, 1, image), "");
  }
}

TEST(V4l2Formats, AnImageOfThatTypeKeepsItsMemory) {
  for (const char* name : {"GREY", "Y12", "YUYV", "UYVY", "NV12", "GBRG8", "MJPEG"}) {
    const PixelFormat& format = format_of(name);
    Buffer b;
    if (format.layout == PixelLayout::Jpeg) {
      b.bytes = jpeg_of(smooth_picture(CV_8UC3));
      b.raw = {b.bytes, 64, 48, 0};
    } else {
      b = random_buffer(format, 64, 48, 0);
    }
    cv::Mat image(48, 64, format.bit_depth > 8 ? CV_16UC1 : CV_8UC1);
    const uint8_t* memory = image.data;
    ASSERT_EQ(decode(format, b.raw, 1, image), "");
    EXPECT_EQ(image.data, memory) << name;
  }
}

TEST(V4l2Formats, NamesAreFoundAsPeopleTypeThem) {
  EXPECT_EQ(find_pixel_format(std::string_view("y16"))->fourcc, uint32_t{V4L2_PIX_FMT_Y16});
  EXPECT_EQ(find_pixel_format(std::string_view("mjpg"))->fourcc, uint32_t{V4L2_PIX_FMT_MJPEG});
  EXPECT_EQ(find_pixel_format(std::string_view("MJPEG"))->fourcc, uint32_t{V4L2_PIX_FMT_MJPEG});
  EXPECT_EQ(find_pixel_format(std::string_view("RGGB"))->fourcc, uint32_t{V4L2_PIX_FMT_SRGGB8});
  EXPECT_EQ(find_pixel_format(std::string_view("BA81"))->fourcc, uint32_t{V4L2_PIX_FMT_SBGGR8});
  EXPECT_EQ(find_pixel_format(std::string_view("")), nullptr);
  EXPECT_EQ(find_pixel_format(std::string_view("RGB8Packed")), &format_of("RGB8"));
  EXPECT_EQ(find_pixel_format(uint32_t{V4L2_PIX_FMT_RGB565}), nullptr);
  EXPECT_EQ(find_pixel_format(uint32_t{0}), nullptr);
  EXPECT_EQ(fourcc_text(V4L2_PIX_FMT_Y10), "Y10");
  EXPECT_EQ(fourcc_text(V4L2_PIX_FMT_Y16_BE), "Y16-BE");
  for (const PixelFormat& format : pixel_formats()) {
    EXPECT_EQ(find_pixel_format(format.fourcc), format.fourcc != 0 ? &format : nullptr);
    EXPECT_EQ(find_pixel_format(std::string_view(format.name)), &format);
  }
}

}  // namespace
}  // namespace palpate
