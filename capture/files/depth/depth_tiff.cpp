#include "capture/files/depth/depth_tiff.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "capture/files/measured_tiff.h"

namespace palpate {
uint64_t write_depth_tiff(const std::filesystem::path& file, const DepthView& map) {
  constexpr double kLowest = std::numeric_limits<int16_t>::min(),
                   kHighest = std::numeric_limits<int16_t>::max();
  uint64_t clipped = 0;
  std::vector<int16_t> counts;
  counts.reserve(map.depth_mm.size());
  for (const float depth_mm : map.depth_mm) {
    const double depth_um = std::round(double{depth_mm} * 1000);
    if (!(depth_um >= kLowest && depth_um <= kHighest)) ++clipped;
    counts.push_back(
        static_cast<int16_t>(std::isnan(depth_um) ? kLowest : std::clamp(depth_um, kLowest, kHighest)));
  }
  write_measured_tiff(file,
                      {.width = map.width,
                       .height = map.height,
                       .pitch_mm = map.pitch_mm_per_px,
                       .about = "depth below the pad's rest level, unit um (1 count = 1 um, signed); pixels",
                       .values = std::span(counts)});
  return clipped;
}

}  // namespace palpate
