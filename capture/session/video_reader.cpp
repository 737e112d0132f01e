extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <algorithm>
#include <climits>
#include <thread>
#include <vector>

#include "capture/session/packet.h"
#include "capture/session/video.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

struct CloseInput {
  void operator()(AVFormatContext* input) const { avformat_close_input(&input); }
};

}  // namespace

struct SessionVideoReader::Impl {
  fs::path path;
  std::unique_ptr<AVFormatContext, CloseInput> input;
  const AVStream* stream = nullptr;
  CodecPtr codec;
  PacketPtr packet;
  FramePtr image;
  FrameFormat format;
  AVPixelFormat pixels = AV_PIX_FMT_NONE;
  std::string text;
  std::vector<int64_t> ticks;       ///< of every frame, once they are known
  int64_t target_tick = INT64_MIN;  ///< frames before are passed over
  PacketRecord record;
  std::optional<uint64_t> last;  ///< number of the frame before

  void open();
  void open_codec();
};

void SessionVideoReader::Impl::open() {
  const auto refuse = [&](const std::string& why) {
    throw Error(Failure::Input, "frames of a session in '" + path.string() + "'", why, "another session");
  };
  input.reset();
  stream = nullptr;
  last.reset();
  AVFormatContext* opened = nullptr;
  const int code = avformat_open_input(&opened, ("file:" + path.string()).c_str(),
                                       av_find_input_format("matroska"), nullptr);
  if (code == AVERROR(EACCES)) refuse("no permission to read it");
  if (code < 0) refuse("none: it ends before its first frame, or its head is damaged");
  input.reset(opened);
  for (unsigned i = 0; i < input->nb_streams; ++i) {
    const AVStream* candidate = input->streams[i];
    if (candidate->codecpar->codec_id == AV_CODEC_ID_FFV1 && !stream) stream = candidate;
  }
  const AVDictionaryEntry* tag = av_dict_get(input->metadata, kSessionTag, nullptr, 0);
  if (!tag || !stream) refuse("a video that is no recorded session's");
  text = tag->value;
}

void SessionVideoReader::Impl::open_codec() {
  const AVCodec* ffv1 = avcodec_find_decoder(AV_CODEC_ID_FFV1);
  codec.reset(ffv1 ? avcodec_alloc_context3(ffv1) : nullptr);
  if (codec) {
    codec->thread_type = FF_THREAD_SLICE;  // threads by frames would hand them out late
    codec->thread_count = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 4);
    codec->err_recognition = AV_EF_CRCCHECK | AV_EF_EXPLODE;
  }
  if (!codec || avcodec_parameters_to_context(codec.get(), stream->codecpar) < 0 ||
      avcodec_open2(codec.get(), ffv1, nullptr) < 0)
    throw Error(Failure::Input, "frames that libavcodec's FFV1 can decode",
                path.string() + ", whose head it refuses", "another session; this one is damaged");
}

SessionVideoReader::SessionVideoReader(const fs::path& file) : impl_(std::make_unique<Impl>()) {
  silence_libav();
  impl_->path = file;
  impl_->packet.reset(av_packet_alloc());
  impl_->image.reset(av_frame_alloc());
  impl_->open();
}

SessionVideoReader::~SessionVideoReader() = default;

const std::string& SessionVideoReader::session_text() const {
  return impl_->text;
}

void SessionVideoReader::expect(const FrameFormat& format) {
  Impl& m = *impl_;
  const AVCodecParameters& found = *m.stream->codecpar;
  if (found.width != static_cast<int>(std::max(format.width, kLeastSide_px)) ||
      found.height != static_cast<int>(std::max(format.height, kLeastSide_px)))
    throw Error(
        Failure::Input,
        "frames of " + std::to_string(format.width) + "x" + std::to_string(format.height) +
            " px, as the session says",
        m.path.string() + " of " + std::to_string(found.width) + "x" + std::to_string(found.height) + " px",
        "the frames.mkv that belongs to this session");
  m.format = format;
  m.pixels = pixel_format(format);
  m.open_codec();
}

SessionVideoReader::Step SessionVideoReader::step(FrameStamp& stamp) {
  Impl& m = *impl_;
  while (true) {
    av_packet_unref(m.packet.get());
    if (av_read_frame(m.input.get(), m.packet.get()) < 0) return Step::End;
    if (m.packet->stream_index != m.stream->index) continue;
    if (m.packet->pts == AV_NOPTS_VALUE || m.packet->pts < m.target_tick) continue;
    m.target_tick = INT64_MIN;
    const std::optional<PacketRecord> found = find_record(*m.packet);
    if (!found || (m.last && found->stamp.sequence <= *m.last)) return Step::Damaged;
    m.last = found->stamp.sequence;
    m.record = *found;
    stamp = found->stamp;
    return Step::Frame;
  }
}

bool SessionVideoReader::decode(Frame& frame) {
  Impl& m = *impl_;
  if (avcodec_send_packet(m.codec.get(), m.packet.get()) < 0 ||
      avcodec_receive_frame(m.codec.get(), m.image.get()) < 0) {
    avcodec_flush_buffers(m.codec.get());
    return false;
  }
  const AVFrame& image = *m.image;
  bool fits = image.format == m.pixels && image.width == m.stream->codecpar->width &&
              image.height == m.stream->codecpar->height;
  if (fits) {
    frame.reshape(m.format);
    take_pixels(image, frame);
    put_stamp(m.record.stamp, frame);
    fits = crc_of(frame) == m.record.pixels_crc;
  }
  av_frame_unref(m.image.get());
  return fits;
}

uint64_t SessionVideoReader::indexed() {
  Impl& m = *impl_;
  if (m.ticks.empty()) {
    // The index is at the file's end and is read by the first seek.
    if (av_seek_frame(m.input.get(), m.stream->index, 0, AVSEEK_FLAG_BACKWARD) < 0) m.open();
    const int count = avformat_index_get_entries_count(m.stream);
    for (int i = 0; i < count; ++i)
      m.ticks.push_back(avformat_index_get_entry(const_cast<AVStream*>(m.stream), i)->timestamp);
  }
  return m.ticks.size();
}

bool SessionVideoReader::seek(uint64_t index) {
  Impl& m = *impl_;
  if (index >= m.ticks.size()) return false;
  m.target_tick = m.ticks[index];
  m.last.reset();
  if (av_seek_frame(m.input.get(), m.stream->index, m.target_tick, AVSEEK_FLAG_BACKWARD) < 0) m.open();
  return true;
}

SessionVideoReader::Found SessionVideoReader::scan() {
  Impl& m = *impl_;
  Found found;
  FrameStamp stamp;
  m.ticks.clear();
  for (Step now = step(stamp); now != Step::End; now = step(stamp)) {
    m.ticks.push_back(m.packet->pts);
    if (now == Step::Frame) {
      ++found.frames;
      found.last_sequence = stamp.sequence;
    } else {
      ++found.damaged;
    }
  }
  m.open();
  return found;
}

}  // namespace palpate
