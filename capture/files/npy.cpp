#include "capture/files/npy.h"

#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <system_error>

#include "capture/files/output_file.h"
#include "engine/base/readable.h"
#include "palpate/error.h"

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are copied as they lie in the file");

constexpr char kMagic[] = "\x93NUMPY";
constexpr size_t kMagicBytes = 6;
constexpr size_t kMaxHeaderBytes = 65536;
constexpr size_t kMaxDimensions = 32;  // NumPy's own limit

struct Header {
  std::string type;
  std::optional<bool> fortran_order;
  std::optional<std::vector<size_t>> shape;
};

/// Reads the Python dictionary of a header. Only what NumPy writes is understood: three keys, any order.
class HeaderParser {
 public:
  explicit HeaderParser(const std::string& text) : text_(text) {}

  /// False where the text is not such a dictionary.
  bool parse(Header& header) {
    if (!take('{')) return false;
    while (!take('}')) {
      std::string key;
      if (!quoted(key) || !take(':')) return false;
      if (key == "descr" && header.type.empty()) {
        if (!quoted(header.type)) header.type = rest_of_value();
      } else if (key == "fortran_order" && !header.fortran_order) {
        if (!boolean(header.fortran_order)) return false;
      } else if (key == "shape" && !header.shape) {
        if (!tuple(header.shape)) return false;
      } else {
        return false;
      }
      if (!take(',') && !peek('}')) return false;
    }
    skip();
    return at_ == text_.size() && !header.type.empty() && header.fortran_order && header.shape;
  }

 private:
  void skip() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
  }
  bool peek(char c) {
    skip();
    return at_ < text_.size() && text_[at_] == c;
  }
  bool take(char c) {
    if (!peek(c)) return false;
    ++at_;
    return true;
  }
  bool quoted(std::string& value) {
    if (!peek('\'') && !peek('"')) return false;
    const char quote = text_[at_];
    const size_t end = text_.find(quote, at_ + 1);
    if (end == std::string::npos) return false;
    value = text_.substr(at_ + 1, end - at_ - 1);
    at_ = end + 1;
    return true;
  }
  bool boolean(std::optional<bool>& value) {
    skip();
    for (const auto& [word, meaning] : {std::pair{"True", true}, std::pair{"False", false}}) {
      if (text_.compare(at_, std::strlen(word), word) == 0) {
        at_ += std::strlen(word);
        value = meaning;
        return true;
      }
    }
    return false;
  }
  bool tuple(std::optional<std::vector<size_t>>& value) {
    if (!take('(')) return false;
    std::vector<size_t> sizes;
    while (!take(')')) {
      skip();
      size_t size = 0;
      const size_t start = at_;
      while (at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9') {
        if (size > (std::numeric_limits<size_t>::max() - 9) / 10) return false;
        size = size * 10 + static_cast<size_t>(text_[at_++] - '0');
      }
      if (at_ == start || sizes.size() == kMaxDimensions) return false;
      sizes.push_back(size);
      if (!take(',') && !peek(')')) return false;
    }
    value = std::move(sizes);
    return true;
  }
  /// A type that is not a string (a record): kept as written, for the message.
  std::string rest_of_value() {
    skip();
    int depth = 0;
    const size_t start = at_;
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '[' || c == '(') ++depth;
      if (c == ']' || c == ')') --depth;
      if (depth <= 0 && (c == ',' || c == '}')) break;
    }
    return text_.substr(start, at_ - start);
  }

  const std::string& text_;
  size_t at_ = 0;
};

/// The contents of a damaged file may not be text.
std::string in_print(std::string text) {
  for (char& c : text)
    if (c < ' ' || c > '~') c = '?';
  return text.size() > 60 ? text.substr(0, 57) + "..." : text;
}

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& wanted,
                       const std::string& found) {
  throw Error(Failure::Input, wanted + " in '" + file.string() + "'", found,
              "numpy.save(file, numpy.ascontiguousarray(array, dtype='<f4'))");
}

/// The part after the magic: version, header length, header. Leaves `in` at the first value.
Header read_header(std::ifstream& in, const std::filesystem::path& file, uint64_t file_bytes) {
  char start[kMagicBytes + 2] = {};
  in.read(start, sizeof start);
  if (!in || std::memcmp(start, kMagic, kMagicBytes) != 0) {
    fail(file, "a NumPy array",
         file_bytes == 0 ? "an empty file" : "a file that does not start with NumPy's signature");
  }
  const int major = static_cast<unsigned char>(start[kMagicBytes]);
  if (major < 1 || major > 3)
    fail(file, "a NumPy array of version 1 to 3", "version " + std::to_string(major));
  unsigned char length[4] = {};
  const size_t length_bytes = major == 1 ? 2 : 4;
  in.read(reinterpret_cast<char*>(length), static_cast<std::streamsize>(length_bytes));
  uint32_t header_bytes = 0;
  std::memcpy(&header_bytes, length, sizeof header_bytes);
  if (!in) fail(file, "a NumPy array", "a file that ends inside its header");
  if (header_bytes > kMaxHeaderBytes) {
    fail(file, "a header of at most 65536 bytes", std::to_string(header_bytes) + " bytes claimed");
  }
  std::string text(header_bytes, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!in) fail(file, "a NumPy array", "a file that ends inside its header");
  Header header;
  if (!HeaderParser(text).parse(header)) {
    fail(file, "a header with 'descr', 'fortran_order' and 'shape'", "a header that NumPy does not write");
  }
  return header;
}

}  // namespace

std::string describe_shape(const std::vector<size_t>& shape) {
  if (shape.empty()) return "a single number";
  std::string text;
  for (const size_t size : shape) text += (text.empty() ? "" : " x ") + std::to_string(size);
  return shape.size() == 1 ? text + " (one dimension)" : text;
}

NpyArray read_npy(const std::filesystem::path& file) {
  std::error_code code;
  const auto status = std::filesystem::status(file, code);
  if (!std::filesystem::exists(status)) {
    throw Error(Failure::Input, "a NumPy array '" + file.string() + "'", "no such file", "checking the path");
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw Error(Failure::Input, "a NumPy array '" + file.string() + "'", "something that is not a file",
                "checking the path");
  }
  const uint64_t file_bytes = std::filesystem::file_size(file, code);
  std::ifstream in(file, std::ios::binary);
  if (const std::string why = why_unreadable(file); code || !in || !why.empty())
    throw Error(Failure::Input, "a NumPy array '" + file.string() + "'",
                why.empty() ? "a file that cannot be opened" : why, "another file");
  const Header header = read_header(in, file, file_bytes);
  if (header.type != "<f4" && header.type != "<f8") {
    fail(file, "little-endian float32 or float64 ('<f4' or '<f8')",
         "values of type " + in_print(header.type));
  }
  if (*header.fortran_order) fail(file, "C order (last index fastest)", "Fortran order");

  NpyArray array;
  array.shape = *header.shape;
  size_t count = 1;
  for (const size_t size : array.shape) {
    if (size != 0 && count > kMaxNpyElements / size) {
      fail(file, "at most " + std::to_string(kMaxNpyElements) + " values",
           "a shape of " + describe_shape(array.shape));
    }
    count *= size;
  }
  const size_t value_bytes = header.type == "<f4" ? 4 : 8;
  const uint64_t at = static_cast<uint64_t>(in.tellg());
  if (file_bytes - at != uint64_t{count} * value_bytes) {
    fail(file,
         std::to_string(count * value_bytes) + " bytes of values, as the shape " +
             describe_shape(array.shape) + " asks,",
         std::to_string(file_bytes - at) + " bytes");
  }
  array.values.resize(count);
  if (value_bytes == 4) {
    in.read(reinterpret_cast<char*>(array.values.data()), static_cast<std::streamsize>(count * 4));
  } else {
    std::vector<double> doubles(count);
    in.read(reinterpret_cast<char*>(doubles.data()), static_cast<std::streamsize>(count * 8));
    for (size_t i = 0; i < count; ++i) {
      array.values[i] = static_cast<float>(doubles[i]);
      if (std::isfinite(doubles[i]) && !std::isfinite(array.values[i])) {
        fail(file, "values that fit float32", std::to_string(doubles[i]) + " at index " + std::to_string(i));
      }
    }
  }
  if (!in) fail(file, "a whole array", "a file that cannot be read to its end");
  return array;
}

void write_npy(const std::filesystem::path& file, std::span<const float> values,
               const std::vector<size_t>& shape) {
  std::string text = "{'descr': '<f4', 'fortran_order': False, 'shape': (";
  for (const size_t size : shape) text += std::to_string(size) + ", ";
  if (shape.size() > 1) text.resize(text.size() - 2);
  text += "), }";
  // The values start at a multiple of 64 bytes, as NumPy aligns them.
  constexpr size_t kPrefixBytes = kMagicBytes + 4;
  text.resize((kPrefixBytes + text.size() + 1 + 63) / 64 * 64 - kPrefixBytes - 1, ' ');
  text += '\n';
  const auto length = static_cast<uint16_t>(text.size());
  OutputFile out(file);
  out.write(std::string_view(kMagic, kMagicBytes));
  out.write(std::string_view("\x01\x00", 2));
  out.write(&length, sizeof length);
  out.write(text);
  out.write(values.data(), values.size_bytes());
  out.commit();
}

}  // namespace palpate
