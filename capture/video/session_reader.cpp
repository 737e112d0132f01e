extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <algorithm>
#include <climits>
#include <thread>
#include <vector>

#include "capture/video/packet.h"
#include "capture/video/parts.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

struct CloseInput {
  void operator()(AVFormatContext* input) const { avformat_close_input(&input); }
};

class Reader final : public SessionVideoReader {
 public:
  explicit Reader(const fs::path& file);
  const std::string& session_text() const override;
  void expect(const FrameFormat& format) override;
  Step step(FrameStamp& stamp) override;
  bool decode(Frame& frame) override;
  uint64_t indexed() override;
  bool seek(uint64_t index) override;
  Found scan() override;

 private:
  fs::path path_;
  std::unique_ptr<AVFormatContext, CloseInput> input_;
  const AVStream* stream_ = nullptr;
  CodecPtr codec_;
  PacketPtr packet_;
  FramePtr image_;
  FrameFormat format_;
  AVPixelFormat pixels_ = AV_PIX_FMT_NONE;
  std::string text_;
  std::vector<int64_t> ticks_;       ///< of every frame, once they are known
  int64_t target_tick_ = INT64_MIN;  ///< frames before are passed over
  PacketRecord record_;
  std::optional<uint64_t> last_;  ///< number of the frame before

  void open();
  void open_codec();
};

void Reader::open() {
  const auto refuse = [&](const std::string& why) {
    throw Error(Failure::Input, "frames of a session in '" + path_.string() + "'", why, "another session");
  };
  input_.reset();
  stream_ = nullptr;
  last_.reset();
  AVFormatContext* opened = nullptr;
  const int code = avformat_open_input(&opened, ("file:" + path_.string()).c_str(),
                                       av_find_input_format("matroska"), nullptr);
  if (code == AVERROR(EACCES)) refuse("no permission to read it");
  if (code < 0) refuse("none: it ends before its first frame, or its header is damaged");
  input_.reset(opened);
  for (unsigned i = 0; i < input_->nb_streams; ++i) {
    const AVStream* candidate = input_->streams[i];
    if (candidate->codecpar->codec_id == AV_CODEC_ID_FFV1 && !stream_) stream_ = candidate;
  }
  const AVDictionaryEntry* tag = av_dict_get(input_->metadata, kSessionTag, nullptr, 0);
  if (!tag || !stream_) refuse("a video that is no recorded session's");
  text_ = tag->value;
}

void Reader::open_codec() {
  const AVCodec* ffv1 = avcodec_find_decoder(AV_CODEC_ID_FFV1);
  codec_.reset(ffv1 ? avcodec_alloc_context3(ffv1) : nullptr);
  if (codec_) {
    codec_->thread_type = FF_THREAD_SLICE;  // threads by frames would hand them out late
    codec_->thread_count = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 4);
    codec_->err_recognition = AV_EF_CRCCHECK | AV_EF_EXPLODE;
  }
  if (!codec_ || avcodec_parameters_to_context(codec_.get(), stream_->codecpar) < 0 ||
      avcodec_open2(codec_.get(), ffv1, nullptr) < 0)
    throw Error(Failure::Input, "frames that libavcodec's FFV1 can decode",
                path_.string() + ", whose header it refuses", "another session; this one is damaged");
}

Reader::Reader(const fs::path& file) {
  silence_libav();
  path_ = file;
  packet_.reset(av_packet_alloc());
  image_.reset(av_frame_alloc());
  open();
}

const std::string& Reader::session_text() const {
  return text_;
}

void Reader::expect(const FrameFormat& format) {
  const AVCodecParameters& found = *stream_->codecpar;
  if (found.width != static_cast<int>(std::max(format.width, kLeastSide_px)) ||
      found.height != static_cast<int>(std::max(format.height, kLeastSide_px)))
    throw Error(
        Failure::Input,
        "frames of " + std::to_string(format.width) + "x" + std::to_string(format.height) +
            " px, as the session says",
        path_.string() + " of " + std::to_string(found.width) + "x" + std::to_string(found.height) + " px",
        "the frames.mkv that belongs to this session");
  format_ = format;
  pixels_ = pixel_format(format);
  open_codec();
}

Reader::Step Reader::step(FrameStamp& stamp) {
  while (true) {
    av_packet_unref(packet_.get());
    if (av_read_frame(input_.get(), packet_.get()) < 0) return Step::End;
    if (packet_->stream_index != stream_->index) continue;
    if (packet_->pts == AV_NOPTS_VALUE || packet_->pts < target_tick_) continue;
    target_tick_ = INT64_MIN;
    const std::optional<PacketRecord> found = find_record(*packet_);
    if (!found || (last_ && found->stamp.sequence <= *last_)) return Step::Damaged;
    last_ = found->stamp.sequence;
    record_ = *found;
    stamp = found->stamp;
    return Step::Frame;
  }
}

bool Reader::decode(Frame& frame) {
  if (avcodec_send_packet(codec_.get(), packet_.get()) < 0 ||
      avcodec_receive_frame(codec_.get(), image_.get()) < 0) {
    avcodec_flush_buffers(codec_.get());
    return false;
  }
  const AVFrame& image = *image_;
  bool fits = image.format == pixels_ && image.width == stream_->codecpar->width &&
              image.height == stream_->codecpar->height;
  if (fits) {
    frame.reshape(format_);
    take_pixels(image, frame);
    put_stamp(record_.stamp, frame);
    fits = crc_of(frame) == record_.pixels_crc;
  }
  av_frame_unref(image_.get());
  return fits;
}

uint64_t Reader::indexed() {
  if (ticks_.empty()) {
    // The index is at the file's end and is read by the first seek.
    if (av_seek_frame(input_.get(), stream_->index, 0, AVSEEK_FLAG_BACKWARD) < 0) open();
    const int count = avformat_index_get_entries_count(stream_);
    for (int i = 0; i < count; ++i)
      ticks_.push_back(avformat_index_get_entry(const_cast<AVStream*>(stream_), i)->timestamp);
  }
  return ticks_.size();
}

bool Reader::seek(uint64_t index) {
  if (index >= ticks_.size()) return false;
  target_tick_ = ticks_[index];
  last_.reset();
  if (av_seek_frame(input_.get(), stream_->index, target_tick_, AVSEEK_FLAG_BACKWARD) < 0) open();
  return true;
}

Reader::Found Reader::scan() {
  Found found;
  FrameStamp stamp;
  ticks_.clear();
  for (Step now = step(stamp); now != Step::End; now = step(stamp)) {
    ticks_.push_back(packet_->pts);
    if (now == Step::Frame) {
      ++found.frames;
      found.last_sequence = stamp.sequence;
    } else {
      ++found.damaged;
    }
  }
  open();
  return found;
}

}  // namespace

std::unique_ptr<SessionVideoReader> read_session_video(const fs::path& file) {
  return std::make_unique<Reader>(file);
}

}  // namespace palpate
