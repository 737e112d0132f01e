// Pixel formats of cameras, and conversion of a driver's buffer to an image.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace cv {
class Mat;
}

namespace palpate {

/// Layout of a driver's buffer.
enum class PixelLayout {
  Gray8,   ///< a byte a pixel
  Gray16,  ///< two bytes a pixel, little endian, value in the low bits
  Yuyv,    ///< Y0 U Y1 V: two pixels share their colour
  Uyvy,    ///< U Y0 V Y1
  Nv12,    ///< a plane of Y, then colour at half the resolution, which is not used
  Bayer8,  ///< one colour a pixel
  Rgb8,    ///< red, green, blue: three bytes a pixel
  Bgr8,
  Gray12p,        ///< two pixels in three bytes, low bits first: value 0 to 7, 8 to 11 and 0 to 3, 4 to 11
  Gray12Packed,   ///< the same of older GigE cameras: bits 4 to 11, 0 to 3 of both, 4 to 11
  Bayer12p,       ///< as Gray12p, one colour a pixel; read with its upper 8 bits, as colour frames have
  Bayer12Packed,  ///< as Gray12Packed
  Jpeg,           ///< one JPEG file a frame
};

struct PixelFormat {
  uint32_t fourcc = 0;       ///< V4L2_PIX_FMT_...; 0: it has none
  const char* name = "";     ///< as the person types it
  const char* genicam = "";  ///< its name by GenICam's Pixel Format Naming Convention; empty: none
  PixelLayout layout = PixelLayout::Gray8;
  uint32_t bit_depth = 8;  ///< of a pixel's value as it is read
  uint32_t channels = 1;   ///< the most that it holds: 3 formats can serve gray sensors too
};

/// All that can be read.
std::span<const PixelFormat> pixel_formats();
/// Null where the format is not known. Names in any case; MJPEG may be called MJPG, and each its four
/// characters or its GenICam name (RGB8 its older one, RGB8Packed, too).
const PixelFormat* find_pixel_format(uint32_t fourcc);
const PixelFormat* find_pixel_format(std::string_view name);
/// The four characters, with V4L2's "-BE" for big endian.
std::string fourcc_text(uint32_t fourcc);

/// Buffer filled by a driver.
struct RawImage {
  std::span<const uint8_t> bytes;  ///< as many as the driver says it filled
  uint32_t width = 0;              ///< px, as negotiated
  uint32_t height = 0;
  uint32_t stride_bytes = 0;  ///< from row to row; not used for JPEG
};

/// Bytes of the shortest row.
size_t least_stride_bytes(const PixelFormat& format, uint32_t width);
/// Bytes that hold every pixel that is read; 0 for JPEG. The last row may lack its padding.
size_t needed_bytes(const PixelFormat& format, const RawImage& raw);

/// `raw` as an image of one type, so that frames stay alike: `channels` 1: gray, 8 bits or 16 (Gray16);
/// 3: blue, green, red, 8 bits. An `image` of that size and type keeps its memory; no byte past the needed
/// ones is read.
/// Returns nothing where all went well, else what is wrong with the buffer, in a few words: too few bytes, a
/// damaged JPEG or one of another size, a value above the format's bits (a camera that keeps its bits at the
/// high end: masking would hide it).
///
/// Gray: Y as it is, without stretching the range (16 to 235 in most cameras); Bayer: demosaiced (bilinear),
/// then 0.299 R + 0.587 G + 0.114 B; colour JPEG: the same sum. Colour of YUYV and UYVY: BT.601, Y from 16 to
/// 235; Bayer: bilinear.
std::string decode(const PixelFormat& format, const RawImage& raw, uint32_t channels, cv::Mat& image);

/// Largest value of a Gray16 image in place; the same check as `decode` makes.
uint32_t largest_value(const RawImage& raw);

}  // namespace palpate
