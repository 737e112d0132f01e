// One frame's depth map as a file that other programs open: 16-bit PNG or TIFF, NumPy array, PLY or OBJ mesh.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "capture/files/depth/depth_view.h"

namespace palpate {

enum class DepthFormat : uint8_t { Png16, Tiff, Npy, Ply, Obj };
/// As the command line spells them.
inline const std::map<std::string, DepthFormat> kDepthFormats = {{"png16", DepthFormat::Png16},
                                                                 {"tiff", DepthFormat::Tiff},
                                                                 {"npy", DepthFormat::Npy},
                                                                 {"ply", DepthFormat::Ply},
                                                                 {"obj", DepthFormat::Obj}};
/// File extension of a format: "png", "tif", "npy", "ply", "obj".
std::string_view extension(DepthFormat format);

/// depth_mm = (count - kDepthZeroCount) * kDepthStep_mm: 0.2 um a count, from -1.6384 mm to 11.4684 mm.
inline constexpr double kDepthStep_mm = 0.0002;
inline constexpr int kDepthZeroCount = 8192;

/// Writes one map in one step and returns how many of its pixels did not fit the format's range (images of 16
/// bits only; they are written as the nearest count). Throws Error(Failure::Output). See depth_tiff.h and
/// depth_mesh.h for TIFF and meshes.
uint64_t write_depth(const std::filesystem::path& file, const DepthView& map, DepthFormat format);

/// Confidence of pixels, height x width as Result::confidence gives it. 16-bit PNG: the counts as they
/// are. NumPy: float32, height x width x 2, confidence 0 to 1 and the sum of reasons. Throws
/// Error(Failure::Output).
void write_confidence(const std::filesystem::path& file, std::span<const uint16_t> pixels, uint32_t width,
                      uint32_t height, DepthFormat format);
/// Description of a folder of confidence maps, as JSON text.
std::string describe_confidence_folder(uint32_t width, uint32_t height, std::span<const DepthFormat> formats);

/// Description of a folder of depth maps, as JSON text. `clipped_px`: pixels that did not fit, of the formats
/// with a range.
std::string describe_depth_folder(const DepthView& map, std::span<const DepthFormat> formats,
                                  const std::map<DepthFormat, uint64_t>& clipped_px);

}  // namespace palpate
