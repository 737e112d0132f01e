// Header of an image file, read before decoding, so that a false header cannot cause a large allocation.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace palpate {

struct ImageHeader {
  std::string kind;  ///< "PNG", "JPEG", "TIFF", "BMP" or "PNM"
  uint64_t width = 0;
  uint64_t height = 0;
  bool whole =
      true;  ///< false: the file ends before its format's end (PNG, JPEG; PNM and BMP of plain pixels)
};

/// nullopt when the bytes are none of the five formats, or end inside the header.
std::optional<ImageHeader> read_image_header(std::span<const uint8_t> bytes);

}  // namespace palpate
