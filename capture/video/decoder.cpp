// Decoding and conversion as OpenCV's FFmpeg back end has them, so that recordings keep their pixels.
extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/display.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdarg>
#include <deque>
#include <thread>
#include <utility>
#include <vector>

#include "capture/video/film_input.h"
#include "capture/video/frame_numbers.h"
#include "capture/video/packet.h"
#include "capture/video/parts.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

constexpr int kMostFailures = 4096;        ///< of the decoder, once the file has ended
constexpr double kMostReordered_s = 2;     ///< by how much a frame is shown after one that is coded later
constexpr double kMostBelieved_Hz = 1000;  // of a stream without times
constexpr double kLongPauses = 3;          // times the longest pause between frames
constexpr double kSameRate = 0.02;         ///< relative difference of rates that a container rounds away

struct FreeScaler {
  void operator()(SwsContext* scaler) const { sws_freeContext(scaler); }
};

/// When a decoded frame is shown.
int64_t tick_of(const AVFrame& frame) {
  const int64_t tick = frame.pts != AV_NOPTS_VALUE ? frame.pts : frame.best_effort_timestamp;
  return tick == AV_NOPTS_VALUE ? FrameNumbers::kNoTick : tick;
}

/// Counts what decoders complain of, in the counter that their context refers to: some say so only there
/// (FFV1 at a wrong check sum).
void count_complaint(void* of, int level, const char* /*format*/, va_list /*values*/) {
  if (!of || level > AV_LOG_ERROR || *static_cast<const AVClass**>(of) != avcodec_get_class()) return;
  if (void* counter = static_cast<AVCodecContext*>(of)->opaque)
    ++*static_cast<std::atomic<uint64_t>*>(counter);
}

class Decoder final : public VideoDecoder {
 public:
  bool open(const fs::path& file);

  uint32_t width() const override { return on_its_side() ? height_px() : width_px(); }
  uint32_t height() const override { return on_its_side() ? width_px() : height_px(); }
  double rate_Hz() const override;
  double frame_count() const override;
  bool frames_are_counted() const override { return input_.stream().nb_frames > 0; }
  double missing_end_s() const override;
  std::vector<int64_t> times_ns() const override;
  bool grab() override;
  uint64_t index() const override { return index_; }
  int64_t time_ns() const override { return time_ns_; }
  FilmFaults faults() const override;
  bool seek(uint64_t index) override;
  std::optional<BgrView> picture() override;

 private:
  uint32_t width_px() const { return static_cast<uint32_t>(codec_->width); }
  uint32_t height_px() const { return static_cast<uint32_t>(codec_->height); }
  bool on_its_side() const { return turn_deg_ % 180 != 0; }
  void start_numbers();
  const Ticks& ticks() const;
  bool feed();
  bool send_next();
  bool take_next(bool& doubtful);
  bool seek_by_ticks(uint64_t index);
  bool restart();
  bool fit_scaler();
  BgrView upright(const BgrView& view);

  std::atomic<uint64_t> complaints_ = 0;
  FilmInput input_;
  CodecPtr codec_;
  PacketPtr packet_;
  FramePtr image_, bgr_;
  std::unique_ptr<SwsContext, FreeScaler> scaler_;
  int scaled_width_ = 0, scaled_height_ = 0, scaled_format_ = -1;
  int turn_deg_ = 0;  ///< clockwise
  fs::path file_;
  mutable std::optional<Ticks> ticks_;
  std::optional<FrameNumbers> numbers_;
  std::optional<RisingTimes> times_;
  std::deque<FramePtr> decoded_;  ///< as FrameNumbers counts them
  std::vector<FramePtr> spare_;
  bool draining_ = false, drained_ = false;
  int failures_at_end_ = 0;
  bool jumped_ = false;   ///< numbers follow from the frames' times
  bool ahead_ = false;    ///< `seek` has decoded the frame of the next `grab`
  bool started_ = false;  ///< some picture was taken
  uint64_t index_ = 0;
  int64_t time_ns_ = 0;
  std::vector<uint8_t> turned_;
};

bool Decoder::open(const fs::path& file) {
  file_ = file;
  av_log_set_callback(count_complaint);
  if (!input_.open(file)) return false;
  const AVCodecParameters& parameters = *input_.stream().codecpar;
  const AVCodec* decoder = avcodec_find_decoder(parameters.codec_id);
  codec_.reset(decoder ? avcodec_alloc_context3(decoder) : nullptr);
  if (!codec_ || avcodec_parameters_to_context(codec_.get(), &parameters) < 0) return false;
  codec_->thread_count = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  // Motion JPEG of cameras is often a little wrong all through; who reads it looks at its packets.
  if (parameters.codec_id != AV_CODEC_ID_MJPEG) {
    codec_->err_recognition |= AV_EF_CRCCHECK | AV_EF_BITSTREAM | AV_EF_BUFFER;
    // A thread for each frame would hand frames out before it is known what is wrong with them; H.264 forgets
    // with any.
    codec_->thread_type = FF_THREAD_SLICE;
    if (parameters.codec_id == AV_CODEC_ID_H264) codec_->thread_count = 1;
    if (is_intra_only(parameters.codec_id)) codec_->err_recognition |= AV_EF_EXPLODE;
    if (!reorders(parameters.codec_id)) codec_->opaque = &complaints_;
  }
  if (avcodec_open2(codec_.get(), decoder, nullptr) < 0) return false;
  packet_.reset(av_packet_alloc());
  image_.reset(av_frame_alloc());
  bgr_.reset(av_frame_alloc());
  if (const uint8_t* matrix = av_stream_get_side_data(&input_.stream(), AV_PKT_DATA_DISPLAYMATRIX, nullptr)) {
    turn_deg_ =
        static_cast<int>(std::lrint(av_display_rotation_get(reinterpret_cast<const int32_t*>(matrix))));
    if (turn_deg_ < 0) turn_deg_ += 360;
  }
  start_numbers();
  return true;
}

void Decoder::start_numbers() {
  const AVStream& stream = input_.stream();
  const AVCodecID codec = stream.codecpar->codec_id;
  const double tick_s = ratio(stream.time_base);
  numbers_.emplace(is_intra_only(codec),
                   reorders(codec) && tick_s > 0 ? static_cast<int64_t>(kMostReordered_s / tick_s) : 0);
  const double rate = ratio(stream.avg_frame_rate);
  times_.emplace(TickClock{tick_s, rate < kLeastRate_Hz ? 0 : 1 / rate});
  for (FramePtr& frame : decoded_) spare_.push_back(std::move(frame));
  decoded_.clear();
  draining_ = drained_ = jumped_ = ahead_ = started_ = false;
  failures_at_end_ = 0;
}

double Decoder::rate_Hz() const {
  const double stated = ratio(input_.stream().avg_frame_rate);
  const double rate = stated < kLeastRate_Hz ? 1 / ratio(codec_->time_base) : stated;
  if (frames_are_counted()) return rate;
  // Such containers state the rate of their first frames, or the finest that their clock could hold.
  const double mean = ticks().rate_Hz;
  if (mean <= 0 && rate > kMostBelieved_Hz) return 0;
  return mean > 0 && !(std::abs(mean - rate) < kSameRate * rate) ? mean : rate;
}

double Decoder::frame_count() const {
  if (frames_are_counted()) return static_cast<double>(input_.counted_frames());
  if (const uint64_t frames = ticks().frames) return static_cast<double>(frames);
  return std::floor(input_.duration_s() * rate_Hz() + 0.5);
}

double Decoder::missing_end_s() const {
  const Ticks& all = ticks();
  if (!input_.is_all() || all.rising.empty()) return 0;
  // Some containers count from 0 on, where their first frame may be later.
  const int64_t end = std::max(all.end, all.end - all.rising.front());
  const double tick_s = ratio(input_.stream().time_base);
  const double missing_s = input_.duration_s() - static_cast<double>(end) * tick_s;
  // Few say how long the last frame is shown.
  return missing_s > kLongPauses * static_cast<double>(all.longest) * tick_s ? missing_s : 0;
}

std::vector<int64_t> Decoder::times_ns() const {
  std::vector<int64_t> times;
  const double tick_ns = ratio(input_.stream().time_base) * 1e9;
  for (const int64_t tick : ticks().rising)
    times.push_back(std::llround(static_cast<double>(tick - ticks().rising.front()) * tick_ns));
  return times;
}

FilmFaults Decoder::faults() const {
  return {numbers_->left_out(), started_ ? index_ + 1 + numbers_->lost_at_end() : 0, times_->placed()};
}

bool Decoder::grab() {
  if (std::exchange(ahead_, false)) return true;
  bool doubtful = true;
  while (doubtful)
    if (!take_next(doubtful)) return false;
  return true;
}

/// The next picture that is shown, doubtful or not; false at the end.
bool Decoder::take_next(bool& doubtful) {
  while (!numbers_->ready() && feed()) {
  }
  if (numbers_->waiting() == 0) return false;
  spare_.push_back(std::exchange(image_, std::move(decoded_.front())));
  decoded_.pop_front();
  FrameNumbers::Numbered numbered = numbers_->take();
  if (jumped_) {
    const std::vector<int64_t>& rising = ticks().rising;
    const int64_t tick = tick_of(*image_);
    numbered.index = static_cast<uint64_t>(std::ranges::lower_bound(rising, tick) - rising.begin());
    numbered.tick = tick - rising.front();
  }
  index_ = numbered.index;
  started_ = true;
  time_ns_ = times_->next_ns(numbered.tick, index_);
  doubtful = numbered.doubtful;
  return true;
}

/// One step of the decoder; false once nothing more comes out.
bool Decoder::feed() {
  if (drained_) return false;
  FramePtr frame = spare_.empty() ? FramePtr(av_frame_alloc()) : std::move(spare_.back());
  if (!spare_.empty()) spare_.pop_back();
  const int code = avcodec_receive_frame(codec_.get(), frame.get());
  if (code >= 0) {
    const bool faulty = (frame->flags & AV_FRAME_FLAG_CORRUPT) || frame->decode_error_flags != 0 ||
                        complaints_.exchange(0) > 0;
    numbers_->shown(tick_of(*frame), frame->key_frame != 0, faulty);
    decoded_.push_back(std::move(frame));
    return true;
  }
  spare_.push_back(std::move(frame));
  if (code == AVERROR(EAGAIN) && send_next()) return true;
  if (code != AVERROR_EOF && code != AVERROR(EAGAIN)) {
    numbers_->failed();
    if (!draining_ || ++failures_at_end_ < kMostFailures) return true;
  }
  drained_ = true;
  numbers_->ended();
  return false;
}

/// False where the decoder takes nothing more.
bool Decoder::send_next() {
  if (draining_) return false;
  if (!input_.read_images(*packet_)) {
    // An empty packet asks for the frames that the decoder still holds.
    draining_ = true;
    return avcodec_send_packet(codec_.get(), nullptr) >= 0;
  }
  if (is_shown(*packet_, codec_->codec_id))
    numbers_->sent({.tick = packet_->pts == AV_NOPTS_VALUE ? FrameNumbers::kNoTick : packet_->pts,
                    .key = (packet_->flags & AV_PKT_FLAG_KEY) != 0,
                    .disposable = (packet_->flags & AV_PKT_FLAG_DISPOSABLE) != 0,
                    .faulty = (packet_->flags & AV_PKT_FLAG_CORRUPT) != 0});
  if (avcodec_send_packet(codec_.get(), packet_.get()) < 0) numbers_->failed();
  return true;
}

const Ticks& Decoder::ticks() const {
  if (!ticks_) ticks_ = read_ticks(file_);
  return *ticks_;
}

bool Decoder::restart() {
  input_ = {};
  scaler_.reset();  // its picture is made anew
  return open(fs::path(file_));
}

/// By way of the key frame before it; false where the container's index leads elsewhere.
bool Decoder::seek_by_ticks(uint64_t index) {
  if (!input_.seek(ticks().rising[index])) return false;
  avcodec_flush_buffers(codec_.get());
  start_numbers();
  jumped_ = true;
  bool doubtful = true;
  if (!take_next(doubtful) || index_ > index) return false;
  while (doubtful || index_ < index)
    if (!take_next(doubtful)) return false;
  return true;
}

bool Decoder::seek(uint64_t index) {
  const std::vector<int64_t>& rising = ticks().rising;
  if (!rising.empty() && index >= rising.size()) return false;
  ahead_ = !rising.empty() && index > 0 && seek_by_ticks(index);
  if (ahead_) return true;
  // Without times, or where the container's index leads elsewhere: from the start.
  if (!restart()) return false;
  do {
    if (!grab()) return false;
  } while (index_ < index);
  ahead_ = true;
  return true;
}

/// The whole coded picture, whose border the visible one may lack: the conversion looks at neighbours.
bool Decoder::fit_scaler() {
  if (scaler_ && scaled_width_ == codec_->width && scaled_height_ == codec_->height &&
      scaled_format_ == image_->format)
    return true;
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
  scaled_format_ = image_->format;
  return true;
}

std::optional<BgrView> Decoder::picture() {
  if (!image_->data[0] || !fit_scaler()) return std::nullopt;
  if (sws_scale(scaler_.get(), image_->data, image_->linesize, 0, codec_->coded_height, bgr_->data,
                bgr_->linesize) <= 0)
    return std::nullopt;
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
      if (!input_.read_images(*packet_)) return {};
    } while (packet_->flags & AV_PKT_FLAG_DISCARD);
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
  FilmInput input_;
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
