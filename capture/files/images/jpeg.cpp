#include "capture/files/images/jpeg.h"

#include <csetjmp>
#include <cstdio>  // jpeglib.h needs FILE
#include <cstdlib>
#include <opencv2/core.hpp>

#include <jpeglib.h>

#include "capture/files/images/images.h"

namespace palpate {
namespace {

/// libjpeg leaves through a long jump: between setjmp and the jump no object with a destructor may be born.
struct Decoder {
  jpeg_decompress_struct jpeg;
  jpeg_error_mgr errors;
  std::jmp_buf give_up;
};

[[noreturn]] void fail(j_common_ptr common) {
  std::longjmp(static_cast<Decoder*>(common->client_data)->give_up, 1);
}

void warn(j_common_ptr common, int level) {
  if (level < 0) fail(common);  // a warning is damaged data; the rest are traces
}

/// Errors and warnings of damage leave to where `give_up` was set.
void jump_on_errors(Decoder& d) {
  d.jpeg.err = jpeg_std_error(&d.errors);
  d.errors.error_exit = fail;
  d.errors.emit_message = warn;
  d.jpeg.client_data = &d;
}

void read_header(Decoder& d, std::span<const uint8_t> bytes) {
  jpeg_create_decompress(&d.jpeg);
  jpeg_mem_src(&d.jpeg, bytes.data(), bytes.size());
  jpeg_read_header(&d.jpeg, TRUE);
}

/// Reads the compressed data to its end, and makes an eighth of the picture's sides of it.
bool read_through(Decoder& d, std::span<const uint8_t> bytes, cv::Mat& row) {
  jump_on_errors(d);
  if (setjmp(d.give_up) != 0) return false;
  read_header(d, bytes);
  d.jpeg.out_color_space = d.jpeg.jpeg_color_space;
  d.jpeg.scale_num = 1;
  d.jpeg.scale_denom = 8;
  jpeg_start_decompress(&d.jpeg);
  row.create(1, static_cast<int>(d.jpeg.output_width), CV_8UC(d.jpeg.output_components));
  while (d.jpeg.output_scanline < d.jpeg.output_height) {
    JSAMPROW to = row.ptr();
    jpeg_read_scanlines(&d.jpeg, &to, 1);
  }
  jpeg_finish_decompress(&d.jpeg);
  return true;
}

bool decode(Decoder& d, std::span<const uint8_t> bytes, cv::Mat& image) {
  jump_on_errors(d);
  if (setjmp(d.give_up) != 0) return false;
  read_header(d, bytes);
  const bool gray = d.jpeg.jpeg_color_space == JCS_GRAYSCALE;
  if (!gray && d.jpeg.jpeg_color_space != JCS_YCbCr && d.jpeg.jpeg_color_space != JCS_RGB) return false;
  // Before memory is taken: a block of 8 x 8 px has one bit at least, but for arithmetic coding.
  constexpr uint64_t kMostPixels = 512;
  if (!d.jpeg.arith_code && uint64_t{d.jpeg.image_width} * d.jpeg.image_height / kMostPixels > bytes.size())
    return false;
  d.jpeg.out_color_space = gray ? JCS_GRAYSCALE : JCS_EXT_BGR;
  jpeg_start_decompress(&d.jpeg);
  image.create(static_cast<int>(d.jpeg.output_height), static_cast<int>(d.jpeg.output_width),
               gray ? CV_8UC1 : CV_8UC3);
  while (d.jpeg.output_scanline < d.jpeg.output_height) {
    JSAMPROW row = image.ptr(static_cast<int>(d.jpeg.output_scanline));
    jpeg_read_scanlines(&d.jpeg, &row, 1);
  }
  jpeg_finish_decompress(&d.jpeg);
  return true;
}

}  // namespace

cv::Mat decode_jpeg(std::span<const uint8_t> bytes) {
  Decoder d{};
  cv::Mat image;
  const bool whole = decode(d, bytes, image);
  jpeg_destroy_decompress(&d.jpeg);
  return whole ? image : cv::Mat();
}

bool jpeg_is_whole(std::span<const uint8_t> bytes) {
  Decoder d{};
  cv::Mat row;
  const bool whole = read_through(d, bytes, row);
  jpeg_destroy_decompress(&d.jpeg);
  return whole;
}

std::vector<uint8_t> encode_jpeg(const Frame& frame, int quality) {
  const FrameFormat& f = frame.format;
  const bool colour = f.channels == 3;
  const uint32_t shift = f.bit_depth - 8;
  std::vector<uint8_t> row(size_t{f.width} * f.channels);
  // Memory of the library's own: it grows as it needs to.
  struct Memory {
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    ~Memory() { std::free(bytes); }
  } memory;
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);  // fails for lack of memory alone
  jpeg_create_compress(&jpeg);
  jpeg_mem_dest(&jpeg, &memory.bytes, &memory.size);
  jpeg.image_width = f.width;
  jpeg.image_height = f.height;
  jpeg.input_components = static_cast<int>(f.channels);
  jpeg.in_color_space = colour ? JCS_RGB : JCS_GRAYSCALE;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, quality, TRUE);
  jpeg.dct_method = JDCT_IFAST;
  jpeg_start_compress(&jpeg, TRUE);
  while (jpeg.next_scanline < jpeg.image_height) {
    for (uint32_t c = 0; c < f.channels; ++c) {
      const uint8_t* from = frame.row(c, jpeg.next_scanline);
      for (uint32_t x = 0; x < f.width; ++x) {
        const uint32_t value = shift == 0 ? from[x] : (from[2 * x] | uint32_t{from[2 * x + 1]} << 8) >> shift;
        row[size_t{x} * f.channels + c] = static_cast<uint8_t>(value);
      }
    }
    JSAMPROW line = row.data();
    jpeg_write_scanlines(&jpeg, &line, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  return {memory.bytes, memory.bytes + memory.size};
}

}  // namespace palpate
