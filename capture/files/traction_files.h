// One frame's traction as a file that other programs open: NumPy array, TIFF image, or PLY mesh of the
// surface with pressure and shear at its vertices.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "capture/files/depth/depth_view.h"
#include "palpate/pipeline.h"

namespace palpate {

enum class TractionFormat : uint8_t { Npy, Tiff, Ply };
/// As the command line spells them.
inline const std::map<std::string, TractionFormat> kTractionFormats = {
    {"npy", TractionFormat::Npy}, {"tiff", TractionFormat::Tiff}, {"ply", TractionFormat::Ply}};
/// File extension of a format: "npy", "tif", "ply".
std::string_view extension(TractionFormat format);

/// NumPy: float32, rows x columns x 3 cells: pressure, shear along x and along y, kPa; shear is NaN where no
/// skin is followed. TIFF: the pressure's cells as 32-bit floats, kPa, with their spacing in the tags. PLY:
/// one vertex a pixel of `depth` as write_ply's, with the properties pressure_kPa, shear_x_kPa and
/// shear_y_kPa of the cell that the pixel lies in. A frame that nothing touches has 0 everywhere. Throws
/// Error(Failure::Output).
void write_traction(const std::filesystem::path& file, const TractionMaps& maps, const DepthView& depth,
                    TractionFormat format);

}  // namespace palpate
