#include "capture/files/depth/depth_tiff.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "capture/files/images/tiff_memory.h"
#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "palpate/error.h"

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

  TiffMemory memory;
  const TiffPtr tiff = memory.create();
  const std::string about =
      "depth below the pad's rest level, unit um (1 count = 1 um, signed); pixels are " +
      shortest(map.pitch_mm_per_px) + " mm apart";
  const auto per_cm = static_cast<float>(10 / map.pitch_mm_per_px);
  const auto set = [&](ttag_t tag, auto value) { return TIFFSetField(tiff.get(), tag, value) == 1; };
  const bool written =
      tiff && set(TIFFTAG_IMAGEWIDTH, map.width) && set(TIFFTAG_IMAGELENGTH, map.height) &&
      set(TIFFTAG_BITSPERSAMPLE, 16) && set(TIFFTAG_SAMPLESPERPIXEL, 1) &&
      set(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_INT) && set(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) &&
      set(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) && set(TIFFTAG_COMPRESSION, COMPRESSION_LZW) &&
      set(TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL) && set(TIFFTAG_ROWSPERSTRIP, map.height) &&
      set(TIFFTAG_RESOLUTIONUNIT, RESUNIT_CENTIMETER) && set(TIFFTAG_XRESOLUTION, per_cm) &&
      set(TIFFTAG_YRESOLUTION, per_cm) && set(TIFFTAG_IMAGEDESCRIPTION, about.c_str()) &&
      set(TIFFTAG_SOFTWARE, "palpate") &&
      TIFFWriteEncodedStrip(tiff.get(), 0, counts.data(),
                            static_cast<tmsize_t>(counts.size() * sizeof(int16_t))) >= 0 &&
      TIFFFlush(tiff.get()) == 1;
  if (!written)
    throw Error(Failure::Output, "to write '" + file.string() + "'", "an error of the TIFF encoder",
                "npy files");
  write_whole(file, memory.take());
  return clipped;
}

}  // namespace palpate
