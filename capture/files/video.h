// A video file as a recording, decoded by libav.
#pragma once

#include <array>
#include <atomic>
#include <filesystem>
#include <vector>

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
  /// Times are the film's own stamps, less the first frame's (VideoDecoder::time_ns); 0 where it has neither
  /// stamps nor a rate. Frames that do not decode whole are left out, and counted in counts().damaged; their
  /// numbers are too.
  bool next(Frame& frame) override;
  std::vector<double> uneven_times_s() const override;
  bool seek(uint64_t index) override;
  std::optional<uint64_t> place() const override;
  CaptureCounts counts() const override { return {.lost = 0, .damaged = damaged_, .gaps = 0}; }
  std::string warning() const override;
  bool cut_short() const override;

 private:
  void look_at_packets();
  bool grab();
  bool packet_is_whole();
  std::string end_missing() const;

  std::filesystem::path file_;
  std::unique_ptr<VideoDecoder> video_;
  /// The undecoded frames of Motion JPEG and PNG video: the decoder hides damaged ends and silently fits
  /// frames of another size into the first one's.
  std::unique_ptr<VideoPackets> packets_;
  std::array<uint64_t, 2> packet_size_px_{};
  bool strict_ = false;  ///< its JPEG packets decode without a guess, but for damaged ones
  std::unique_ptr<cv::Mat> image_;
  std::optional<Rectifier> rectifier_;
  std::optional<uint64_t> announced_;
  double rate_Hz_ = 0;
  uint64_t next_ = 0;
  int64_t last_time_ns_ = 0;
  uint64_t packets_damaged_ = 0;
  std::atomic<uint64_t> damaged_ = 0;
  bool grabbed_ = true;  ///< the decoder stands at the next frame
  bool jumped_ = false;
  bool ended_ = false;
};

}  // namespace palpate
