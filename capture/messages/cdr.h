// Writer of CDR, as messages of ROS 2 lie in bags and on the wire: XCDR1, little endian, behind a header of
// four bytes from whose end places are aligned.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace palpate {

using MessageBytes = std::vector<uint8_t>;

class CdrWriter {
 public:
  /// Begins a message in `out`, whose memory is used again; it must outlive the writer.
  explicit CdrWriter(MessageBytes& out) : out_(out) { out_.assign({0, 1, 0, 0}); }

  template <typename T>
  requires(std::integral<T> || std::floating_point<T>) void add(T value) {
    static_assert(std::endian::native == std::endian::little);
    align(sizeof value);
    append(&value, sizeof value);
  }
  void add(std::string_view text) {
    add(length(text.size() + 1));
    append(text.data(), text.size());
    out_.push_back(0);
  }
  /// A sequence of bytes whose content is written by the caller, at once: `count` of them, not set.
  uint8_t* add_bytes(size_t count) {
    add(length(count));
    out_.resize(out_.size() + count);
    return out_.data() + out_.size() - count;
  }
  /// Length of a sequence, whose items follow.
  void add_length(size_t count) { add(length(count)); }

 private:
  static constexpr size_t kHeader = 4;

  static uint32_t length(size_t count) {
    if (count > std::numeric_limits<uint32_t>::max()) throw std::length_error("a message of more than 4 GiB");
    return static_cast<uint32_t>(count);
  }
  void align(size_t size) { out_.resize(kHeader + (out_.size() - kHeader + size - 1) / size * size); }
  void append(const void* data, size_t count) {
    const size_t at = out_.size();
    out_.resize(at + count);
    if (count > 0) std::memcpy(out_.data() + at, data, count);
  }

  MessageBytes& out_;
};

}  // namespace palpate
