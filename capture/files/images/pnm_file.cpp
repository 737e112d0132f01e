#include <algorithm>
#include <cctype>
#include <opencv2/core.hpp>
#include <optional>

#include "capture/files/images/image_file.h"

namespace palpate {
namespace {

/// Numbers in text, with comments between them.
class Text {
 public:
  explicit Text(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  std::optional<uint32_t> number() {
    skip();
    if (at_ >= bytes_.size() || !std::isdigit(bytes_[at_])) return std::nullopt;
    uint64_t value = 0;
    for (; at_ < bytes_.size() && std::isdigit(bytes_[at_]); ++at_)
      value = std::min<uint64_t>(value * 10 + (bytes_[at_] - '0'), UINT32_MAX);
    return static_cast<uint32_t>(value);
  }
  /// A digit by itself: bits need no space between them.
  std::optional<uint32_t> bit() {
    skip();
    if (at_ >= bytes_.size() || bytes_[at_] < '0' || bytes_[at_] > '1') return std::nullopt;
    return bytes_[at_++] - uint32_t{'0'};
  }
  /// Data after the one space that follows the last number.
  std::span<const uint8_t> rest() const { return bytes_.subspan(std::min(at_ + 1, bytes_.size())); }

 private:
  void skip() {
    while (at_ < bytes_.size() && (std::isspace(bytes_[at_]) || bytes_[at_] == '#')) {
      if (bytes_[at_] == '#')
        while (at_ < bytes_.size() && bytes_[at_] != '\n') ++at_;
      else
        ++at_;
    }
  }

  std::span<const uint8_t> bytes_;
  size_t at_ = 2;
};

void set(cv::Mat& image, int y, size_t value_of_row, uint32_t value) {
  if (image.elemSize1() == 1)
    image.ptr<uint8_t>(y)[value_of_row] = static_cast<uint8_t>(value);
  else
    image.ptr<uint16_t>(y)[value_of_row] = static_cast<uint16_t>(value);
}

/// Black is 1.
bool decode_bits(Text& text, bool binary, cv::Mat& image) {
  const size_t row_bytes = (static_cast<size_t>(image.cols) + 7) / 8;
  const std::span<const uint8_t> packed = text.rest();
  if (binary && packed.size() / row_bytes < static_cast<size_t>(image.rows)) return false;
  for (int y = 0; y < image.rows; ++y)
    for (size_t x = 0; x < static_cast<size_t>(image.cols); ++x) {
      const std::optional<uint32_t> bit =
          binary ? packed[static_cast<size_t>(y) * row_bytes + x / 8] >> (7 - x % 8) & 1u : text.bit();
      if (!bit) return false;
      set(image, y, x, *bit ? 0 : 255);
    }
  return true;
}

bool decode_values(Text& text, bool binary, uint32_t largest, cv::Mat& image) {
  const size_t channels = static_cast<size_t>(image.channels()), bytes = image.elemSize1();
  const size_t row_values = static_cast<size_t>(image.cols) * channels;
  const std::span<const uint8_t> stored = text.rest();
  if (binary && stored.size() / (row_values * bytes) < static_cast<size_t>(image.rows)) return false;
  const uint8_t* from = stored.data();
  for (int y = 0; y < image.rows; ++y)
    for (size_t i = 0; i < row_values; ++i) {
      std::optional<uint32_t> value;
      if (!binary) {
        value = text.number();
        if (!value) return false;
        value = std::min(*value, largest);
      } else {
        value = bytes == 1 ? from[0] : uint32_t{from[0]} << 8 | from[1];
        from += bytes;
      }
      set(image, y, channels == 3 ? i - i % 3 + (2 - i % 3) : i, *value);
    }
  return true;
}

}  // namespace

cv::Mat decode_pnm(std::span<const uint8_t> bytes) {
  if (bytes.size() < 3) return {};
  const int kind = bytes[1] - '0';
  const bool bits = kind == 1 || kind == 4, binary = kind >= 4;
  Text text(bytes);
  const auto width = text.number(), height = text.number();
  const auto largest = bits ? std::optional<uint32_t>(1) : text.number();
  if (!width || !height || !largest || *largest == 0 || *largest > 65535) return {};
  // Before memory is taken: a number in text has a digit at least.
  if (!binary && uint64_t{*width} * *height > bytes.size()) return {};
  cv::Mat image(static_cast<int>(*height), static_cast<int>(*width),
                CV_MAKETYPE(*largest > 255 ? CV_16U : CV_8U, kind == 3 || kind == 6 ? 3 : 1));
  if (image.empty()) return {};
  const bool whole = bits ? decode_bits(text, binary, image) : decode_values(text, binary, *largest, image);
  return whole ? image : cv::Mat();
}

}  // namespace palpate
