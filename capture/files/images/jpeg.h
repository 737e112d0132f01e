// JPEG files, decoded strictly: damage is an error, where OpenCV would fill with gray and continue.
#pragma once

#include <cstdint>
#include <span>

namespace cv {
class Mat;
}

namespace palpate {

/// Gray (1 channel) or colour (blue, green, red), 8 bit. Empty where the decoder had to guess anything, or
/// the colours are neither gray nor YCbCr nor RGB.
cv::Mat decode_jpeg(std::span<const uint8_t> bytes);

/// Whether the decoder would have to guess nothing; much faster than decoding.
bool jpeg_is_whole(std::span<const uint8_t> bytes);

}  // namespace palpate
