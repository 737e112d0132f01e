#include "capture/files/map_files.h"

#include <array>
#include <cmath>
#include <cstring>

#include "capture/files/measured_tiff.h"
#include "capture/files/npy.h"
#include "capture/files/output_file.h"
#include "palpate/error.h"

namespace palpate {
namespace {

template <typename T>
void append(std::string& bytes, T value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof value);
}

/// Vertices where something was seen, triangles where three neighbours were; y up.
void write_mesh(const std::filesystem::path& file, const FusedMap& map) {
  std::vector<int32_t> vertex(map.height_mm.size(), -1);
  std::string vertices, faces;
  int32_t count = 0, triangles = 0;
  for (size_t at = 0; at < vertex.size(); ++at) {
    if (std::isnan(map.height_mm[at])) continue;
    const size_t column = at % map.width, row = at / map.width;
    vertex[at] = count++;
    append(vertices, static_cast<float>(map.left_mm + double(column) * map.pitch_mm));
    append(vertices, static_cast<float>(-(map.top_mm + double(row) * map.pitch_mm)));
    append(vertices, map.height_mm[at]);
    append(vertices, map.error_mm[at]);
    append(vertices, map.coverage[at]);
  }
  const auto face = [&](const std::array<size_t, 3>& corners) {
    for (const size_t corner : corners)
      if (vertex[corner] < 0) return;
    append(faces, uint8_t{3});
    for (const size_t corner : corners) append(faces, vertex[corner]);
    ++triangles;
  };
  for (uint32_t row = 0; row + 1 < map.height; ++row)
    for (uint32_t column = 0; column + 1 < map.width; ++column) {
      const size_t at = size_t{row} * map.width + column, below = at + map.width;
      face({at, below, at + 1});
      face({at + 1, below, below + 1});
    }
  OutputFile out(file);
  out.write(
      "ply\nformat binary_little_endian 1.0\ncomment unit mm, x right, y up, z out of the object\nelement "
      "vertex " +
      std::to_string(count) +
      "\nproperty float x\nproperty float y\nproperty float z\nproperty float error_mm\nproperty float "
      "coverage\n"
      "element face " +
      std::to_string(triangles) + "\nproperty list uchar int vertex_indices\nend_header\n");
  out.write(vertices);
  out.write(faces);
  out.commit();
}

}  // namespace

std::vector<std::string> write_map(const std::filesystem::path& folder, const MapSnapshot& map) {
  std::vector<std::string> names;
  for (size_t k = 0; k < map.pieces.size(); ++k) {
    const FusedMap& one = map.pieces[k].map;
    const std::string number = k == 0 ? "" : "_" + std::to_string(k + 1);
    const auto name = [&](const std::string& stem, const char* ending) {
      return names.emplace_back(stem + number + ending);
    };
    const std::vector<size_t> shape{one.height, one.width};
    write_npy(folder / name("map", ".npy"), one.height_mm, shape);
    write_npy(folder / name("map_error", ".npy"), one.error_mm, shape);
    write_npy(folder / name("coverage", ".npy"), one.coverage, shape);
    write_mesh(folder / name("map", ".ply"), one);
    std::vector<float> heights = one.height_mm;
    write_measured_tiff(
        folder / name("map", ".tif"),
        {.width = one.width,
         .height = one.height,
         .pitch_mm = one.pitch_mm,
         .about =
             "height of the object out of its first contact, unit mm, NaN where nothing was seen; pixels",
         .values = std::span(heights)});
  }
  return names;
}

double stated_error_mm(const FusedMap& map) {
  double squares = 0, seen = 0;
  for (size_t at = 0; at < map.height_mm.size(); ++at) {
    if (std::isnan(map.height_mm[at])) continue;
    squares += double{map.error_mm[at]} * double{map.error_mm[at]};
    ++seen;
  }
  return std::sqrt(squares / seen);
}

json::Value map_json(const MapSnapshot& map) {
  json::Value pieces = json::Value::array();
  for (const MapPiece& piece : map.pieces) {
    const FusedMap& m = piece.map;
    json::Value keys = json::Value::array();
    for (const MapKey& key : piece.keys) {
      const Eigen::Vector3d turn = turn_vector(key.motion.turn);
      json::Value shift = json::Value::array(), turns = json::Value::array(), sd = json::Value::array();
      for (int c = 0; c < 3; ++c) {
        shift.push_back(key.motion.shift_mm[c]);
        turns.push_back(turn[c]);
        sd.push_back(std::sqrt(key.covariance(c, c)));
      }
      keys.push_back({{"frame", key.frame}, {"shift_mm", shift}, {"turn_rad", turns}, {"place_sd_mm", sd}});
    }
    pieces.push_back({{"rows", m.height},
                      {"columns", m.width},
                      {"pitch_mm", m.pitch_mm},
                      {"left_mm", m.left_mm},
                      {"top_mm", m.top_mm},
                      {"covered_mm2", m.covered_mm2()},
                      {"noise_mm", m.noise_mm},
                      {"pad_mm", m.pad_mm},
                      {"bend_mm", m.bend_mm},
                      {"error_rms_mm", stated_error_mm(m)},
                      {"key_frames", keys}});
  }
  return {{"pieces", pieces},
          {"key_frames", map.keys},
          {"smooth_key_frames", map.smooth},
          {"left_out_key_frames", map.left_out},
          {"missed_key_frames", map.missed},
          {"loops", map.loops},
          {"tracks_found_again", map.found_again},
          {"ambiguous_places", map.ambiguous},
          {"repeating_places", map.repeating},
          {"loops_refused", map.refused},
          {"residual_mm", map.residual_mm},
          {"variance_factor", map.variance_factor}};
}

}  // namespace palpate
