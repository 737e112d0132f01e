#include "capture/files/images/jpeg_writer.h"

#include <cstdio>  // jpeglib.h needs FILE
#include <cstdlib>

#include <jpeglib.h>

namespace palpate {

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
