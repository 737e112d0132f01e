#include "capture/files/images/image_file.h"

#include <opencv2/core.hpp>

#include "capture/files/images/image_header.h"
#include "capture/files/images/jpeg.h"

namespace palpate {

cv::Mat decode_image(std::span<const uint8_t> bytes, const ImageHeader& header) {
  if (header.kind == "JPEG") return decode_jpeg(bytes);
  if (header.kind == "PNG") return decode_png(bytes);
  if (header.kind == "TIFF") return decode_tiff(bytes);
  if (header.kind == "BMP") return decode_bmp(bytes);
  return decode_pnm(bytes);
}

}  // namespace palpate
