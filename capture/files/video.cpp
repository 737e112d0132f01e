#include "capture/files/video.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "capture/files/images/image_header.h"
#include "capture/files/images/jpeg.h"
#include "capture/video/module.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

constexpr int kPacketsLookedAt = 8;   ///< of a file, to learn its codec and its habits
constexpr uint64_t kMostMissing = 3;  ///< frames in a row; after more, nothing is followed across them
constexpr double kEndTolerance_s = 1, kEndTolerance = 0.05;

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
  look_at_packets();
  const double rate = video_->rate_Hz(), count = video_->frame_count();
  if (rate > 0 && rate < 1e6) rate_Hz_ = rate;
  if (count >= 1 && count < 1e12) announced_ = static_cast<uint64_t>(count);
}

VideoFile::~VideoFile() = default;

/// Motion JPEG, PNG or another codec, and how strictly the packets of this file can be judged.
void VideoFile::look_at_packets() {
  packets_ = video_module().packets(file_);
  int images = 0, whole = 0;
  for (int i = 0; packets_ && i < kPacketsLookedAt; ++i) {
    const std::span<const uint8_t> packet = packets_->next();
    const auto header = read_image_header(packet);
    if (!header) continue;
    if (images++ == 0) packet_size_px_ = {header->width, header->height};
    whole += header->kind == "JPEG" && jpeg_is_whole(packet);
  }
  if (images == 0) {
    packets_.reset();
    return;
  }
  strict_ = 2 * whole > images;
  packets_->seek(0);
}

/// Looks at the packet of the frame that the decoder stands at. Throws where its size changed.
bool VideoFile::packet_is_whole() {
  if (!packets_) return true;
  packets_->seek(video_->index());
  const std::span<const uint8_t> packet = packets_->next();
  if (packet.empty()) return true;
  const auto header = read_image_header(packet);
  if (!header) return false;
  if (std::array{header->width, header->height} != packet_size_px_) {
    const auto sides = [](uint64_t w, uint64_t h) {
      return std::to_string(w) + "x" + std::to_string(h) + " px";
    };
    throw Error(Failure::Input,
                "frames of one size, " + sides(packet_size_px_[0], packet_size_px_[1]) + " as the first",
                file_.string() + " frame " + std::to_string(video_->index()) + " of " +
                    sides(header->width, header->height),
                "recordings of one size each");
  }
  return header->whole && (!strict_ || header->kind != "JPEG" || jpeg_is_whole(packet));
}

/// The next whole frame, into image_.
bool VideoFile::grab() {
  bool stands = std::exchange(grabbed_, false);
  while (!ended_) {
    if (!stands && !video_->grab()) break;
    stands = false;
    const bool whole = packet_is_whole() && show(*video_, *image_);
    packets_damaged_ += !whole;
    damaged_ = packets_damaged_ + video_->faults().left_out;
    if (whole) return true;
  }
  ended_ = true;
  damaged_ = packets_damaged_ + video_->faults().left_out;
  return false;
}

bool VideoFile::next(Frame& frame) {
  if (!grab()) return false;
  const uint64_t index = video_->index();
  rectifier_->apply(*image_, file_.string() + " frame " + std::to_string(index), frame);
  frame.sequence = index;
  frame.time_ns = last_time_ns_ = video_->time_ns();
  frame.after_gap = std::exchange(jumped_, false) || index > next_ + kMostMissing;
  next_ = index + 1;
  return true;
}

bool VideoFile::seek(uint64_t index) {
  if (!video_->seek(index)) return false;
  next_ = index;
  grabbed_ = ended_ = false;
  jumped_ = true;
  return true;
}

std::optional<uint64_t> VideoFile::place() const {
  return next_ > 0 ? std::optional(next_ - 1) : std::nullopt;
}

std::vector<double> VideoFile::uneven_times_s() const {
  return uneven_times(video_->times_ns(), rate_Hz_);
}

bool VideoFile::cut_short() const {
  // One frame more or less is a matter of how a container counts.
  return ended_ && announced_ && video_->frames_are_counted() && video_->faults().seen + 1 < *announced_;
}

/// Part that the container states and the file lacks.
std::string VideoFile::end_missing() const {
  if (!ended_) return {};
  const uint64_t seen = video_->faults().seen;
  if (announced_ && video_->frames_are_counted())
    return seen >= *announced_ ? ""
                               : " announces " + std::to_string(*announced_) + " frames but only " +
                                     std::to_string(seen - std::min<uint64_t>(seen, damaged_)) +
                                     " could be read: it is damaged or cut short";
  const double missing_s = video_->missing_end_s();
  const double end_s = 1e-9 * static_cast<double>(last_time_ns_);
  if (missing_s < std::max(kEndTolerance_s, kEndTolerance * end_s)) return {};
  return text(" states %.1f s more than its frames last: it is damaged or cut short", missing_s);
}

std::string VideoFile::warning() const {
  std::string said = end_missing();
  const auto add = [&said](const std::string& words) { said += (said.empty() ? ": " : "; ") + words; };
  const auto frames = [](uint64_t count) {
    return std::to_string(count) + (count == 1 ? " frame" : " frames");
  };
  if (const uint64_t damaged = damaged_; damaged > 0)
    add(frames(damaged) + (damaged == 1 ? " does" : " do") +
        " not decode whole, or may refer to one that does not: left out");
  if (const uint64_t placed = video_->faults().placed; ended_ && placed > 0)
    add(frames(placed) + (placed == 1 ? " has a time stamp that does" : " have time stamps that do") +
        " not rise: placed one mean frame period after the frame before");
  return said.empty() ? "" : file_.string() + said;
}

}  // namespace palpate
