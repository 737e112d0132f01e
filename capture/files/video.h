// A video file as a recording, decoded by libav.
#pragma once

#include <array>
#include <filesystem>

#include "capture/rectify.h"
#include "capture/source.h"

namespace palpate {

class VideoDecoder;
class VideoPackets;

class VideoFile : public Source {
 public:
  /// Decodes the first frame. Throws Error(Failure::Input) where there is none, the file is no video, or the
  /// sensor does not fit; for sensors of more than 8 bits, since the decoder hands out 8.
  VideoFile(const std::filesystem::path& file, const Sensor& sensor);
  ~VideoFile() override;

  FrameFormat format() const override { return rectifier_->format(); }
  double rate_Hz() const override { return rate_Hz_; }
  /// Number that the container announces; fewer may decode, see `warning`.
  std::optional<uint64_t> frame_count() const override { return announced_; }
  /// Times are sequence / rate, or 0 where the container states no rate.
  bool next(Frame& frame) override;
  bool seek(uint64_t index) override;
  std::string warning() const override;
  bool cut_short() const override;

 private:
  bool packet_is_whole();

  std::filesystem::path file_;
  std::unique_ptr<VideoDecoder> video_;
  /// The undecoded frames of Motion JPEG and PNG video: the decoder hides damaged ends and silently fits
  /// frames of another size into the first one's.
  std::unique_ptr<VideoPackets> packets_;
  std::array<uint64_t, 2> packet_size_px_{};
  std::unique_ptr<cv::Mat> image_;
  std::optional<Rectifier> rectifier_;
  std::optional<uint64_t> announced_;
  double rate_Hz_ = 0;
  uint64_t next_ = 0;
  bool grabbed_ = true;  ///< the decoder stands at frame `next_`
  bool jumped_ = false;
  bool ended_ = false;
};

}  // namespace palpate
