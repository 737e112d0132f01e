#include "capture/files/depth/depth_files.h"

#include <cmath>
#include <vector>

#include "capture/files/depth/depth_mesh.h"
#include "capture/files/depth/depth_tiff.h"
#include "capture/files/images/image_file.h"
#include "capture/files/npy.h"
#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "palpate/error.h"
#include "shaders/shared/confidence.h"

namespace palpate {
namespace {

void write_counts(const std::filesystem::path& file, std::span<const uint16_t> counts, uint32_t width,
                  uint32_t height) {
  const std::vector<uint8_t> bytes =
      encode_png({counts.data(), width, height, 1, 2, width * sizeof(uint16_t)});
  if (bytes.empty())
    throw Error(Failure::Output, "to write '" + file.string() + "'", "an error of the PNG encoder",
                "npy files");
  write_whole(file, bytes);
}

uint64_t write_png16(const std::filesystem::path& file, const DepthView& map) {
  std::vector<uint16_t> counts(size_t{map.width} * map.height);
  uint64_t clipped = 0;
  for (uint32_t y = 0; y < map.height; ++y) {
    uint16_t* row = counts.data() + size_t{y} * map.width;
    const float* depth = map.depth_mm.data() + size_t{y} * map.width;
    for (uint32_t x = 0; x < map.width; ++x) {
      const double count = std::round(depth[x] / kDepthStep_mm) + kDepthZeroCount;
      if (!(count >= 0 && count <= 65535)) ++clipped;
      row[x] = static_cast<uint16_t>(count > 65535 ? 65535 : count >= 0 ? count : 0);
    }
  }
  write_counts(file, counts, map.width, map.height);
  return clipped;
}

}  // namespace

std::string_view extension(DepthFormat format) {
  switch (format) {
    case DepthFormat::Png16:
      return "png";
    case DepthFormat::Tiff:
      return "tif";
    case DepthFormat::Npy:
      return "npy";
    case DepthFormat::Ply:
      return "ply";
    case DepthFormat::Obj:
      return "obj";
  }
  return "";
}

uint64_t write_depth(const std::filesystem::path& file, const DepthView& map, DepthFormat format) {
  switch (format) {
    case DepthFormat::Png16:
      return write_png16(file, map);
    case DepthFormat::Tiff:
      return write_depth_tiff(file, map);
    case DepthFormat::Npy:
      write_npy(file, map.depth_mm, {map.height, map.width});
      return 0;
    case DepthFormat::Ply:
      write_ply(file, map);
      return 0;
    case DepthFormat::Obj:
      write_obj(file, map);
      return 0;
  }
  return 0;
}

void write_confidence(const std::filesystem::path& file, std::span<const uint16_t> pixels, uint32_t width,
                      uint32_t height, DepthFormat format) {
  if (format == DepthFormat::Png16) return write_counts(file, pixels, width, height);
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
  json::Value about = {
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
                                  const std::map<DepthFormat, uint64_t>& clipped_px) {
  json::Value about = {{"content", "depth below the pad's rest level, one file a frame"},
                       {"width_px", map.width},
                       {"height_px", map.height},
                       {"pitch_mm_per_px", map.pitch_mm_per_px}};
  const json::Value mesh = {{"unit", "mm"}, {"axes", "x right, y up, z depth (towards the camera)"}};
  for (const DepthFormat format : formats) {
    json::Value& one = about[std::string(extension(format))];
    switch (format) {
      case DepthFormat::Png16:
        one = {{"depth_mm", "(count - zero_count) * step_mm"},
               {"zero_count", kDepthZeroCount},
               {"step_mm", kDepthStep_mm}};
        break;
      case DepthFormat::Tiff:
        one = {{"depth_um", "count"}, {"count", "signed, 16 bits"}};
        break;
      case DepthFormat::Npy:
        one = {{"dtype", "<f4"}, {"unit", "mm"}, {"shape", {map.height, map.width}}};
        break;
      case DepthFormat::Ply:
      case DepthFormat::Obj:
        one = mesh;
        break;
    }
    if (const auto clipped = clipped_px.find(format); clipped != clipped_px.end())
      one["clipped_px"] = clipped->second;
  }
  return about.dump(2) + "\n";
}

}  // namespace palpate
