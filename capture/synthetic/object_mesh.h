// Object meshes: what is pressed into the simulated pad, as triangles, and the depth that it has in the pad.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "engine/motion/rigid_motion.h"

namespace palpate {

struct ObjectMesh {
  std::vector<Eigen::Vector3f> vertices;  ///< mm; x to the right, y down, z into the pad
  std::vector<std::array<uint32_t, 3>> triangles;
  /// Half of its extent along z, mm: as far below its highest point its axis lies when it rolls.
  double half_height_mm = 0;
};

/// Names of the built-in shapes: "bead", "key" and so on.
const std::vector<std::string>& object_shapes();
/// One of them. Its middle along the pad is at x = y = 0, its highest point at z = 0.
ObjectMesh shape_mesh(const std::string& name);

/// An .npy height map (rows x columns, mm, larger is nearer to the pad, NaN: a hole) of that pitch, or an
/// .stl mesh (binary or text, mm, its z towards the pad), placed as shape_mesh says. Throws
/// Error(Failure::Input) that says what is wrong with it.
ObjectMesh read_object(const std::filesystem::path& file, double pitch_mm);
/// The triangles of an .stl file as they stand there.
ObjectMesh read_stl(const std::filesystem::path& file);

/// Places of pixels: centres in mm from the picture's centre.
struct PixelGrid {
  uint32_t width = 0, height = 0;
  double pitch_mm = 0;
};
/// How deep the moved object reaches at each pixel, mm, row by row; 0 where it does not.
std::vector<float> depth_of(const ObjectMesh& mesh, const RigidMotion& motion, const PixelGrid& grid);

/// Smooths in place by a Gaussian of that standard deviation, as a skin does; the border goes on.
void smooth(std::vector<float>& map, uint32_t width, uint32_t height, double sd_px);

}  // namespace palpate
