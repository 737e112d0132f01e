// Recording made of images: one file, or a folder whose files are taken in natural order (2 before 10).
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "capture/rectify.h"
#include "capture/source.h"

namespace palpate {

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

  bool seek(uint64_t index) override;
  std::string frame_name(uint64_t sequence) const override;

  const std::vector<std::filesystem::path>& files() const { return files_; }

 private:
  std::vector<std::filesystem::path> files_;
  std::unique_ptr<cv::Mat> first_;  // read to learn the format, handed out by the first `next`
  std::optional<Rectifier> rectifier_;
  uint64_t next_ = 0;
  bool jumped_ = false;
};

}  // namespace palpate
