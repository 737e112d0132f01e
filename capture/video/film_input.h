// A film's file as libav opens it: the packets of its images, and what they say of the times of all frames.
#pragma once

extern "C" {
#include <libavformat/avformat.h>
}

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

namespace palpate {

inline constexpr double kLeastRate_Hz = 0.000025;

/// 0 where it is none.
double ratio(AVRational r);
/// Whether no picture refers to another.
bool is_intra_only(AVCodecID id);
/// Whether pictures may be shown in another order than they are coded in.
bool reorders(AVCodecID id);
/// Whether the packet's picture is shown; VP8 has some that others only refer to.
bool is_shown(const AVPacket& packet, AVCodecID codec);

/// A file and its first stream of images.
class FilmInput {
 public:
  /// False where there is none.
  bool open(const std::filesystem::path& file);
  const AVStream& stream() const { return *stream_; }
  /// To the key frame at or before `tick`, in the stream's time base.
  bool seek(int64_t tick);
  double duration_s() const;
  /// Whether the file holds nothing else.
  bool is_all() const { return input_->nb_streams == 1; }
  /// Frames by the container's table: less those that an edit list leaves out, and places without a frame.
  int64_t counted_frames() const;
  /// The next packet of the images' stream; false at the end. Without the empty ones that stand for a frame
  /// that was dropped.
  bool read_images(AVPacket& packet);

 private:
  struct Close {
    void operator()(AVFormatContext* input) const { avformat_close_input(&input); }
  };
  std::unique_ptr<AVFormatContext, Close> input_;
  AVStream* stream_ = nullptr;
};

/// Times of all frames, from the packets alone.
struct Ticks {
  std::vector<int64_t> rising;  ///< empty: not all frames have times, or they do not rise
  uint64_t frames = 0;
  double rate_Hz = 0;            ///< mean; 0: not known
  int64_t end = 0, longest = 0;  ///< of the last frame; from one frame to the next
};
/// Time stamps of the whole file; empty where it does not open.
Ticks read_ticks(const std::filesystem::path& file);

}  // namespace palpate
