// Image files in memory: PNG, TIFF, JPEG, BMP and PNM decoded as they are, PNG and TIFF written.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace cv {
class Mat;
}

namespace palpate {

struct ImageHeader;

/// Pixels that somebody else keeps.
struct ImageView {
  const void* pixels = nullptr;
  uint32_t width = 0;            ///< px
  uint32_t height = 0;           ///< px
  uint32_t channels = 1;         ///< 1: gray; 3: interleaved colours
  uint32_t bytes_per_value = 1;  ///< 1 or 2
  size_t row_bytes = 0;
  bool blue_first = true;  ///< blue, green, red; otherwise red, green, blue
};

/// Compression of a PNG.
enum class PngPacking {
  Usual,  ///< every filter of libpng at level 1: a third of the time of its usual level, a few percent larger
  Runs,   ///< one filter and runs alone: faster still, for rendered pictures
};

/// Empty where the encoder refuses.
std::vector<uint8_t> encode_png(const ImageView& image, PngPacking packing = PngPacking::Usual);
/// LZW with horizontal prediction. Empty where the encoder refuses.
std::vector<uint8_t> encode_tiff(const ImageView& image);

/// The pixels of a file whose header was read: gray, or blue, green and red, with alpha as a fourth channel;
/// 8 or 16 bits, or what else the TIFF holds. Palettes become colours. Empty where the file is damaged or of
/// a kind that is not decoded.
cv::Mat decode_image(std::span<const uint8_t> bytes, const ImageHeader& header);

/// One decoder for each kind, as `decode_image`.
cv::Mat decode_png(std::span<const uint8_t> bytes);
cv::Mat decode_tiff(std::span<const uint8_t> bytes);
cv::Mat decode_bmp(std::span<const uint8_t> bytes);
cv::Mat decode_pnm(std::span<const uint8_t> bytes);

}  // namespace palpate
