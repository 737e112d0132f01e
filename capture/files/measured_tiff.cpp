#include "capture/files/measured_tiff.h"

#include "capture/files/images/tiff_memory.h"
#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "palpate/error.h"

namespace palpate {

void write_measured_tiff(const std::filesystem::path& file, const MeasuredTiff& picture) {
  TiffMemory memory;
  const TiffPtr tiff = memory.create();
  const std::string about = picture.about + " are " + shortest(picture.pitch_mm) + " mm apart";
  const auto per_cm = static_cast<float>(10 / picture.pitch_mm);
  const bool whole = std::holds_alternative<std::span<int16_t>>(picture.values);
  const auto set = [&](ttag_t tag, auto value) { return TIFFSetField(tiff.get(), tag, value) == 1; };
  const auto strip = [&](auto values) {
    return TIFFWriteEncodedStrip(tiff.get(), 0, values.data(), static_cast<tmsize_t>(values.size_bytes())) >=
           0;
  };
  const bool written =
      tiff && set(TIFFTAG_IMAGEWIDTH, picture.width) && set(TIFFTAG_IMAGELENGTH, picture.height) &&
      set(TIFFTAG_BITSPERSAMPLE, whole ? 16 : 32) && set(TIFFTAG_SAMPLESPERPIXEL, 1) &&
      set(TIFFTAG_SAMPLEFORMAT, whole ? SAMPLEFORMAT_INT : SAMPLEFORMAT_IEEEFP) &&
      set(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) && set(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) &&
      set(TIFFTAG_COMPRESSION, COMPRESSION_LZW) &&
      (!picture.predicted ||
       set(TIFFTAG_PREDICTOR, whole ? PREDICTOR_HORIZONTAL : PREDICTOR_FLOATINGPOINT)) &&
      set(TIFFTAG_ROWSPERSTRIP, picture.height) && set(TIFFTAG_RESOLUTIONUNIT, RESUNIT_CENTIMETER) &&
      set(TIFFTAG_XRESOLUTION, per_cm) && set(TIFFTAG_YRESOLUTION, per_cm) &&
      set(TIFFTAG_IMAGEDESCRIPTION, about.c_str()) && set(TIFFTAG_SOFTWARE, "palpate") &&
      std::visit(strip, picture.values) && TIFFFlush(tiff.get()) == 1;
  if (!written)
    throw Error(Failure::Output, "to write '" + file.string() + "'", "an error of the TIFF encoder",
                "npy files");
  write_whole(file, memory.take());
}

}  // namespace palpate
