#include <png.h>
#include <zlib.h>

#include <bit>
#include <csetjmp>
#include <cstring>
#include <opencv2/core.hpp>

#include "capture/files/images/image_file.h"

namespace palpate {
namespace {

/// libpng leaves through a long jump: between setjmp and the jump no object with a destructor may be born.
struct Unread {
  const uint8_t* at;
  size_t left;
};

void take(png_structp png, png_bytep to, size_t count) {
  auto& from = *static_cast<Unread*>(png_get_io_ptr(png));
  if (count > from.left) png_error(png, "end");
  std::memcpy(to, from.at, count);
  from.at += count;
  from.left -= count;
}

void put(png_structp png, png_bytep from, size_t count) {
  auto& to = *static_cast<std::vector<uint8_t>*>(png_get_io_ptr(png));
  to.insert(to.end(), from, from + count);
}

void silent(png_structp, png_const_charp) {}

[[noreturn]] void give_up(png_structp png, png_const_charp) {
  png_longjmp(png, 1);
}

bool decode(png_structp png, png_infop info, cv::Mat& image, std::vector<png_bytep>& rows) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_read_info(png, info);
  const int kind = png_get_color_type(png, info), bits = png_get_bit_depth(png, info);
  // Before memory is taken: deflate makes at most 1032 bytes of one.
  constexpr uint64_t kMostPacked = 1032;
  if (uint64_t{png_get_rowbytes(png, info)} * png_get_image_height(png, info) / kMostPacked >
      static_cast<Unread*>(png_get_io_ptr(png))->left)
    return false;
  const bool transparent = png_get_valid(png, info, PNG_INFO_tRNS) != 0;
  const bool gray = kind == PNG_COLOR_TYPE_GRAY, palette = kind == PNG_COLOR_TYPE_PALETTE;
  const bool alpha = (kind & PNG_COLOR_MASK_ALPHA) != 0 || (palette && transparent);
  if (palette) png_set_palette_to_rgb(png);
  if (alpha && transparent) png_set_tRNS_to_alpha(png);
  if (!alpha) png_set_strip_alpha(png);
  if (gray && bits < 8) png_set_expand_gray_1_2_4_to_8(png);
  if (bits == 16 && std::endian::native == std::endian::little) png_set_swap(png);
  if (kind == PNG_COLOR_TYPE_GRAY_ALPHA) png_set_gray_to_rgb(png);
  png_set_bgr(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  image.create(static_cast<int>(png_get_image_height(png, info)),
               static_cast<int>(png_get_image_width(png, info)),
               CV_MAKETYPE(bits == 16 ? CV_16U : CV_8U, gray    ? 1
                                                        : alpha ? 4
                                                                : 3));
  if (png_get_rowbytes(png, info) != static_cast<size_t>(image.cols) * image.elemSize()) return false;
  rows.resize(static_cast<size_t>(image.rows));
  for (int y = 0; y < image.rows; ++y) rows[static_cast<size_t>(y)] = image.ptr(y);
  png_read_image(png, rows.data());
  png_read_end(png, nullptr);
  return true;
}

bool encode(png_structp png, png_infop info, const ImageView& image, PngPacking packing) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  if (packing == PngPacking::Runs) png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_compression_level(png, Z_BEST_SPEED);
  png_set_compression_strategy(png, packing == PngPacking::Runs ? Z_RLE : Z_DEFAULT_STRATEGY);
  png_set_IHDR(png, info, image.width, image.height, static_cast<int>(8 * image.bytes_per_value),
               image.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  if (image.blue_first) png_set_bgr(png);
  if (std::endian::native == std::endian::little) png_set_swap(png);
  for (uint32_t y = 0; y < image.height; ++y)
    png_write_row(png, static_cast<const uint8_t*>(image.pixels) + y * image.row_bytes);
  png_write_end(png, info);
  return true;
}

}  // namespace

cv::Mat decode_png(std::span<const uint8_t> bytes) {
  Unread unread{bytes.data(), bytes.size()};
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, give_up, silent);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  cv::Mat image;
  std::vector<png_bytep> rows;
  bool whole = false;
  if (info) {
    png_set_read_fn(png, &unread, take);
    whole = decode(png, info, image, rows);
  }
  png_destroy_read_struct(&png, &info, nullptr);
  return whole ? image : cv::Mat();
}

std::vector<uint8_t> encode_png(const ImageView& image, PngPacking packing) {
  std::vector<uint8_t> bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, give_up, silent);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  bool whole = false;
  if (info) {
    png_set_write_fn(png, &bytes, put, nullptr);
    whole = encode(png, info, image, packing);
  }
  png_destroy_write_struct(&png, &info);
  if (!whole) bytes.clear();
  return bytes;
}

}  // namespace palpate
