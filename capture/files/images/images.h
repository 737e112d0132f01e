// Image files, and frames as images.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "palpate/frame.h"

namespace cv {
class Mat;
}

namespace palpate {

/// Image formats that can be read, for messages.
inline constexpr const char* kImageKinds = "PNG, TIFF, PGM, PPM, JPEG or BMP";

/// Reads one image file (8 or 16 bit, gray or colour; alpha is dropped) as it is, without rotation by EXIF.
/// Throws Error(Failure::Input) that names the file where it is missing, no image, cut short or larger than
/// kMaxSide_px.
cv::Mat read_image(const std::filesystem::path& file);

/// The frame as OpenCV has images: gray (the frame's own pixels, not to be written to) or a copy with blue,
/// green and red interleaved.
cv::Mat to_image(const Frame& frame);

/// The frame as an image file without loss, values as they are: gray of 8 or 16 bits or colour of 8. `ending`
/// is ".png" or ".tif". Throws Error(Failure::Output).
std::vector<uint8_t> encode_image(const Frame& frame, const std::string& ending);

/// True when the name ends as an image's does (png, tif, tiff, pgm, ppm, pnm, jpg, jpeg, bmp).
bool has_image_name(const std::filesystem::path& file);

/// Order of file names in which runs of digits count as numbers; with `decimals` "0.75" is one, but "1.2.3"
/// is three.
bool natural_less(const std::string& a, const std::string& b, bool decimals = true);

/// Sorts files of one folder by their names so. Points are decimal points unless some name counts beyond them
/// (1.9, 1.10, 1.11).
void sort_naturally(std::vector<std::filesystem::path>& files);

}  // namespace palpate
