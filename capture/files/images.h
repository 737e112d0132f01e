// Images as a recording: one file, or a folder whose files are taken in natural order (2 before 10).
#pragma once

#include <filesystem>
#include <vector>

#include "capture/rectify.h"
#include "capture/source.h"

namespace palpate {

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

/// Order of file names in which runs of digits count as numbers.
bool natural_less(const std::string& a, const std::string& b);

class ImageSequence : public Source {
 public:
  /// The sensor's background image, if it lies in the same folder, is not a frame. Throws
  /// Error(Failure::Input).
  ImageSequence(const std::filesystem::path& file_or_folder, const Sensor& sensor);
  ~ImageSequence() override;

  FrameFormat format() const override { return rectifier_->format(); }
  double rate_Hz() const override { return 0; }
  std::optional<uint64_t> frame_count() const override { return files_.size(); }
  /// The time of every frame is 0: image files carry none.
  bool next(Frame& frame) override;

  const std::vector<std::filesystem::path>& files() const { return files_; }

 private:
  std::vector<std::filesystem::path> files_;
  std::unique_ptr<cv::Mat> first_;  // read to learn the format, handed out by the first `next`
  std::optional<Rectifier> rectifier_;
  uint64_t next_ = 0;
};

}  // namespace palpate
