// A depth map as a TIFF image of 16 bits in micrometres, which measuring programs open with its scale.
#pragma once

#include <cstdint>
#include <filesystem>

#include "capture/files/depth/depth_view.h"

namespace palpate {

/// Signed counts of 1 um, from -32.768 mm to 32.767 mm, one strip of LZW. The description says so, and the
/// resolution holds the pixels to a centimetre. Returns how many pixels did not fit (they are written as the
/// nearest that does; what is not a number as -32768). Throws Error(Failure::Output).
uint64_t write_depth_tiff(const std::filesystem::path& file, const DepthView& map);

}  // namespace palpate
