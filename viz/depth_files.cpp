#include "viz/depth_files.h"

#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "capture/output_file.h"
#include "engine/error.h"
#include "shaders/shared/confidence.h"
#include "viz/npy.h"

namespace palpate {
namespace {

void write_counts(const std::filesystem::path& file, const cv::Mat& counts) {
  std::vector<uint8_t> bytes;
  // Level 1: a third of the time of the usual level for files a few percent larger.
  if (!cv::imencode(".png", counts, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1}))
    throw Error(Failure::Output, "to write '" + file.string() + "'", "a PNG encoder that refuses",
                "npy files");
  write_whole(file, bytes);
}

uint64_t write_png16(const std::filesystem::path& file, const DepthView& map) {
  cv::Mat counts(static_cast<int>(map.height), static_cast<int>(map.width), CV_16UC1);
  uint64_t clipped = 0;
  for (uint32_t y = 0; y < map.height; ++y) {
    auto* row = counts.ptr<uint16_t>(static_cast<int>(y));
    const float* depth = map.depth_mm.data() + size_t{y} * map.width;
    for (uint32_t x = 0; x < map.width; ++x) {
      const double count = std::round(depth[x] / kDepthStep_mm) + kDepthZeroCount;
      if (!(count >= 0 && count <= 65535)) ++clipped;
      row[x] = static_cast<uint16_t>(count > 65535 ? 65535 : count >= 0 ? count : 0);
    }
  }
  write_counts(file, counts);
  return clipped;
}

template <typename T>
void append(std::vector<uint8_t>& bytes, T value) {
  const size_t at = bytes.size();
  bytes.resize(at + sizeof value);
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

void write_ply(const std::filesystem::path& file, const DepthView& map) {
  const uint64_t vertices = uint64_t{map.width} * map.height;
  const uint64_t faces = map.width && map.height ? uint64_t{2} * (map.width - 1) * (map.height - 1) : 0;
  OutputFile out(file);
  out.write("ply\nformat binary_little_endian 1.0\ncomment unit mm, x right, y up, z depth\nelement vertex " +
            std::to_string(vertices) +
            "\nproperty float x\nproperty float y\nproperty float z\nelement face " + std::to_string(faces) +
            "\nproperty list uchar int vertex_indices\nend_header\n");
  std::vector<uint8_t> row;
  for (uint32_t y = 0; y < map.height; ++y) {
    row.clear();
    for (uint32_t x = 0; x < map.width; ++x) {
      append(row, static_cast<float>(x * map.pitch_mm_per_px));
      append(row, static_cast<float>(-(y * map.pitch_mm_per_px)));
      append(row, map.depth_mm[size_t{y} * map.width + x]);
    }
    out.write(row.data(), row.size());
  }
  for (uint32_t y = 0; y + 1 < map.height; ++y) {
    row.clear();
    for (uint32_t x = 0; x + 1 < map.width; ++x) {
      const auto a = static_cast<int32_t>(y * map.width + x);
      const auto below = static_cast<int32_t>(a + static_cast<int32_t>(map.width));
      // Counter-clockwise seen from +z, the camera's side.
      for (const auto& corners : {std::array{a, below, a + 1}, std::array{a + 1, below, below + 1}}) {
        append(row, uint8_t{3});
        for (const int32_t corner : corners) append(row, corner);
      }
    }
    out.write(row.data(), row.size());
  }
  out.commit();
}

}  // namespace

std::string_view extension(DepthFormat format) {
  switch (format) {
    case DepthFormat::Png16:
      return "png";
    case DepthFormat::Npy:
      return "npy";
    case DepthFormat::Ply:
      return "ply";
  }
  return "";
}

uint64_t write_depth(const std::filesystem::path& file, const DepthView& map, DepthFormat format) {
  switch (format) {
    case DepthFormat::Png16:
      return write_png16(file, map);
    case DepthFormat::Npy:
      write_npy(file, map.depth_mm, {map.height, map.width});
      return 0;
    case DepthFormat::Ply:
      write_ply(file, map);
      return 0;
  }
  return 0;
}

void write_confidence(const std::filesystem::path& file, std::span<const uint16_t> pixels, uint32_t width,
                      uint32_t height, DepthFormat format) {
  if (format == DepthFormat::Png16) {
    const cv::Mat counts(static_cast<int>(height), static_cast<int>(width), CV_16UC1,
                         const_cast<uint16_t*>(pixels.data()));
    return write_counts(file, counts);
  }
  std::vector<float> values;
  values.reserve(2 * pixels.size());
  for (const uint16_t pixel : pixels) {
    values.push_back(static_cast<float>(pixel & shared::kFullConfidence) /
                     static_cast<float>(shared::kFullConfidence));
    values.push_back(static_cast<float>(pixel >> shared::kReasonShift));
  }
  write_npy(file, values, {height, width, 2});
}

std::string describe_confidence_folder(uint32_t width, uint32_t height,
                                       std::span<const DepthFormat> formats) {
  nlohmann::ordered_json about = {
      {"content", "what is known of each pixel, one file a frame"},
      {"width_px", width},
      {"height_px", height},
      {"reasons",
       {{"saturated", shared::kSaturated}, {"shadowed", shared::kShadowed}, {"outside", shared::kOutside}}}};
  for (const DepthFormat format : formats) {
    if (format == DepthFormat::Png16)
      about["png"] = {{"confidence", "(count % 256) / 255"}, {"reasons", "count / 256, a sum"}};
    else
      about["npy"] = {
          {"dtype", "<f4"}, {"shape", {height, width, 2}}, {"last_index", {"confidence", "sum of reasons"}}};
  }
  return about.dump(2) + "\n";
}

std::string describe_depth_folder(const DepthView& map, std::span<const DepthFormat> formats,
                                  uint64_t clipped_px) {
  nlohmann::ordered_json about = {{"content", "depth below the pad's rest level, one file a frame"},
                                  {"width_px", map.width},
                                  {"height_px", map.height},
                                  {"pitch_mm_per_px", map.pitch_mm_per_px}};
  for (const DepthFormat format : formats) {
    if (format == DepthFormat::Png16) {
      about["png"] = {{"depth_mm", "(count - zero_count) * step_mm"},
                      {"zero_count", kDepthZeroCount},
                      {"step_mm", kDepthStep_mm},
                      {"clipped_px", clipped_px}};
    } else if (format == DepthFormat::Npy) {
      about["npy"] = {{"dtype", "<f4"}, {"unit", "mm"}, {"shape", {map.height, map.width}}};
    } else {
      about["ply"] = {{"unit", "mm"}, {"axes", "x right, y up, z depth (towards the camera)"}};
    }
  }
  return about.dump(2) + "\n";
}

}  // namespace palpate
