#include "capture/files/images/images.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/files/images/image_file.h"
#include "capture/files/images/image_header.h"
#include "engine/base/readable.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

// The largest frame in 16-bit colour with alpha, and then some for the format.
constexpr uintmax_t kMaxFile_bytes = uintmax_t{kMaxSide_px} * kMaxSide_px * 8 + (1 << 20);

std::vector<uint8_t> read_bytes(const fs::path& file) {
  if (const std::string why = why_unreadable(file); !why.empty())
    throw Error(Failure::Input, "an image file", file.string() + ": " + why, "another file");
  std::error_code error;
  const uintmax_t size = fs::file_size(file, error);
  if (error)
    throw Error(Failure::Input, "an image file", file.string() + ": " + system_words(error),
                "checking the path");
  if (size > kMaxFile_bytes)
    throw Error(Failure::Input, "an image file of at most 2 GiB",
                file.string() + " of " + std::to_string(size) + " bytes", "another file");
  std::vector<uint8_t> bytes(size);
  std::ifstream in(file, std::ios::binary);
  if (!in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
    throw Error(Failure::Input, "a readable image file", file.string() + ", which cannot be read",
                "checking its permissions");
  return bytes;
}

}  // namespace

cv::Mat read_image(const fs::path& file) {
  const std::vector<uint8_t> bytes = read_bytes(file);
  const auto header = read_image_header(bytes);
  if (!header)
    throw Error(Failure::Input, std::string("an image (") + kImageKinds + ")",
                file.string() + ", which is none or is cut short", "another file");
  const std::string size = std::to_string(header->width) + "x" + std::to_string(header->height) + " px";
  if (header->width == 0 || header->height == 0 || header->width > kMaxSide_px ||
      header->height > kMaxSide_px)
    throw Error(Failure::Input, "an image with sides of 1 to " + std::to_string(kMaxSide_px) + " px",
                file.string() + " of " + size, "a smaller image");
  const auto damaged = [&] {
    return Error(Failure::Input, "a whole " + header->kind + " image",
                 file.string() + ", which is damaged or cut short", "copying it again");
  };
  if (!header->whole) throw damaged();
  cv::Mat image = decode_image(bytes, *header);
  if (image.empty()) throw damaged();
  if (image.channels() == 4) cv::cvtColor(image, image, cv::COLOR_BGRA2BGR);
  return image;
}

cv::Mat to_image(const Frame& frame) {
  const FrameFormat& f = frame.format;
  const int rows = static_cast<int>(f.height), columns = static_cast<int>(f.width);
  std::vector<cv::Mat> planes;
  for (uint32_t channel = f.channels; channel-- > 0;)
    planes.emplace_back(rows, columns, f.bytes_per_pixel() == 1 ? CV_8UC1 : CV_16UC1,
                        const_cast<uint8_t*>(frame.row(channel, 0)));
  if (planes.size() == 1) return planes.front();
  cv::Mat image;
  cv::merge(planes, image);
  return image;
}

std::vector<uint8_t> encode_image(const Frame& frame, const std::string& ending) {
  const cv::Mat image = to_image(frame);
  const ImageView view{image.data,
                       frame.format.width,
                       frame.format.height,
                       frame.format.channels,
                       static_cast<uint32_t>(frame.format.bytes_per_pixel()),
                       image.step[0]};
  std::vector<uint8_t> bytes;
  if (ending == ".png") bytes = encode_png(view);
  if (ending == ".tif") bytes = encode_tiff(view);
  if (bytes.empty())
    throw Error(Failure::Output, "to write an image file '" + ending + "'", "an error of the encoder",
                "another format");
  return bytes;
}

bool has_image_name(const fs::path& file) {
  std::string end = file.extension().string();
  std::transform(end.begin(), end.end(), end.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array kEnds = {".png", ".tif", ".tiff", ".pgm", ".ppm", ".pnm", ".jpg", ".jpeg", ".bmp"};
  return std::find(kEnds.begin(), kEnds.end(), end) != kEnds.end();
}

namespace {

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

size_t end_of_digits(const std::string& text, size_t from) {
  while (from < text.size() && is_digit(text[from])) ++from;
  return from;
}

/// The digits after the point that ends the number whose digits begin at `from`; empty where that is none.
std::string_view fraction(const std::string& name, size_t from) {
  const bool after_point = from >= 2 && name[from - 1] == '.' && is_digit(name[from - 2]);
  const size_t point = end_of_digits(name, from);
  if (after_point || point >= name.size() || name[point] != '.') return {};
  const size_t end = end_of_digits(name, point + 1);
  const bool goes_on = end + 1 < name.size() && name[end] == '.' && is_digit(name[end + 1]);
  if (end == point + 1 || goes_on) return {};
  return std::string_view(name).substr(point + 1, end - point - 1);
}

int sign(int order) {
  return order < 0 ? -1 : order > 0;
}

/// Order of the numbers that begin in a at i and in b at k, which move behind them.
int compare_numbers(const std::string& a, size_t& i, const std::string& b, size_t& k, bool decimals) {
  const std::string_view of_a = decimals ? fraction(a, i) : std::string_view(),
                         of_b = decimals ? fraction(b, k) : std::string_view();
  const size_t in = end_of_digits(a, i), kn = end_of_digits(b, k);
  while (i < in && a[i] == '0') ++i;
  while (k < kn && b[k] == '0') ++k;
  const size_t digits_a = in - i, digits_b = kn - k;
  const int whole =
      digits_a != digits_b ? (digits_a < digits_b ? -1 : 1) : sign(a.compare(i, digits_a, b, k, digits_b));
  i = in;
  k = kn;
  if (whole != 0 || (of_a.empty() && of_b.empty())) return whole;
  if (!of_a.empty()) i += 1 + of_a.size();
  if (!of_b.empty()) k += 1 + of_b.size();
  return sign(of_a.compare(of_b));  // digits after the point, from the left: 0.5 is before 0.75
}

}  // namespace

bool natural_less(const std::string& a, const std::string& b, bool decimals) {
  size_t i = 0, k = 0;
  while (i < a.size() && k < b.size()) {
    if (is_digit(a[i]) && is_digit(b[k])) {
      const int order = compare_numbers(a, i, b, k, decimals);
      if (order != 0) return order < 0;
    } else {
      if (a[i] != b[k]) return a[i] < b[k];
      ++i;
      ++k;
    }
  }
  const size_t left = a.size() - i, right = b.size() - k;
  return left != right ? left < right : a < b;  // "01" and "1" differ in something
}

void sort_naturally(std::vector<fs::path>& files) {
  size_t shortest = std::string::npos, longest_counted = 0;
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    for (size_t i = 0; i < name.size(); i = std::max(i + 1, end_of_digits(name, i))) {
      const std::string_view digits = is_digit(name[i]) ? fraction(name, i) : std::string_view();
      if (digits.empty()) continue;
      shortest = std::min(shortest, digits.size());
      if (digits.size() > 1 && digits.back() == '0')
        longest_counted = std::max(longest_counted, digits.size());
    }
  }
  const bool decimals = longest_counted <= shortest;
  std::sort(files.begin(), files.end(), [decimals](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string(), decimals);
  });
}

}  // namespace palpate
