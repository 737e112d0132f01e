// Meshes of .stl files: binary, or text that begins with "solid".
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <string_view>

#include "capture/synthetic/object_mesh.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr size_t kMostTriangles = 4'000'000, kMostBytes = size_t{300} << 20;
constexpr size_t kHead = 84, kTriangle = 50;  // bytes

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& found) {
  throw Error(Failure::Input, "an .stl mesh of 1 to 4 million triangles within 10000 mm",
              found + " in " + file.string(), "saving it anew as binary STL, in mm");
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  const std::streamoff size = in ? std::streamoff{in.tellg()} : -1;
  if (size < 0) refuse(file, "nothing that can be read");
  if (static_cast<size_t>(size) > kMostBytes) refuse(file, "more than 300 MiB");
  std::string bytes(static_cast<size_t>(size), '\0');
  in.seekg(0);
  in.read(bytes.data(), size);
  if (in.gcount() != size) refuse(file, "nothing that can be read");
  return bytes;
}

/// Three corners from their nine numbers.
void add(ObjectMesh& mesh, const float (&corner)[9], const std::filesystem::path& file) {
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  for (const float value : corner)
    if (!(std::abs(value) <= 1e4f)) refuse(file, "a corner at no place or beyond 10000 mm");
  for (int k = 0; k < 9; k += 3) mesh.vertices.emplace_back(corner[k], corner[k + 1], corner[k + 2]);
  mesh.triangles.push_back({first, first + 1, first + 2});
}

ObjectMesh read_text(std::string_view text, const std::filesystem::path& file) {
  ObjectMesh mesh;
  float corner[9];
  size_t numbers = 0;
  constexpr std::string_view kVertex = "vertex", kBlank = " \t\r\n";
  for (size_t at = text.find(kVertex); at != std::string_view::npos; at = text.find(kVertex, at)) {
    at += kVertex.size();
    for (int k = 0; k < 3; ++k) {
      at = std::min(text.find_first_not_of(kBlank, at), text.size());
      const auto [end, error] =
          std::from_chars(text.data() + at, text.data() + text.size(), corner[numbers++]);
      if (error != std::errc{}) refuse(file, "a corner without three numbers");
      at = static_cast<size_t>(end - text.data());
    }
    if (numbers < 9) continue;
    numbers = 0;
    if (mesh.triangles.size() == kMostTriangles) refuse(file, "more triangles");
    add(mesh, corner, file);
  }
  if (numbers != 0) refuse(file, "a triangle that is cut short");
  return mesh;
}

ObjectMesh read_binary(std::string_view bytes, size_t count, const std::filesystem::path& file) {
  ObjectMesh mesh;
  mesh.vertices.reserve(3 * count);
  mesh.triangles.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    float corner[9];
    std::memcpy(corner, bytes.data() + kHead + i * kTriangle + 12, sizeof corner);  // after the normal
    add(mesh, corner, file);
  }
  return mesh;
}

}  // namespace

ObjectMesh read_stl(const std::filesystem::path& file) {
  const std::string bytes = bytes_of(file);
  uint32_t count = 0;
  if (bytes.size() >= kHead) std::memcpy(&count, bytes.data() + kHead - sizeof count, sizeof count);
  // Some binary files begin with "solid" too: their size tells.
  const bool binary = bytes.size() >= kHead && bytes.size() == kHead + size_t{count} * kTriangle;
  if (!binary && !bytes.starts_with("solid"))
    refuse(file, bytes.size() < kHead ? "a file of " + std::to_string(bytes.size()) + " bytes"
                                      : std::to_string(count) + " triangles stated in " +
                                            std::to_string(bytes.size()) + " bytes");
  if (binary && count > kMostTriangles) refuse(file, std::to_string(count) + " triangles");
  ObjectMesh mesh = binary ? read_binary(bytes, count, file) : read_text(bytes, file);
  if (mesh.triangles.empty()) refuse(file, "no triangle");
  return mesh;
}

}  // namespace palpate
