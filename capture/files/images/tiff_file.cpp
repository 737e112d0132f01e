#include <algorithm>
#include <opencv2/core.hpp>

#include "capture/files/images/image_file.h"
#include "capture/files/images/tiff_memory.h"

namespace palpate {
namespace {

struct Layout {
  uint32_t width = 0, height = 0;
  uint16_t bits = 1, samples = 1, format = SAMPLEFORMAT_UINT, photometric = PHOTOMETRIC_MINISBLACK;
  uint16_t planar = PLANARCONFIG_CONTIG, orientation = ORIENTATION_TOPLEFT;

  bool gray() const { return photometric == PHOTOMETRIC_MINISBLACK || photometric == PHOTOMETRIC_MINISWHITE; }
};

Layout layout_of(TIFF* tiff) {
  Layout l;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &l.width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &l.height);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &l.bits);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &l.samples);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &l.format);
  TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &l.photometric);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &l.planar);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_ORIENTATION, &l.orientation);
  return l;
}

/// Whether `count` bytes can be all that so many bytes of a file hold: asked before memory is taken for them.
bool can_hold(TIFF* tiff, size_t file_bytes, uint64_t count) {
  uint16_t packing = COMPRESSION_NONE;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &packing);
  // Bytes that one byte of the file can make: codes of nine bits and more for up to 4096 bytes, a bit for a
  // row of fax.
  constexpr uint64_t kLzw = 4096, kOther = 65536;
  const uint64_t most = packing == COMPRESSION_NONE ? 1 : packing == COMPRESSION_LZW ? kLzw : kOther;
  return count / most <= file_bytes;
}

/// Up to 8 bits: libtiff knows palettes, bits and colour spaces.
cv::Mat decode_small(TIFF* tiff, const Layout& l) {
  std::vector<uint32_t> pixels(size_t{l.width} * l.height);
  if (!TIFFReadRGBAImageOriented(tiff, l.width, l.height, pixels.data(), ORIENTATION_TOPLEFT, 1)) return {};
  const int channels = l.gray() ? 1 : l.samples >= 4 ? 4 : 3;
  cv::Mat image(static_cast<int>(l.height), static_cast<int>(l.width), CV_8UC(channels));
  const uint32_t* from = pixels.data();
  for (int y = 0; y < image.rows; ++y) {
    uint8_t* to = image.ptr(y);
    for (int x = 0; x < image.cols; ++x, ++from, to += channels) {
      to[0] = static_cast<uint8_t>(TIFFGetB(*from));
      if (channels == 1) continue;
      to[1] = static_cast<uint8_t>(TIFFGetG(*from));
      to[2] = static_cast<uint8_t>(TIFFGetR(*from));
      if (channels == 4) to[3] = static_cast<uint8_t>(TIFFGetA(*from));
    }
  }
  return image;
}

int depth_of(const Layout& l) {
  if (l.format == SAMPLEFORMAT_IEEEFP) return l.bits == 32 ? CV_32F : l.bits == 64 ? CV_64F : -1;
  if (l.format == SAMPLEFORMAT_INT) return l.bits == 16 ? CV_16S : l.bits == 32 ? CV_32S : -1;
  return l.bits == 16 ? CV_16U : -1;
}

/// Strips or tiles as they are stored, values as they are.
bool read_blocks(TIFF* tiff, size_t file_bytes, cv::Mat& image) {
  const bool tiled = TIFFIsTiled(tiff) != 0;
  uint32_t block_width = static_cast<uint32_t>(image.cols), block_height = static_cast<uint32_t>(image.rows);
  if (tiled) {
    TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &block_width);
    TIFFGetField(tiff, TIFFTAG_TILELENGTH, &block_height);
  } else {
    TIFFGetFieldDefaulted(tiff, TIFFTAG_ROWSPERSTRIP, &block_height);
    block_height = std::min(block_height, static_cast<uint32_t>(image.rows));
  }
  constexpr uint32_t kMostSide_px = 1 << 15;
  if (block_width == 0 || block_height == 0 || block_width > kMostSide_px || block_height > kMostSide_px)
    return false;
  const size_t row_bytes = size_t{block_width} * image.elemSize();
  if (static_cast<size_t>(tiled ? TIFFTileSize(tiff) : TIFFStripSize(tiff)) != row_bytes * block_height)
    return false;
  if (!can_hold(tiff, file_bytes, uint64_t{row_bytes} * block_height)) return false;
  std::vector<uint8_t> block(row_bytes * block_height);
  const uint32_t width = static_cast<uint32_t>(image.cols), height = static_cast<uint32_t>(image.rows);
  for (uint32_t y = 0; y < height; y += block_height)
    for (uint32_t x = 0; x < width; x += block_width) {
      const uint32_t rows = std::min(block_height, height - y), columns = std::min(block_width, width - x);
      const size_t wanted = row_bytes * (tiled ? block_height : rows);
      const tmsize_t got = tiled ? TIFFReadEncodedTile(tiff, TIFFComputeTile(tiff, x, y, 0, 0), block.data(),
                                                       static_cast<tmsize_t>(wanted))
                                 : TIFFReadEncodedStrip(tiff, TIFFComputeStrip(tiff, y, 0), block.data(),
                                                        static_cast<tmsize_t>(wanted));
      if (got != static_cast<tmsize_t>(wanted)) return false;
      for (uint32_t row = 0; row < rows; ++row)
        std::copy_n(block.data() + row * row_bytes, columns * image.elemSize(),
                    image.ptr(static_cast<int>(y + row)) + x * image.elemSize());
    }
  return true;
}

template <class Value>
void swap_red_and_blue(cv::Mat& image) {
  const int channels = image.channels();
  for (int y = 0; y < image.rows; ++y) {
    auto* row = image.ptr<Value>(y);
    for (int x = 0; x < image.cols; ++x) std::swap(row[x * channels], row[x * channels + 2]);
  }
}

cv::Mat decode_wide(TIFF* tiff, size_t file_bytes, const Layout& l) {
  const int depth = depth_of(l);
  const bool plain =
      l.gray() ? l.samples == 1 : l.photometric == PHOTOMETRIC_RGB && (l.samples == 3 || l.samples == 4);
  if (depth < 0 || !plain || (l.samples > 1 && l.planar != PLANARCONFIG_CONTIG)) return {};
  cv::Mat image(static_cast<int>(l.height), static_cast<int>(l.width), CV_MAKETYPE(depth, l.samples));
  if (!read_blocks(tiff, file_bytes, image)) return {};
  if (l.samples >= 3) {
    const size_t bytes = image.elemSize1();
    bytes == 2   ? swap_red_and_blue<uint16_t>(image)
    : bytes == 4 ? swap_red_and_blue<uint32_t>(image)
                 : swap_red_and_blue<uint64_t>(image);
  }
  const bool mirrored = l.orientation == ORIENTATION_TOPRIGHT || l.orientation == ORIENTATION_BOTRIGHT;
  const bool inverted = l.orientation == ORIENTATION_BOTLEFT || l.orientation == ORIENTATION_BOTRIGHT;
  if (mirrored || inverted) cv::flip(image, image, mirrored && inverted ? -1 : mirrored ? 1 : 0);
  return image;
}

}  // namespace

cv::Mat decode_tiff(std::span<const uint8_t> bytes) {
  TiffMemory memory;
  const TiffPtr tiff = memory.open(bytes);
  if (!tiff) return {};
  const Layout l = layout_of(tiff.get());
  if (l.width == 0 || l.height == 0 || l.orientation > ORIENTATION_BOTLEFT) return {};
  const uint64_t row_bits = uint64_t{l.width} * l.samples * l.bits;
  if (!can_hold(tiff.get(), bytes.size(), (row_bits + 7) / 8 * l.height)) return {};
  return l.bits <= 8 ? decode_small(tiff.get(), l) : decode_wide(tiff.get(), bytes.size(), l);
}

std::vector<uint8_t> encode_tiff(const ImageView& image) {
  TiffMemory memory;
  TiffPtr tiff = memory.create();
  const auto set = [&](ttag_t tag, auto value) { return TIFFSetField(tiff.get(), tag, value) == 1; };
  const size_t row_bytes = size_t{image.width} * image.channels * image.bytes_per_value;
  constexpr size_t kStrip_bytes = 8192;
  const auto rows =
      std::clamp(static_cast<uint32_t>(kStrip_bytes / std::max<size_t>(row_bytes, 1)), 1u, image.height);
  bool good = tiff && set(TIFFTAG_IMAGEWIDTH, image.width) && set(TIFFTAG_IMAGELENGTH, image.height) &&
              set(TIFFTAG_BITSPERSAMPLE, 8 * image.bytes_per_value) &&
              set(TIFFTAG_SAMPLESPERPIXEL, image.channels) && set(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT) &&
              set(TIFFTAG_PHOTOMETRIC, image.channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB) &&
              set(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) && set(TIFFTAG_COMPRESSION, COMPRESSION_LZW) &&
              set(TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL) && set(TIFFTAG_ROWSPERSTRIP, rows);
  std::vector<uint8_t> line(row_bytes);
  for (uint32_t y = 0; good && y < image.height; ++y) {
    std::copy_n(static_cast<const uint8_t*>(image.pixels) + y * image.row_bytes, row_bytes, line.data());
    if (image.channels == 3 && image.blue_first) {
      cv::Mat row(1, static_cast<int>(image.width), image.bytes_per_value == 1 ? CV_8UC3 : CV_16UC3,
                  line.data());
      image.bytes_per_value == 1 ? swap_red_and_blue<uint8_t>(row) : swap_red_and_blue<uint16_t>(row);
    }
    good = TIFFWriteScanline(tiff.get(), line.data(), y, 0) == 1;
  }
  good = good && TIFFFlush(tiff.get()) == 1;
  tiff.reset();
  return good ? memory.take() : std::vector<uint8_t>();
}

}  // namespace palpate
