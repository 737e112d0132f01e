#include "capture/files/video.h"

#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "capture/files/images/image_header.h"
#include "capture/video/module.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

/// The frame of the last `grab`, over the decoder's memory. False where it cannot be shown.
bool show(VideoDecoder& video, cv::Mat& image) {
  const std::optional<BgrView> view = video.picture();
  if (!view) return false;
  image = cv::Mat(static_cast<int>(view->height), static_cast<int>(view->width), CV_8UC3,
                  const_cast<uint8_t*>(view->pixels), view->row_bytes);
  return !image.empty();
}

}  // namespace

VideoFile::VideoFile(const fs::path& file, const Sensor& sensor)
    : file_(file), video_(video_module().decode(file)), image_(std::make_unique<cv::Mat>()) {
  if (!video_)
    throw Error(Failure::Input, "a video, an image or a folder of images",
                file.string() + ", which cannot be decoded",
                "playing it with another program, or copying it again");
  const uint32_t width = video_->width(), height = video_->height();
  if (width > kMaxSide_px || height > kMaxSide_px)
    throw Error(Failure::Input, "a video with sides of at most " + std::to_string(kMaxSide_px) + " px",
                file.string() + " of " + std::to_string(width) + "x" + std::to_string(height) + " px",
                "a smaller video");
  if (!video_->grab() || !show(*video_, *image_))
    throw Error(Failure::Input, "a video with frames", file.string() + ", of which no frame decodes",
                "copying it again");
  if (sensor.bit_depth > 8)
    throw Error(Failure::Input,
                "16-bit images (the sensor has " + std::to_string(sensor.bit_depth) + " bits)",
                file.string() + ", a video, which is decoded to 8 bits",
                "a folder of 16-bit images, or \"bit_depth\": 8 in the sensor file");
  rectifier_.emplace(sensor, *image_, file.string());
  packets_ = video_module().packets(file);
  if (const auto header = packets_ ? read_image_header(packets_->next()) : std::nullopt) {
    packet_size_px_ = {header->width, header->height};
    packets_->seek(0);
  } else {
    packets_.reset();  // another codec
  }
  const double rate = video_->rate_Hz(), count = video_->frame_count();
  if (rate > 0 && rate < 1e6) rate_Hz_ = rate;
  if (count >= 1 && count < 1e12) announced_ = static_cast<uint64_t>(count);
}

VideoFile::~VideoFile() = default;

/// Looks at the packet of the frame that `next` is about to hand out. Throws where its size changed.
bool VideoFile::packet_is_whole() {
  const std::span<const uint8_t> packet = packets_ ? packets_->next() : std::span<const uint8_t>();
  if (packet.empty()) return true;
  const auto header = read_image_header(packet);
  if (!header) return false;
  if (std::array{header->width, header->height} != packet_size_px_) {
    const auto text = [](uint64_t w, uint64_t h) {
      return std::to_string(w) + "x" + std::to_string(h) + " px";
    };
    throw Error(
        Failure::Input,
        "frames of one size, " + text(packet_size_px_[0], packet_size_px_[1]) + " as the first",
        file_.string() + " frame " + std::to_string(next_) + " of " + text(header->width, header->height),
        "recordings of one size each");
  }
  return header->whole;
}

bool VideoFile::next(Frame& frame) {
  const bool first = std::exchange(grabbed_, false);
  if (ended_ || (!first && !(video_->grab() && show(*video_, *image_))) || !packet_is_whole()) {
    ended_ = true;
    return false;
  }
  rectifier_->apply(*image_, file_.string() + " frame " + std::to_string(next_), frame);
  frame.sequence = next_;
  frame.time_ns = rate_Hz_ > 0 ? std::llround(static_cast<double>(next_) / rate_Hz_ * 1e9) : 0;
  frame.after_gap = std::exchange(jumped_, false);
  ++next_;
  return true;
}

bool VideoFile::seek(uint64_t index) {
  if (!video_->seek(index)) return false;
  if (packets_) packets_->seek(index);
  next_ = index;
  grabbed_ = ended_ = false;
  jumped_ = true;
  return true;
}

bool VideoFile::cut_short() const {
  // One frame more or less is a matter of how a container counts.
  return ended_ && announced_ && video_->frames_are_counted() && next_ + 1 < *announced_;
}

std::string VideoFile::warning() const {
  if (!ended_ || !announced_ || next_ >= *announced_) return {};
  return file_.string() + " announces " + std::to_string(*announced_) + " frames but only " +
         std::to_string(next_) + " could be read: it is damaged or cut short";
}

}  // namespace palpate
