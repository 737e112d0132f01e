#include "capture/files/video.h"

#include <cmath>
#include <cstdlib>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/videoio.hpp>

#include "capture/files/image_header.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

/// The decoders' own lines on stderr say nothing that our errors do not.
void silence_decoders() {
  static std::once_flag once;
  std::call_once(once, [] {
    setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  });
}

bool read(cv::VideoCapture& video, cv::Mat& image) {
  try {
    return video.read(image) && !image.empty();
  } catch (const cv::Exception&) {
    return false;
  }
}

}  // namespace

VideoFile::VideoFile(const fs::path& file, const Sensor& sensor)
    : file_(file), video_(std::make_unique<cv::VideoCapture>()), image_(std::make_unique<cv::Mat>()) {
  silence_decoders();
  bool open = false;
  try {
    open = video_->open(file.string(), cv::CAP_FFMPEG);
  } catch (const cv::Exception&) {
  }
  if (!open)
    throw Error(Failure::Input, "a video, an image or a folder of images",
                file.string() + ", which cannot be decoded",
                "playing it with another program, or copying it again");
  const double width = video_->get(cv::CAP_PROP_FRAME_WIDTH), height = video_->get(cv::CAP_PROP_FRAME_HEIGHT);
  if (!(width <= kMaxSide_px && height <= kMaxSide_px))
    throw Error(Failure::Input, "a video with sides of at most " + std::to_string(kMaxSide_px) + " px",
                file.string() + " of " + std::to_string(std::llround(width)) + "x" +
                    std::to_string(std::llround(height)) + " px",
                "a smaller video");
  if (!read(*video_, *image_))
    throw Error(Failure::Input, "a video with frames", file.string() + ", of which no frame decodes",
                "copying it again");
  if (sensor.bit_depth > 8)
    throw Error(Failure::Input,
                "16-bit images (the sensor has " + std::to_string(sensor.bit_depth) + " bits)",
                file.string() + ", a video, which is decoded to 8 bits",
                "a folder of 16-bit images, or \"bit_depth\": 8 in the sensor file");
  rectifier_.emplace(sensor, *image_, file.string());
  packets_ = std::make_unique<cv::VideoCapture>();
  if (!packets_->open(file.string(), cv::CAP_FFMPEG) || !packets_->set(cv::CAP_PROP_FORMAT, -1))
    packets_.reset();
  const double rate = video_->get(cv::CAP_PROP_FPS), count = video_->get(cv::CAP_PROP_FRAME_COUNT);
  if (rate > 0 && rate < 1e6) rate_Hz_ = rate;
  if (count >= 1 && count < 1e12) announced_ = static_cast<uint64_t>(count);
}

VideoFile::~VideoFile() = default;

/// Looks at the packet of the frame that `next` is about to hand out. Throws where its size changed.
bool VideoFile::packet_is_whole() {
  cv::Mat packet;
  if (!packets_ || !read(*packets_, packet)) return true;
  const auto header = read_image_header({packet.data, packet.total() * packet.elemSize()});
  if (next_ == 0) {
    if (header) {
      packet_size_px_ = {header->width, header->height};
    } else {
      packets_.reset();  // another codec
    }
    return true;
  }
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
  if (ended_ || (next_ > 0 && !read(*video_, *image_)) || !packet_is_whole()) {
    ended_ = true;
    return false;
  }
  rectifier_->apply(*image_, file_.string() + " frame " + std::to_string(next_), frame);
  frame.sequence = next_;
  frame.time_ns = rate_Hz_ > 0 ? std::llround(static_cast<double>(next_) / rate_Hz_ * 1e9) : 0;
  ++next_;
  return true;
}

std::string VideoFile::warning() const {
  if (!ended_ || !announced_ || next_ >= *announced_) return {};
  return file_.string() + " announces " + std::to_string(*announced_) + " frames but only " +
         std::to_string(next_) + " could be read: it is damaged or cut short";
}

}  // namespace palpate
