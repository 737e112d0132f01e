// Frames as JPEG.
#pragma once

#include <cstdint>
#include <vector>

#include "palpate/frame.h"

namespace palpate {

/// The frame as a JPEG file of 8 bits, the upper ones of more. `quality`: 1 to 100.
std::vector<uint8_t> encode_jpeg(const Frame& frame, int quality);

}  // namespace palpate
