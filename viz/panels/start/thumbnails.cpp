#include "viz/panels/start/thumbnails.h"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cmath>
#include <opencv2/core.hpp>
#include <set>

#include "capture/files/images/images.h"
#include "capture/files/output_file.h"
#include "capture/synthetic/object.h"
#include "capture/synthetic/synthetic.h"
#include "capture/synthetic/tissue.h"
#include "engine/pipeline/surface/surface_sample.h"
#include "palpate/error.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

namespace fs = std::filesystem;

fs::path folder() {
  const fs::path settings = settings_file();
  return settings.empty() ? fs::path() : settings.parent_path() / "thumbnails";
}

}  // namespace

RgbImage scaled_down(const Frame& frame, uint32_t most_width, uint32_t most_height) {
  const FrameFormat& f = frame.format;
  const double scale =
      std::max({1.0, static_cast<double>(f.width) / most_width, static_cast<double>(f.height) / most_height});
  const auto width = std::clamp(static_cast<uint32_t>(f.width / scale), 1u, most_width);
  const auto height = std::clamp(static_cast<uint32_t>(f.height / scale), 1u, most_height);
  const uint32_t shift = f.bit_depth > 8 ? f.bit_depth - 8 : 0;
  RgbImage picture{width, height, {}};
  picture.rgb.reserve(size_t{3} * width * height);
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const uint32_t x0 = x * f.width / width, x1 = std::max(x0 + 1, (x + 1) * f.width / width);
      const uint32_t y0 = y * f.height / height, y1 = std::max(y0 + 1, (y + 1) * f.height / height);
      for (uint32_t c = 0; c < 3; ++c) {
        uint64_t sum = 0;
        for (uint32_t v = y0; v < y1; ++v)
          for (uint32_t u = x0; u < x1; ++u) sum += frame.at(f.channels == 3 ? c : 0, u, v);
        picture.rgb.push_back(static_cast<uint8_t>((sum / ((x1 - x0) * (y1 - y0))) >> shift));
      }
    }
  return picture;
}

namespace {

/// In the middle of a dark picture.
RgbImage framed(const RgbImage& inner) {
  RgbImage picture{kThumbnailWidth, kThumbnailHeight, {}};
  picture.rgb.assign(size_t{3} * kThumbnailWidth * kThumbnailHeight, 24);
  const uint32_t left = (kThumbnailWidth - inner.width) / 2, top = (kThumbnailHeight - inner.height) / 2;
  for (uint32_t y = 0; y < inner.height; ++y)
    std::copy_n(inner.at(0, y), 3 * inner.width,
                picture.rgb.data() + 3 * (size_t{y + top} * kThumbnailWidth + left));
  return picture;
}

}  // namespace

RgbImage thumbnail_of(const Frame& frame) {
  return framed(scaled_down(frame, kThumbnailWidth, kThumbnailHeight));
}

RgbImage depth_thumbnail(gpu::Context& context, const SurfaceMap& map, double offset_mm, ColourMap colours,
                         double range_mm) {
  const double scale = std::min({1.0, static_cast<double>(kThumbnailWidth) / map.width,
                                 static_cast<double>(kThumbnailHeight) / map.height});
  RgbImage picture{std::max(1u, static_cast<uint32_t>(map.width * scale)),
                   std::max(1u, static_cast<uint32_t>(map.height * scale)),
                   {}};
  std::vector<std::array<double, 2>> places;
  for (uint32_t y = 0; y < picture.height; ++y)
    for (uint32_t x = 0; x < picture.width; ++x)
      places.push_back(
          {(x + 0.5) * map.width / picture.width - 0.5, (y + 0.5) * map.height / picture.height - 0.5});
  for (const double depth_mm : sample_depths(context, map, offset_mm, places))
    for (const double part : colour_of(colours, std::clamp(depth_mm / range_mm, 0.0, 1.0)))
      picture.rgb.push_back(static_cast<uint8_t>(std::lround(255 * part)));
  return framed(picture);
}

std::optional<RgbImage> simulated_thumbnail(const std::string& input) {
  if (is_tissue(input)) return std::nullopt;
  Frame frame;
  if (is_object(input)) {
    ObjectOptions options = parse_object(input);
    options.camera.width = 2 * kThumbnailWidth;
    options.camera.height = 2 * kThumbnailHeight;
    ObjectSensor object(options);
    // Pressed, and a quarter of its path gone.
    object.seek(static_cast<uint64_t>((1 + options.seconds / 4) * options.camera.rate_Hz));
    if (!object.next(frame)) return std::nullopt;
    return thumbnail_of(frame);
  }
  SyntheticOptions options = parse_synthetic(input);
  options.width = 2 * kThumbnailWidth;  // patterns of the skin want so many
  options.height = 2 * kThumbnailHeight;
  options.repeat = 1;
  const SyntheticSensor sensor(options);
  constexpr uint64_t kLooks = 24;
  const uint64_t frames = sensor.frame_count().value_or(1);
  uint64_t best = 0;
  double largest_N = -1;
  for (uint64_t look = 0; look < kLooks; ++look) {
    const uint64_t at = look * frames / kLooks;
    const auto truth = sensor.truth(at);
    if (truth && truth->force_N > largest_N) {
      best = at;
      largest_N = truth->force_N;
    }
  }
  if (!sensor.render(best, frame)) return std::nullopt;
  return thumbnail_of(frame);
}

uint64_t hash_of(std::string_view words) {
  uint64_t hash = 14695981039346656037u;  // FNV-1a
  for (const char c : words) hash = (hash ^ static_cast<uint8_t>(c)) * 1099511628211u;
  return hash;
}

fs::path thumbnail_file(const std::string& input) {
  if (folder().empty()) return {};
  return folder() / text("%016" PRIx64 ".png", hash_of(absolute_input(input)));
}

void keep_thumbnail(const std::string& input, const RgbImage& picture, const Settings& settings) {
  const fs::path file = thumbnail_file(input);
  if (file.empty()) return;
  Frame frame;
  frame.reshape({picture.width, picture.height, 3, 8});
  for (uint32_t y = 0; y < picture.height; ++y)
    for (uint32_t x = 0; x < picture.width; ++x)
      for (uint32_t c = 0; c < 3; ++c) frame.set(c, x, y, picture.at(x, y)[c]);
  try {
    make_output_folder(file.parent_path());
    write_whole(file, encode_image(frame, ".png"));
  } catch (const Error&) {
    return;  // a picture in a list is not worth a message
  }
  std::set<std::string> kept{file.stem()};
  for (const Settings::Recent& recent : settings.recent) kept.insert(thumbnail_file(recent.input).stem());
  std::error_code code;
  std::vector<fs::path> old;
  for (const auto& entry : fs::directory_iterator(file.parent_path(), code))
    if (const std::string stem = entry.path().stem();  // a strip of thumbnails has the source's name and more
        entry.path().extension() == ".png" && !kept.contains(stem.substr(0, stem.find('-'))))
      old.push_back(entry.path());
  for (const fs::path& path : old) fs::remove(path, code);
}

std::optional<RgbImage> load_thumbnail(const std::string& input) {
  const fs::path file = thumbnail_file(input);
  std::error_code code;
  if (file.empty() || !fs::exists(file, code)) return std::nullopt;
  try {
    const cv::Mat image = read_image(file);
    if (image.type() != CV_8UC3 || image.cols != kThumbnailWidth || image.rows != kThumbnailHeight)
      return std::nullopt;
    RgbImage picture{kThumbnailWidth, kThumbnailHeight, {}};
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x) {
        const auto& bgr = image.at<cv::Vec3b>(y, x);
        picture.rgb.insert(picture.rgb.end(), {bgr[2], bgr[1], bgr[0]});
      }
    return picture;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

}  // namespace palpate::viz
