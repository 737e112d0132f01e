#include "capture/synthetic/object_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "capture/files/npy.h"
#include "capture/synthetic/object_shapes.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kHole = -1e9;

/// Two triangles for each cell of a grid whose four corners are there; x and y count from its middle.
ObjectMesh mesh_of_grid(
    uint32_t columns, uint32_t rows, double step_mm,
    const std::function<double(uint32_t column, uint32_t row, double x_mm, double y_mm)>& height_mm) {
  ObjectMesh mesh;
  constexpr uint32_t kNone = ~uint32_t{0};
  std::vector<uint32_t> index(size_t{columns} * rows, kNone);
  for (uint32_t row = 0; row < rows; ++row)
    for (uint32_t column = 0; column < columns; ++column) {
      const double x = (column - (columns - 1) / 2.0) * step_mm, y = (row - (rows - 1) / 2.0) * step_mm,
                   z = height_mm(column, row, x, y);
      if (!(z > kHole)) continue;
      index[size_t{row} * columns + column] = static_cast<uint32_t>(mesh.vertices.size());
      mesh.vertices.push_back(Eigen::Vector3d(x, y, z).cast<float>());
    }
  for (uint32_t row = 0; row + 1 < rows; ++row)
    for (uint32_t column = 0; column + 1 < columns; ++column) {
      const uint32_t* at = index.data() + size_t{row} * columns + column;
      const std::array<uint32_t, 4> corner = {at[0], at[1], at[columns], at[columns + 1]};
      if (std::ranges::find(corner, kNone) != corner.end()) continue;
      mesh.triangles.push_back({corner[0], corner[1], corner[2]});
      mesh.triangles.push_back({corner[1], corner[3], corner[2]});
    }
  return mesh;
}

ObjectMesh mesh_of_surface(const scenes::SolidObject& object, double width_mm, double height_mm,
                           double radius_mm = 1e9) {
  constexpr double kStep_mm = 0.1;
  const auto points = [&](double side_mm) { return static_cast<uint32_t>(side_mm / kStep_mm) + 1; };
  return mesh_of_grid(points(width_mm), points(height_mm), kStep_mm,
                      [&](uint32_t, uint32_t, double x, double y) {
                        return std::hypot(x, y) < radius_mm ? object.depth_mm(x, y) : 2 * kHole;
                      });
}

/// By latitude and longitude about y, so that no pole comes to the pad when it rolls about y.
ObjectMesh mesh_of_round(const scenes::RoundObject& object) {
  constexpr double kStep_mm = 0.08;
  const double size_mm = std::max(object.radius_mm(1, 0, 0), object.radius_mm(0, 0, 1));
  const auto rings = static_cast<uint32_t>(std::numbers::pi * size_mm / kStep_mm), around = 2 * rings;
  ObjectMesh mesh;
  for (uint32_t ring = 0; ring <= rings; ++ring)
    for (uint32_t k = 0; k < around; ++k) {
      const double from_pole = std::numbers::pi * ring / rings, angle = 2 * std::numbers::pi * k / around;
      const Eigen::Vector3d way(std::sin(from_pole) * std::cos(angle), std::cos(from_pole),
                                std::sin(from_pole) * std::sin(angle));
      mesh.vertices.push_back((object.radius_mm(way[0], way[1], way[2]) * way).cast<float>());
    }
  for (uint32_t ring = 0; ring < rings; ++ring)
    for (uint32_t k = 0; k < around; ++k) {
      const uint32_t a = ring * around + k, b = ring * around + (k + 1) % around;
      mesh.triangles.push_back({a, b, a + around});
      mesh.triangles.push_back({b, b + around, a + around});
    }
  return mesh;
}

/// Middle along the pad to x = y = 0, highest point to z = 0.
ObjectMesh placed(ObjectMesh mesh) {
  Eigen::Vector3f low = mesh.vertices.front(), high = low;
  for (const Eigen::Vector3f& v : mesh.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const Eigen::Vector3f middle((low[0] + high[0]) / 2, (low[1] + high[1]) / 2, high[2]);
  for (Eigen::Vector3f& v : mesh.vertices) v -= middle;
  mesh.half_height_mm = double{high[2] - low[2]} / 2;
  return mesh;
}

using Maker = std::function<ObjectMesh()>;
const std::map<std::string, Maker>& makers() {
  using namespace scenes;
  constexpr double kDisc_mm = 5.5, kWide_mm = 24;
  static const std::map<std::string, Maker> all = {
      {"textured", [] { return mesh_of_surface(textured_dome(), 14, 14); }},
      {"relief", [] { return mesh_of_surface(textured_plane(), 100, 10); }},
      {"plane",
       [] {
         return mesh_of_surface({"plane", [](double, double) { return 0.0; }}, 12, 12, kDisc_mm);
       }},
      {"cylinder", [] { return mesh_of_surface(cylinder(), 14, 14, 7); }},
      {"screw", [] { return mesh_of_surface(screw(), kWide_mm, 9); }},
      {"key", [] { return mesh_of_surface(key_relief(), 14, 14); }},
      {"coin", [] { return mesh_of_surface(coin(), 12, 12, kDisc_mm); }},
      {"bead", [] { return mesh_of_round(bead()); }},
      {"seed", [] { return mesh_of_round(seed()); }},
      {"ball", [] {
         return mesh_of_round({"ball", [](double, double, double) { return 8.0; }});
       }}};
  return all;
}

}  // namespace

const std::vector<std::string>& object_shapes() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& [name, make] : makers()) all.push_back(name);
    return all;
  }();
  return names;
}

ObjectMesh shape_mesh(const std::string& name) {
  return placed(makers().at(name)());
}

namespace {

ObjectMesh mesh_of_npy(const std::filesystem::path& file, double pitch_mm) {
  constexpr size_t kMost = 4'000'000;
  const NpyArray map = read_npy(file);
  const auto refuse = [&](const std::string& found) {
    throw Error(Failure::Input, "a height map of 2 x 2 to 4 million numbers, mm, NaN for holes",
                found + " in " + file.string(), "rows x columns of float32, and pitch_mm=");
  };
  if (map.shape.size() != 2 || map.shape[0] < 2 || map.shape[1] < 2 || map.values.size() > kMost)
    refuse("an array of " + describe_shape(map.shape));
  if (std::ranges::any_of(map.values, [](float v) { return std::abs(v) > 1e4f; }))
    refuse("a height beyond 10000 mm");
  const auto columns = static_cast<uint32_t>(map.shape[1]), rows = static_cast<uint32_t>(map.shape[0]);
  return mesh_of_grid(columns, rows, pitch_mm, [&](uint32_t column, uint32_t row, double, double) {
    return double{map.values[size_t{row} * columns + column]};
  });
}

}  // namespace

ObjectMesh read_object(const std::filesystem::path& file, double pitch_mm) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
  if (ending != ".npy" && ending != ".stl")
    throw Error(Failure::Input, "an object as .npy (a height map) or .stl (a mesh)",
                "'" + file.string() + "'", "one of the shapes: shape=key");
  ObjectMesh mesh = ending == ".npy" ? mesh_of_npy(file, pitch_mm) : read_stl(file);
  if (mesh.triangles.empty())
    throw Error(Failure::Input, "an object with a surface", "holes alone in " + file.string(),
                "another file");
  return placed(std::move(mesh));
}

std::vector<float> depth_of(const ObjectMesh& mesh, const RigidMotion& motion, const PixelGrid& grid) {
  std::vector<float> depth(size_t{grid.width} * grid.height);
  const Eigen::Matrix3f turn = motion.turn.cast<float>();
  const Eigen::Vector3f shift = motion.shift_mm.cast<float>(),
                        middle =
                            Eigen::Vector3d((grid.width - 1) / 2.0, (grid.height - 1) / 2.0, 0).cast<float>();
  const auto per_mm = static_cast<float>(1 / grid.pitch_mm);
  std::vector<Eigen::Vector3f> moved(mesh.vertices.size());  // px, px, mm
  for (size_t i = 0; i < moved.size(); ++i) {
    const Eigen::Vector3f v = turn * mesh.vertices[i] + shift;
    moved[i] = Eigen::Vector3f(v[0] * per_mm, v[1] * per_mm, v[2]) + middle;
  }
  const auto last_column = static_cast<float>(grid.width) - 1, last_row = static_cast<float>(grid.height) - 1;
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3f &a = moved[triangle[0]], &b = moved[triangle[1]], &c = moved[triangle[2]];
    if (std::max({a[2], b[2], c[2]}) <= 0) continue;
    const float left = std::max(std::ceil(std::min({a[0], b[0], c[0]})), 0.0f),
                right = std::min(std::floor(std::max({a[0], b[0], c[0]})), last_column),
                top = std::max(std::ceil(std::min({a[1], b[1], c[1]})), 0.0f),
                bottom = std::min(std::floor(std::max({a[1], b[1], c[1]})), last_row);
    if (left > right || top > bottom) continue;
    const float twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if (std::abs(twice) < 1e-9f) continue;
    constexpr float kOn = -1e-5f;  // what lies on an edge belongs to both
    for (float y = top; y <= bottom; ++y)
      for (float x = left; x <= right; ++x) {
        const float v = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / twice,
                    w = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / twice;
        if (v < kOn || w < kOn || 1 - v - w < kOn) continue;
        float& at = depth[static_cast<size_t>(y) * grid.width + static_cast<size_t>(x)];
        at = std::max(at, a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2]));
      }
  }
  return depth;
}

void smooth(std::vector<float>& map, uint32_t width, uint32_t height, double sd_px) {
  if (sd_px <= 0) return;
  const auto far = static_cast<size_t>(std::ceil(3 * sd_px));
  std::vector<float> kernel, line;
  double sum = 0;
  const auto weight = [&](size_t k) {
    const double way = static_cast<double>(k) - static_cast<double>(far);
    return std::exp(-way * way / (2 * sd_px * sd_px));
  };
  for (size_t k = 0; k <= 2 * far; ++k) sum += weight(k);
  for (size_t k = 0; k <= 2 * far; ++k) kernel.push_back(static_cast<float>(weight(k) / sum));
  const auto pass = [&](uint32_t lines, uint32_t length, size_t next, size_t step) {
    line.resize(length + 2 * far);
    for (uint32_t l = 0; l < lines; ++l) {
      bool empty = true;
      for (size_t i = 0; i < line.size(); ++i) {
        line[i] = map[l * next + (std::clamp<size_t>(i, far, far + length - 1) - far) * step];
        empty = empty && line[i] == 0;
      }
      if (empty) continue;
      for (size_t i = 0; i < length; ++i) {
        float value = 0;
        for (size_t k = 0; k < kernel.size(); ++k) value += kernel[k] * line[i + k];
        map[l * next + i * step] = value;
      }
    }
  };
  pass(height, width, width, 1);
  pass(width, height, 1, width);
}

}  // namespace palpate
