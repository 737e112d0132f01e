extern "C" {
#include <libavcodec/avcodec.h>
}

#include <algorithm>
#include <new>
#include <span>
#include <thread>
#include <vector>

#include "capture/video/packet.h"
#include "capture/video/parts.h"
#include "capture/video/session_file.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

class Reader final : public SessionVideoReader {
 public:
  explicit Reader(const fs::path& file);
  const std::string& session_text() const override;
  void expect(const FrameFormat& format) override;
  Step step(FrameStamp& stamp) override;
  bool decode(Frame& frame) override;
  uint64_t indexed() override;
  bool seek(uint64_t index) override;
  std::optional<uint64_t> place() const override;
  Found scan() override;

 private:
  fs::path path_;
  SessionFile file_;
  CodecPtr codec_;
  PacketPtr packet_;
  FramePtr image_;
  FrameFormat format_;
  std::vector<uint64_t> index_;   ///< where each frame's cluster begins, once that is known
  uint64_t at_ = 0;               ///< where the next `step` looks
  uint64_t damaged_ = 0;          ///< frames that the next steps report
  bool among_frames_ = false;     ///< what lies before at_ was a frame
  VideoBlock block_;              ///< of the last `step`
  std::optional<uint64_t> last_;  ///< number of the frame before

  bool open_codec(std::span<const uint8_t> parameters);
  void go_to(uint64_t begin, bool among_frames);
};

Reader::Reader(const fs::path& file)
    : path_(file), file_(file), packet_(av_packet_alloc()), image_(av_frame_alloc()) {
  silence_libav();
}

/// False where FFV1 refuses its parameters, which carry a check sum.
bool Reader::open_codec(std::span<const uint8_t> parameters) {
  const AVCodec* ffv1 = avcodec_find_decoder(AV_CODEC_ID_FFV1);
  codec_.reset(ffv1 ? avcodec_alloc_context3(ffv1) : nullptr);
  if (!codec_ || parameters.empty()) return false;
  codec_->width = static_cast<int>(std::max(format_.width, kLeastSide_px));
  codec_->height = static_cast<int>(std::max(format_.height, kLeastSide_px));
  codec_->extradata = static_cast<uint8_t*>(av_mallocz(parameters.size() + AV_INPUT_BUFFER_PADDING_SIZE));
  if (!codec_->extradata) throw std::bad_alloc();
  std::copy(parameters.begin(), parameters.end(), codec_->extradata);
  codec_->extradata_size = static_cast<int>(parameters.size());
  codec_->thread_type = FF_THREAD_SLICE;  // threads by frames would hand them out late
  codec_->thread_count = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 4);
  codec_->err_recognition = AV_EF_CRCCHECK | AV_EF_EXPLODE;
  return avcodec_open2(codec_.get(), ffv1, nullptr) >= 0;
}

const std::string& Reader::session_text() const {
  if (file_.head().text.empty())
    throw Error(Failure::Input, "the session's text in '" + path_.string() + "'", "a damaged one",
                "the session.json that was recorded with it");
  return file_.head().text;
}

void Reader::expect(const FrameFormat& format) {
  const VideoHead& head = file_.head();
  if (head.width > 0 && (head.width != std::max(format.width, kLeastSide_px) ||
                         head.height != std::max(format.height, kLeastSide_px)))
    throw Error(
        Failure::Input,
        "frames of " + std::to_string(format.width) + "x" + std::to_string(format.height) +
            " px, as the session says",
        path_.string() + " of " + std::to_string(head.width) + "x" + std::to_string(head.height) + " px",
        "the frames.mkv that belongs to this session");
  format_ = format;
  // Incompressible frames take less than four times their bytes.
  constexpr uint64_t kOther_bytes = 1 << 20;
  file_.limit_clusters(kOther_bytes + 4 * uint64_t{format.frame_bytes()});
  if (open_codec(head.codec_private)) return;
  // Every session of a format has the same parameters.
  int code = 0;
  const CodecPtr encoder = open_session_encoder(format, 0, code);
  if (!encoder || !open_codec({encoder->extradata, static_cast<size_t>(encoder->extradata_size)}))
    throw Error(Failure::Input, "frames that libavcodec's FFV1 can decode",
                path_.string() + ", whose header it refuses", "another session; this one is damaged");
}

void Reader::go_to(uint64_t begin, bool among_frames) {
  at_ = begin;
  damaged_ = 0;
  among_frames_ = among_frames;
  last_.reset();
}

Reader::Step Reader::step(FrameStamp& stamp) {
  if (damaged_ == 0 && !file_.read(at_, block_)) {
    const SessionFile::Gap gap = file_.pass_damage(at_);
    at_ = gap.next;
    // A gap between two frames was one, even where nothing of it is left.
    damaged_ = std::max<uint64_t>(gap.damaged, among_frames_ && gap.next < file_.bytes() ? 1 : 0);
    if (damaged_ == 0 && !file_.read(at_, block_)) return Step::End;
  }
  if (damaged_ > 0) {
    --damaged_;
    among_frames_ = false;
    return Step::Damaged;
  }
  at_ = block_.end;
  among_frames_ = true;
  const uint64_t sequence = block_.record.stamp.sequence;
  if (last_ && sequence <= *last_) return Step::Damaged;
  last_ = sequence;
  stamp = block_.record.stamp;
  return Step::Frame;
}

bool Reader::decode(Frame& frame) {
  // A packet of libav's own has the bytes behind it that its decoders look at.
  av_packet_unref(packet_.get());
  if (av_new_packet(packet_.get(), static_cast<int>(block_.data.size())) < 0) throw std::bad_alloc();
  std::copy(block_.data.begin(), block_.data.end(), packet_->data);
  if (avcodec_send_packet(codec_.get(), packet_.get()) < 0 ||
      avcodec_receive_frame(codec_.get(), image_.get()) < 0) {
    avcodec_flush_buffers(codec_.get());
    return false;
  }
  const AVFrame& image = *image_;
  bool fits = image.format == pixel_format(format_) &&
              image.width == static_cast<int>(std::max(format_.width, kLeastSide_px)) &&
              image.height == static_cast<int>(std::max(format_.height, kLeastSide_px));
  if (fits) {
    frame.reshape(format_);
    take_pixels(image, frame);
    put_stamp(block_.record.stamp, frame);
    fits = crc_of(frame) == block_.record.pixels_crc;
  }
  av_frame_unref(image_.get());
  return fits;
}

uint64_t Reader::indexed() {
  if (index_.empty()) index_ = file_.index();
  return index_.size();
}

bool Reader::seek(uint64_t index) {
  if (index >= index_.size()) return false;
  go_to(index_[index], true);
  return true;
}

std::optional<uint64_t> Reader::place() const {
  const auto found = std::ranges::lower_bound(index_, block_.begin);
  if (block_.end == 0 || found == index_.end()) return std::nullopt;
  return static_cast<uint64_t>(found - index_.begin());
}

Reader::Found Reader::scan() {
  Found found;
  FrameStamp stamp;
  index_.clear();
  for (Step now = step(stamp); now != Step::End; now = step(stamp)) {
    if (now == Step::Frame) {
      ++found.frames;
      found.last_sequence = stamp.sequence;
      index_.push_back(block_.begin);
    } else {
      ++found.damaged;
    }
  }
  go_to(0, false);
  return found;
}

}  // namespace

std::unique_ptr<SessionVideoReader> read_session_video(const fs::path& file) {
  return std::make_unique<Reader>(file);
}

}  // namespace palpate
