#include "capture/files/image_sequence.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <string>
#include <utility>

#include "capture/files/images/images.h"
#include "palpate/error.h"

namespace palpate {

namespace fs = std::filesystem;

ImageSequence::ImageSequence(const fs::path& file_or_folder, const Sensor& sensor) {
  std::error_code error;
  if (fs::is_directory(file_or_folder, error)) {
    for (const auto& entry : fs::directory_iterator(file_or_folder, error)) {
      if (!entry.is_regular_file(error) || !has_image_name(entry.path())) continue;
      const std::string& background = sensor.background.image;
      if (!background.empty() && fs::equivalent(entry.path(), background, error)) continue;
      files_.push_back(entry.path());
    }
    if (files_.empty())
      throw Error(Failure::Input, std::string("a folder with images (") + kImageKinds + ")",
                  "none in " + file_or_folder.string(), "the folder that holds the frames");
    sort_naturally(files_);
  } else {
    files_.push_back(file_or_folder);
  }
  first_ = std::make_unique<cv::Mat>(read_image(files_[0]));
  rectifier_.emplace(sensor, *first_, files_[0].string());
}

ImageSequence::~ImageSequence() = default;

bool ImageSequence::next(Frame& frame) {
  if (next_ >= files_.size()) return false;
  const fs::path& file = files_[next_];
  const cv::Mat image = next_ == 0 && first_ ? *first_ : read_image(file);
  first_.reset();
  rectifier_->apply(image, file.string(), frame);
  frame.sequence = next_++;
  frame.time_ns = 0;
  frame.after_gap = std::exchange(jumped_, false);
  return true;
}

bool ImageSequence::seek(uint64_t index) {
  if (index >= files_.size()) return false;
  next_ = index;
  jumped_ = true;
  return true;
}

std::string ImageSequence::frame_name(uint64_t sequence) const {
  return sequence < files_.size() ? files_[sequence].filename().string() : "";
}

}  // namespace palpate
