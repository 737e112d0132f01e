// Decoding and conversion as OpenCV's FFmpeg back end has them, so that recordings keep their pixels.
extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>
#include <vector>

#include "capture/video/packet.h"
#include "capture/video/parts.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

constexpr double kLeastRate_Hz = 0.000025;
constexpr int kMostFailures = 4096;  ///< packets in a row that give no frame

struct CloseInput {
  void operator()(AVFormatContext* input) const { avformat_close_input(&input); }
};
struct FreeScaler {
  void operator()(SwsContext* scaler) const { sws_freeContext(scaler); }
};

double ratio(AVRational r) {
  return r.num == 0 || r.den == 0 ? 0 : static_cast<double>(r.num) / r.den;
}

/// A file and its first stream of images.
class Input {
 public:
  /// False where there is none.
  bool open(const fs::path& file) {
    silence_libav();
    AVFormatContext* opened = nullptr;
    if (avformat_open_input(&opened, ("file:" + file.string()).c_str(), nullptr, nullptr) < 0) return false;
    input_.reset(opened);
    if (avformat_find_stream_info(opened, nullptr) < 0) return false;
    for (unsigned i = 0; i < opened->nb_streams && !stream_; ++i)
      if (opened->streams[i]->codecpar->codec_type == AVMEDIA_TYPE_VIDEO) stream_ = opened->streams[i];
    return stream_ != nullptr && stream_->codecpar->width > 0 && stream_->codecpar->height > 0;
  }
  const AVStream& stream() const { return *stream_; }
  /// To the key frame at or before `tick`, in the stream's time base.
  bool seek(int64_t tick) {
    return av_seek_frame(input_.get(), stream_->index, tick, AVSEEK_FLAG_BACKWARD) >= 0;
  }
  double duration_s() const {
    const double whole = static_cast<double>(input_->duration) / AV_TIME_BASE;
    return whole < kLeastRate_Hz ? static_cast<double>(stream_->duration) * ratio(stream_->time_base) : whole;
  }
  /// The next packet, of any stream; libav's error at the end.
  int read(AVPacket& packet) {
    int code = AVERROR(EAGAIN);
    while (code == AVERROR(EAGAIN)) code = av_read_frame(input_.get(), &packet);
    return code;
  }

 private:
  std::unique_ptr<AVFormatContext, CloseInput> input_;
  const AVStream* stream_ = nullptr;
};

class Decoder final : public VideoDecoder {
 public:
  bool open(const fs::path& file);

  uint32_t width() const override { return on_its_side() ? height_px() : width_px(); }
  uint32_t height() const override { return on_its_side() ? width_px() : height_px(); }
  double rate_Hz() const override;
  double frame_count() const override;
  bool frames_are_counted() const override { return input_.stream().nb_frames > 0; }
  bool grab() override;
  bool seek(uint64_t index) override;
  std::optional<BgrView> picture() override;

 private:
  uint32_t width_px() const { return static_cast<uint32_t>(codec_->width); }
  uint32_t height_px() const { return static_cast<uint32_t>(codec_->height); }
  bool on_its_side() const { return turn_deg_ % 180 != 0; }
  bool read_ticks();
  bool restart();
  bool fit_scaler();
  BgrView upright(const BgrView& view);

  Input input_;
  CodecPtr codec_;
  PacketPtr packet_;
  FramePtr image_, bgr_;
  std::unique_ptr<SwsContext, FreeScaler> scaler_;
  int scaled_width_ = 0, scaled_height_ = 0;
  int turn_deg_ = 0;  ///< clockwise
  fs::path file_;
  std::optional<std::vector<int64_t>> ticks_;  ///< of the frames, rising; empty: they have none
  bool ahead_ = false;                         ///< `seek` has decoded the frame of the next `grab`
  int64_t grabbed_ = 0;
  std::vector<uint8_t> turned_;
};

bool Decoder::open(const fs::path& file) {
  file_ = file;
  if (!input_.open(file)) return false;
  const AVCodecParameters& parameters = *input_.stream().codecpar;
  const AVCodec* decoder = avcodec_find_decoder(parameters.codec_id);
  codec_.reset(decoder ? avcodec_alloc_context3(decoder) : nullptr);
  if (!codec_ || avcodec_parameters_to_context(codec_.get(), &parameters) < 0) return false;
  codec_->thread_count = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  if (avcodec_open2(codec_.get(), decoder, nullptr) < 0) return false;
  packet_.reset(av_packet_alloc());
  image_.reset(av_frame_alloc());
  bgr_.reset(av_frame_alloc());
  if (const uint8_t* matrix = av_stream_get_side_data(&input_.stream(), AV_PKT_DATA_DISPLAYMATRIX, nullptr)) {
    turn_deg_ =
        static_cast<int>(std::lrint(av_display_rotation_get(reinterpret_cast<const int32_t*>(matrix))));
    if (turn_deg_ < 0) turn_deg_ += 360;
  }
  return true;
}

double Decoder::rate_Hz() const {
  const double rate = ratio(input_.stream().avg_frame_rate);
  return rate < kLeastRate_Hz ? 1 / ratio(codec_->time_base) : rate;
}

double Decoder::frame_count() const {
  const int64_t stated = input_.stream().nb_frames;
  return stated != 0 ? static_cast<double>(stated) : std::floor(input_.duration_s() * rate_Hz() + 0.5);
}

bool Decoder::grab() {
  if (std::exchange(ahead_, false)) return true;
  const AVStream& stream = input_.stream();
  if (stream.nb_frames > 0 && grabbed_ > stream.nb_frames) return false;
  int failures = 0;
  bool valid = avcodec_receive_frame(codec_.get(), image_.get()) >= 0;
  while (!valid) {
    av_packet_unref(packet_.get());
    const bool ended = input_.read(*packet_) < 0;
    if (!ended && packet_->stream_index != stream.index) {
      if (++failures > kMostFailures) return false;
      continue;
    }
    // An empty packet asks for the frames that the decoder still holds.
    if (avcodec_send_packet(codec_.get(), ended ? nullptr : packet_.get()) < 0) return false;
    const int code = avcodec_receive_frame(codec_.get(), image_.get());
    valid = code >= 0;
    if (!valid && code != AVERROR(EAGAIN) && ++failures > kMostFailures) return false;
  }
  ++grabbed_;
  return true;
}

/// Times of all frames, from the packets alone.
bool Decoder::read_ticks() {
  if (ticks_) return !ticks_->empty();
  ticks_.emplace();
  Input packets;
  if (!packets.open(file_)) return false;
  const PacketPtr packet(av_packet_alloc());
  for (; packets.read(*packet) >= 0; av_packet_unref(packet.get())) {
    if (packet->stream_index != packets.stream().index || (packet->flags & AV_PKT_FLAG_DISCARD)) continue;
    if (packet->pts == AV_NOPTS_VALUE) {
      ticks_->clear();
      return false;
    }
    ticks_->push_back(packet->pts);
  }
  std::sort(ticks_->begin(), ticks_->end());
  if (std::adjacent_find(ticks_->begin(), ticks_->end()) != ticks_->end()) ticks_->clear();
  return !ticks_->empty();
}

bool Decoder::restart() {
  input_ = {};
  scaler_.reset();  // its picture is made anew
  if (!open(fs::path(file_))) return false;
  grabbed_ = 0;
  ahead_ = false;
  return true;
}

bool Decoder::seek(uint64_t index) {
  const bool timed = read_ticks();
  if (timed && index >= ticks_->size()) return false;
  if (timed && index > 0) {
    const int64_t wanted = (*ticks_)[index];
    if (input_.seek(wanted)) {
      avcodec_flush_buffers(codec_.get());
      ahead_ = false;
      grabbed_ = 0;
      while (grab())
        if (const int64_t tick = image_->best_effort_timestamp; tick >= wanted) {
          grabbed_ = static_cast<int64_t>(index) + 1;
          ahead_ = tick == wanted;
          break;
        }
      if (ahead_) return true;
    }
  }
  // Without times, or where the container's index leads elsewhere: from the start.
  if (!restart()) return false;
  for (uint64_t i = 0; i <= index; ++i)
    if (!grab()) return false;
  ahead_ = true;
  return true;
}

/// The whole coded picture, whose border the visible one may lack: the conversion looks at neighbours.
bool Decoder::fit_scaler() {
  if (scaler_ && scaled_width_ == codec_->width && scaled_height_ == codec_->height) return true;
  const int width = codec_->coded_width, height = codec_->coded_height;
  scaler_.reset(sws_getCachedContext(scaler_.release(), width, height,
                                     static_cast<AVPixelFormat>(image_->format), width, height,
                                     AV_PIX_FMT_BGR24, SWS_BICUBIC, nullptr, nullptr, nullptr));
  if (!scaler_) return false;
  av_frame_unref(bgr_.get());
  bgr_->format = AV_PIX_FMT_BGR24;
  bgr_->width = width;
  bgr_->height = height;
  if (av_frame_get_buffer(bgr_.get(), 0) < 0) return false;
  scaled_width_ = codec_->width;
  scaled_height_ = codec_->height;
  return true;
}

std::optional<BgrView> Decoder::picture() {
  if (!image_->data[0] || !fit_scaler()) return std::nullopt;
  sws_scale(scaler_.get(), image_->data, image_->linesize, 0, codec_->coded_height, bgr_->data,
            bgr_->linesize);
  return upright({bgr_->data[0], width_px(), height_px(), static_cast<size_t>(bgr_->linesize[0])});
}

BgrView Decoder::upright(const BgrView& from) {
  if (turn_deg_ != 90 && turn_deg_ != 180 && turn_deg_ != 270) return from;
  const BgrView to{nullptr, width(), height(), size_t{width()} * 3};
  turned_.resize(to.row_bytes * to.height);
  for (uint32_t y = 0; y < from.height; ++y)
    for (uint32_t x = 0; x < from.width; ++x) {
      const uint32_t right = from.width - 1 - x, below = from.height - 1 - y;
      const uint32_t to_x = turn_deg_ == 90 ? below : turn_deg_ == 180 ? right : y;
      const uint32_t to_y = turn_deg_ == 90 ? x : turn_deg_ == 180 ? below : right;
      std::copy_n(from.pixels + y * from.row_bytes + size_t{x} * 3, 3,
                  turned_.data() + to_y * to.row_bytes + size_t{to_x} * 3);
    }
  return {turned_.data(), to.width, to.height, to.row_bytes};
}

class Packets final : public VideoPackets {
 public:
  bool open(const fs::path& file) { return input_.open(file); }

  std::span<const uint8_t> next() override {
    do {
      av_packet_unref(packet_.get());
      if (input_.read(*packet_) < 0) return {};
    } while (packet_->stream_index != input_.stream().index);
    ++next_;
    return {packet_->data, static_cast<size_t>(packet_->size)};
  }
  void seek(uint64_t index) override {
    if (index < next_) {
      if (!input_.seek(0)) return;
      next_ = 0;
    }
    while (next_ < index && !next().empty()) {
    }
  }

 private:
  Input input_;
  uint64_t next_ = 0;
  PacketPtr packet_{av_packet_alloc()};
};

}  // namespace

std::unique_ptr<VideoDecoder> decode_video(const fs::path& file) {
  auto decoder = std::make_unique<Decoder>();
  if (!decoder->open(file)) return nullptr;
  return decoder;
}

std::unique_ptr<VideoPackets> read_video_packets(const fs::path& file) {
  auto packets = std::make_unique<Packets>();
  if (!packets->open(file)) return nullptr;
  return packets;
}

}  // namespace palpate
