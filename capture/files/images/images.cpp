#include "capture/files/images/images.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/files/images/image_file.h"
#include "capture/files/images/image_header.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

// The largest frame in 16-bit colour with alpha, and then some for the format.
constexpr uintmax_t kMaxFile_bytes = uintmax_t{kMaxSide_px} * kMaxSide_px * 8 + (1 << 20);

std::vector<uint8_t> read_bytes(const fs::path& file) {
  std::error_code error;
  const uintmax_t size = fs::file_size(file, error);
  if (error)
    throw Error(Failure::Input, "an image file", file.string() + ": " + error.message(), "checking the path");
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
    throw Error(Failure::Output, "to write an image file '" + ending + "'", "an encoder that refuses",
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

bool natural_less(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  size_t i = 0, k = 0;
  while (i < a.size() && k < b.size()) {
    if (digit(a[i]) && digit(b[k])) {
      while (i < a.size() && a[i] == '0') ++i;
      while (k < b.size() && b[k] == '0') ++k;
      size_t in = i, kn = k;
      while (in < a.size() && digit(a[in])) ++in;
      while (kn < b.size() && digit(b[kn])) ++kn;
      if (in - i != kn - k) return in - i < kn - k;
      const int order = a.compare(i, in - i, b, k, kn - k);
      if (order != 0) return order < 0;
      i = in;
      k = kn;
    } else {
      if (a[i] != b[k]) return a[i] < b[k];
      ++i;
      ++k;
    }
  }
  const size_t left = a.size() - i, right = b.size() - k;
  return left != right ? left < right : a < b;  // "01" and "1" differ in something
}

}  // namespace palpate
