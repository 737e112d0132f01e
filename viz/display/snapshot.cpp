#include "viz/display/snapshot.h"

#include <algorithm>
#include <span>

#include "capture/files/depth/depth_tiff.h"
#include "capture/files/images/images.h"
#include "capture/files/output_file.h"
#include "engine/pipeline/surface_map.h"
#include "viz/display/picture.h"
#include "viz/render/format.h"

namespace palpate::viz {

Snapshot snapshot_of(const Frame& frame, const Result& result, MeasuredColumns columns,
                     double pitch_mm_per_px) {
  Snapshot snapshot{{}, {}, result.touch, columns};
  snapshot.frame.format = frame.format;
  snapshot.frame.bytes.assign(frame.pixels(), frame.pixels() + frame.format.frame_bytes());
  if (surface_of(result).buffer) {
    const std::span<const float> depth_mm = result.depth_mm();
    snapshot.depth_mm.assign(depth_mm.begin(), depth_mm.end());
    snapshot.pitch_mm_per_px = pitch_mm_per_px;
  }
  return snapshot;
}

std::filesystem::path next_file(const std::filesystem::path& folder, const char* name, int& number) {
  std::filesystem::path stem;
  do {
    stem = folder / text("%s-%04d", name, ++number);
  } while (std::filesystem::exists(stem.string() + ".png") ||
           std::filesystem::exists(stem.string() + ".csv"));
  return stem;
}

std::string write_snapshot(const Snapshot& snapshot, const std::filesystem::path& stem) {
  make_output_folder(stem.has_parent_path() ? stem.parent_path() : ".");
  if (snapshot.picture.width > 0) write_png(snapshot.picture, stem.string() + ".png");
  write_whole(stem.string() + "-frame.png", encode_image(snapshot.frame, ".png"));
  std::string names = stem.string() + (snapshot.picture.width > 0 ? ".png, -frame.png, " : "-frame.png, ");
  if (!snapshot.depth_mm.empty()) {
    const FrameFormat& format = snapshot.frame.format;
    write_depth_tiff(stem.string() + "-depth.tif",
                     {snapshot.depth_mm, format.width, format.height, snapshot.pitch_mm_per_px});
    names += "-depth.tif, ";
  }
  write_whole(stem.string() + ".csv",
              Measurements::header(snapshot.columns) + "\n" +
                  Measurements::row(snapshot.touch, snapshot.columns, Digits::Deserved) + "\n");
  return names + ".csv";
}

RgbImage part_of(const RgbImage& picture, const ViewRect& rect) {
  const auto left = static_cast<uint32_t>(std::max(rect.x, 0)),
             top = static_cast<uint32_t>(std::max(rect.y, 0));
  RgbImage part;
  part.width = left < picture.width ? std::min(rect.width, picture.width - left) : 0;
  part.height = top < picture.height ? std::min(rect.height, picture.height - top) : 0;
  for (uint32_t y = 0; part.width > 0 && y < part.height; ++y)
    part.rgb.insert(part.rgb.end(), picture.at(left, top + y), picture.at(left, top + y) + 3 * part.width);
  return part;
}

}  // namespace palpate::viz
