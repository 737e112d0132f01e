// A depth map as a mesh: one vertex a pixel at its centre in mm, x right, y up, z = depth (towards the
// camera, so the frame is right handed), two triangles between four neighbours.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "capture/files/depth/depth_view.h"

namespace palpate {

/// A number for each vertex, after its place.
struct VertexValues {
  std::string name;  ///< of the property, with its unit
  std::vector<float> values;
};

/// PLY, binary. Throws Error(Failure::Output), as write_obj.
void write_ply(const std::filesystem::path& file, const DepthView& map,
               std::span<const VertexValues> more = {});
/// Wavefront OBJ, text of the shortest numbers that read back as the same single ones.
void write_obj(const std::filesystem::path& file, const DepthView& map);

}  // namespace palpate
