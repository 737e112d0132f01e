#include "capture/camera/formats.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/files/images/jpeg.h"

namespace palpate {
namespace {

constexpr std::array kFormats = {
    PixelFormat{V4L2_PIX_FMT_GREY, "GREY", "Mono8", PixelLayout::Gray8, 8, 1},
    PixelFormat{V4L2_PIX_FMT_Y10, "Y10", "Mono10", PixelLayout::Gray16, 10, 1},
    PixelFormat{V4L2_PIX_FMT_Y12, "Y12", "Mono12", PixelLayout::Gray16, 12, 1},
    PixelFormat{V4L2_PIX_FMT_Y16, "Y16", "Mono16", PixelLayout::Gray16, 16, 1},
    PixelFormat{V4L2_PIX_FMT_YUYV, "YUYV", "YUV422_8", PixelLayout::Yuyv, 8, 3},
    PixelFormat{V4L2_PIX_FMT_UYVY, "UYVY", "YUV422_8_UYVY", PixelLayout::Uyvy, 8, 3},
    PixelFormat{V4L2_PIX_FMT_NV12, "NV12", "", PixelLayout::Nv12, 8, 1},
    PixelFormat{V4L2_PIX_FMT_SRGGB8, "RGGB8", "BayerRG8", PixelLayout::Bayer8, 8, 3},
    PixelFormat{V4L2_PIX_FMT_SGRBG8, "GRBG8", "BayerGR8", PixelLayout::Bayer8, 8, 3},
    PixelFormat{V4L2_PIX_FMT_SGBRG8, "GBRG8", "BayerGB8", PixelLayout::Bayer8, 8, 3},
    PixelFormat{V4L2_PIX_FMT_SBGGR8, "BGGR8", "BayerBG8", PixelLayout::Bayer8, 8, 3},
    PixelFormat{V4L2_PIX_FMT_RGB24, "RGB8", "RGB8", PixelLayout::Rgb8, 8, 3},
    PixelFormat{V4L2_PIX_FMT_BGR24, "BGR8", "BGR8", PixelLayout::Bgr8, 8, 3},
    PixelFormat{0, "MONO12P", "Mono12p", PixelLayout::Gray12p, 12, 1},
    PixelFormat{0, "MONO12PACKED", "Mono12Packed", PixelLayout::Gray12Packed, 12, 1},
    PixelFormat{0, "RGGB12P", "BayerRG12p", PixelLayout::Bayer12p, 8, 3},
    PixelFormat{0, "GRBG12P", "BayerGR12p", PixelLayout::Bayer12p, 8, 3},
    PixelFormat{0, "GBRG12P", "BayerGB12p", PixelLayout::Bayer12p, 8, 3},
    PixelFormat{0, "BGGR12P", "BayerBG12p", PixelLayout::Bayer12p, 8, 3},
    PixelFormat{0, "RGGB12PACKED", "BayerRG12Packed", PixelLayout::Bayer12Packed, 8, 3},
    PixelFormat{0, "GRBG12PACKED", "BayerGR12Packed", PixelLayout::Bayer12Packed, 8, 3},
    PixelFormat{0, "GBRG12PACKED", "BayerGB12Packed", PixelLayout::Bayer12Packed, 8, 3},
    PixelFormat{0, "BGGR12PACKED", "BayerBG12Packed", PixelLayout::Bayer12Packed, 8, 3},
    PixelFormat{V4L2_PIX_FMT_MJPEG, "MJPEG", "", PixelLayout::Jpeg, 8, 3},
    PixelFormat{V4L2_PIX_FMT_JPEG, "JPEG", "", PixelLayout::Jpeg, 8, 3},
};

std::string upper(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return out;
}

/// OpenCV names a mosaic by the second row's second and third pixel; ours begin with the first row's.
int demosaicing(std::string_view name, bool gray) {
  if (name.starts_with("RGGB")) return gray ? cv::COLOR_BayerBG2GRAY : cv::COLOR_BayerBG2BGR;
  if (name.starts_with("GRBG")) return gray ? cv::COLOR_BayerGB2GRAY : cv::COLOR_BayerGB2BGR;
  if (name.starts_with("GBRG")) return gray ? cv::COLOR_BayerGR2GRAY : cv::COLOR_BayerGR2BGR;
  return gray ? cv::COLOR_BayerRG2GRAY : cv::COLOR_BayerRG2BGR;
}

/// Two pixels in three bytes. An odd row ends within its last byte but one.
template <class Store>
void unpack_12(const RawImage& raw, bool low_bits_first, const Store& store) {
  for (uint32_t y = 0; y < raw.height; ++y) {
    const uint8_t* b = raw.bytes.data() + size_t{raw.stride_bytes} * y;
    for (uint32_t x = 0; x < raw.width; ++x) {
      const bool second = x % 2 == 1;
      const uint32_t shared = second ? b[1] >> 4 : b[1] & 15u, own = b[second ? 2 : 0];
      store(y, x, low_bits_first && !second ? own | shared << 8 : own << 4 | shared);
      if (second) b += 3;
    }
  }
}

/// The buffer's rows without a copy. OpenCV does not write through a source.
cv::Mat view(const RawImage& raw, uint32_t width, int type) {
  return {static_cast<int>(raw.height), static_cast<int>(width), type, const_cast<uint8_t*>(raw.bytes.data()),
          raw.stride_bytes};
}

std::string size_text(int64_t width, int64_t height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

std::string decode_motion_jpeg(const RawImage& raw, uint32_t channels, cv::Mat& image) {
  const cv::Mat decoded = decode_jpeg(raw.bytes);
  if (decoded.empty()) return "a damaged JPEG";
  if (decoded.cols != static_cast<int>(raw.width) || decoded.rows != static_cast<int>(raw.height))
    return "a JPEG of " + size_text(decoded.cols, decoded.rows) + " px";
  if (decoded.channels() == static_cast<int>(channels)) {
    decoded.copyTo(image);
  } else if (channels == 1) {
    cv::cvtColor(decoded, image, cv::COLOR_BGR2GRAY);
  } else {
    return "a gray JPEG";
  }
  return {};
}

}  // namespace

std::span<const PixelFormat> pixel_formats() {
  return kFormats;
}

const PixelFormat* find_pixel_format(uint32_t fourcc) {
  if (fourcc == 0) return nullptr;
  const auto found = std::find_if(kFormats.begin(), kFormats.end(),
                                  [&](const PixelFormat& format) { return format.fourcc == fourcc; });
  return found == kFormats.end() ? nullptr : &*found;
}

const PixelFormat* find_pixel_format(std::string_view name) {
  const std::string wanted = upper(name) == "RGB8PACKED" ? "RGB8" : upper(name);
  if (wanted.empty()) return nullptr;
  const auto found = std::find_if(kFormats.begin(), kFormats.end(), [&](const PixelFormat& format) {
    return wanted == format.name || (format.fourcc != 0 && wanted == fourcc_text(format.fourcc)) ||
           (*format.genicam && wanted == upper(format.genicam));
  });
  return found == kFormats.end() ? nullptr : &*found;
}

std::string fourcc_text(uint32_t fourcc) {
  std::string text;
  for (int i = 0; i < 4; ++i) {
    const auto c = static_cast<unsigned char>(fourcc >> 8 * i & 0x7f);
    text += std::isprint(c) ? static_cast<char>(c) : '?';
  }
  while (!text.empty() && text.back() == ' ') text.pop_back();
  if (fourcc >> 31) text += "-BE";
  return text;
}

size_t least_stride_bytes(const PixelFormat& format, uint32_t width) {
  switch (format.layout) {
    case PixelLayout::Gray16:
      return size_t{width} * 2;
    case PixelLayout::Yuyv:
    case PixelLayout::Uyvy:
      return (size_t{width} + 1) / 2 * 4;
    case PixelLayout::Rgb8:
    case PixelLayout::Bgr8:
      return size_t{width} * 3;
    case PixelLayout::Gray12p:
    case PixelLayout::Gray12Packed:
    case PixelLayout::Bayer12p:
    case PixelLayout::Bayer12Packed:
      return (size_t{width} * 3 + 1) / 2;
    case PixelLayout::Jpeg:
      return 0;
    default:
      return width;
  }
}

size_t needed_bytes(const PixelFormat& format, const RawImage& raw) {
  if (format.layout == PixelLayout::Jpeg || raw.height == 0) return 0;
  return size_t{raw.stride_bytes} * (raw.height - 1) + least_stride_bytes(format, raw.width);
}

uint32_t largest_value(const RawImage& raw) {
  uint32_t largest = 0;
  for (uint32_t y = 0; y < raw.height; ++y) {
    const uint8_t* row = raw.bytes.data() + size_t{raw.stride_bytes} * y;
    uint16_t in_row = 0;
    for (uint32_t x = 0; x < raw.width; ++x) {
      uint16_t value = 0;
      std::memcpy(&value, row + size_t{x} * 2, sizeof value);
      in_row = std::max(in_row, value);
    }
    largest = std::max<uint32_t>(largest, in_row);
  }
  return largest;
}

std::string decode(const PixelFormat& format, const RawImage& raw, uint32_t channels, cv::Mat& image) {
  if (channels != 1 && (channels != 3 || format.channels != 3)) return "gray pixels";
  if (format.layout == PixelLayout::Jpeg) return decode_motion_jpeg(raw, channels, image);
  if (raw.width == 0 || raw.height == 0 || raw.stride_bytes < least_stride_bytes(format, raw.width))
    return "rows of " + std::to_string(raw.stride_bytes) + " bytes";
  if (const size_t needed = needed_bytes(format, raw); raw.bytes.size() < needed)
    return std::to_string(raw.bytes.size()) + " bytes in place of " + std::to_string(needed);
  const int width = static_cast<int>(raw.width), height = static_cast<int>(raw.height);
  switch (format.layout) {
    case PixelLayout::Gray8:
    case PixelLayout::Nv12:
      view(raw, raw.width, CV_8UC1).copyTo(image);
      break;
    case PixelLayout::Gray16: {
      const uint32_t largest = format.bit_depth < 16 ? largest_value(raw) : 0;
      if (largest >> format.bit_depth)
        return "a value of " + std::to_string(largest) + " in " + std::to_string(format.bit_depth) + " bits";
      image.create(height, width, CV_16UC1);
      for (int y = 0; y < height; ++y)  // by rows: padding may have an odd number of bytes
        std::memcpy(image.ptr(y), raw.bytes.data() + size_t{raw.stride_bytes} * static_cast<size_t>(y),
                    size_t{raw.width} * 2);
      break;
    }
    case PixelLayout::Yuyv:
    case PixelLayout::Uyvy: {
      const bool y_first = format.layout == PixelLayout::Yuyv;
      if (channels == 1) {
        image.create(height, width, CV_8UC1);
        cv::extractChannel(view(raw, raw.width, CV_8UC2), image, y_first ? 0 : 1);
        break;
      }
      const int code = y_first ? cv::COLOR_YUV2BGR_YUYV : cv::COLOR_YUV2BGR_UYVY;
      if (width % 2 == 0) {
        cv::cvtColor(view(raw, raw.width, CV_8UC2), image, code);
      } else {  // the last pixel's partner is padding
        cv::Mat wider;
        cv::cvtColor(view(raw, raw.width + 1, CV_8UC2), wider, code);
        wider.colRange(0, width).copyTo(image);
      }
      break;
    }
    case PixelLayout::Rgb8:
      cv::cvtColor(view(raw, raw.width, CV_8UC3), image,
                   channels == 1 ? cv::COLOR_RGB2GRAY : cv::COLOR_RGB2BGR);
      break;
    case PixelLayout::Bgr8:
      if (channels == 1)
        cv::cvtColor(view(raw, raw.width, CV_8UC3), image, cv::COLOR_BGR2GRAY);
      else
        view(raw, raw.width, CV_8UC3).copyTo(image);
      break;
    case PixelLayout::Gray12p:
    case PixelLayout::Gray12Packed:
      image.create(height, width, CV_16UC1);
      unpack_12(raw, format.layout == PixelLayout::Gray12p, [&](uint32_t y, uint32_t x, uint32_t value) {
        image.at<uint16_t>(static_cast<int>(y), static_cast<int>(x)) = static_cast<uint16_t>(value);
      });
      break;
    case PixelLayout::Bayer8:
    case PixelLayout::Bayer12p:
    case PixelLayout::Bayer12Packed: {
      if (width < 3 || height < 3) return "a mosaic of " + size_text(width, height) + " px";
      cv::Mat mosaic;
      if (format.layout == PixelLayout::Bayer8) {
        mosaic = view(raw, raw.width, CV_8UC1);
      } else {
        mosaic.create(height, width, CV_8UC1);
        unpack_12(raw, format.layout == PixelLayout::Bayer12p, [&](uint32_t y, uint32_t x, uint32_t value) {
          mosaic.at<uint8_t>(static_cast<int>(y), static_cast<int>(x)) = static_cast<uint8_t>(value >> 4);
        });
      }
      cv::cvtColor(mosaic, image, demosaicing(format.name, channels == 1));
      break;
    }
    case PixelLayout::Jpeg:
      break;
  }
  return {};
}

}  // namespace palpate
