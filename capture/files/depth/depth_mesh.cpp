#include "capture/files/depth/depth_mesh.h"

#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "capture/files/measurements.h"
#include "capture/files/output_file.h"

namespace palpate {
namespace {

constexpr const char* kAxes = "unit mm, x right, y up, z depth (towards the camera)";

template <typename T>
void append(std::vector<uint8_t>& bytes, T value) {
  const size_t at = bytes.size();
  bytes.resize(at + sizeof value);
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

template <typename T>
void append_text(std::string& text, T value) {
  char digits[32];
  const auto end = std::to_chars(std::begin(digits), std::end(digits), value).ptr;
  text.append(std::begin(digits), end);
}

// Vertex of the pixel in column x and row y.
std::array<float, 3> vertex(const DepthView& map, uint32_t x, uint32_t y) {
  return {static_cast<float>(x * map.pitch_mm_per_px), static_cast<float>(0 - y * map.pitch_mm_per_px),
          map.depth_mm[size_t{y} * map.width + x]};
}

// Indices, from 0, of the triangles right of and below that pixel; counter-clockwise seen from +z, the
// camera's side.
std::array<std::array<int32_t, 3>, 2> triangles(const DepthView& map, uint32_t x, uint32_t y) {
  const auto a = static_cast<int32_t>(y * map.width + x);
  const auto below = static_cast<int32_t>(a + static_cast<int32_t>(map.width));
  return {{{a, below, a + 1}, {a + 1, below, below + 1}}};
}

}  // namespace

void write_ply(const std::filesystem::path& file, const DepthView& map, std::span<const VertexValues> more) {
  const uint64_t vertices = uint64_t{map.width} * map.height;
  const uint64_t faces = map.width && map.height ? uint64_t{2} * (map.width - 1) * (map.height - 1) : 0;
  OutputFile out(file);
  std::string properties;
  for (const VertexValues& one : more) properties += "property float " + one.name + "\n";
  out.write(std::string("ply\nformat binary_little_endian 1.0\ncomment ") + kAxes + "\nelement vertex " +
            std::to_string(vertices) + "\nproperty float x\nproperty float y\nproperty float z\n" +
            properties + "element face " + std::to_string(faces) +
            "\nproperty list uchar int vertex_indices\nend_header\n");
  std::vector<uint8_t> row;
  for (uint32_t y = 0; y < map.height; ++y) {
    row.clear();
    for (uint32_t x = 0; x < map.width; ++x) {
      for (const float coordinate : vertex(map, x, y)) append(row, coordinate);
      for (const VertexValues& one : more) append(row, one.values[size_t{y} * map.width + x]);
    }
    out.write(row.data(), row.size());
  }
  for (uint32_t y = 0; y + 1 < map.height; ++y) {
    row.clear();
    for (uint32_t x = 0; x + 1 < map.width; ++x) {
      for (const auto& corners : triangles(map, x, y)) {
        append(row, uint8_t{3});
        for (const int32_t corner : corners) append(row, corner);
      }
    }
    out.write(row.data(), row.size());
  }
  out.commit();
}

void write_obj(const std::filesystem::path& file, const DepthView& map) {
  OutputFile out(file);
  out.write(std::string("# depth below the pad's rest level: ") + kAxes + "\n# " + std::to_string(map.width) +
            " x " + std::to_string(map.height) + " vertices, " + shortest(map.pitch_mm_per_px) +
            " mm apart, row by row from the top left\no depth\n");
  std::string row;
  for (uint32_t y = 0; y < map.height; ++y) {
    row.clear();
    for (uint32_t x = 0; x < map.width; ++x) {
      row += 'v';
      for (const float coordinate : vertex(map, x, y)) {
        row += ' ';
        append_text(row, coordinate);
      }
      row += '\n';
    }
    out.write(row);
  }
  for (uint32_t y = 0; y + 1 < map.height; ++y) {
    row.clear();
    for (uint32_t x = 0; x + 1 < map.width; ++x) {
      for (const auto& corners : triangles(map, x, y)) {
        row += 'f';
        for (const int32_t corner : corners) {
          row += ' ';
          append_text(row, corner + 1);
        }
        row += '\n';
      }
    }
    out.write(row);
  }
  out.commit();
}

}  // namespace palpate
