#include "capture/files/images/jpeg.h"

#include <csetjmp>
#include <cstdio>  // jpeglib.h needs FILE
#include <opencv2/core.hpp>

#include <jpeglib.h>

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

}  // namespace palpate
