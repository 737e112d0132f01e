extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "capture/video/packet.h"
#include "capture/video/parts.h"
#include "capture/video/session_file.h"
#include "engine/base/readable.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

constexpr int kBuffer_bytes = 1 << 20;

[[noreturn]] void fail(const fs::path& file, int code) {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(code, text, sizeof text);
  const char* remedy = "another folder for the session";
  if (code == AVERROR(ENOSPC) || code == AVERROR(EDQUOT)) remedy = "freeing disk space";
  if (code == AVERROR(EFBIG)) remedy = "a larger limit on file sizes (ulimit -f)";
  throw Error(Failure::Output, "to write '" + file.string() + "'", within_sentence(text), remedy);
}

class Writer final : public SessionVideoWriter {
 public:
  // Delegated to, so that the destructor runs where the other constructor throws.
  Writer() = default;
  Writer(const fs::path& file, const FrameFormat& format, double rate_Hz, const std::string& session_text);
  ~Writer() override {
    if (muxer_) {
      if (muxer_->pb) {
        av_freep(&muxer_->pb->buffer);
        avio_context_free(&muxer_->pb);
      }
      avformat_free_context(muxer_);
    }
    if (file_ < 0) return;
    ::close(file_);
    if (!begun_) ::unlink(path_.c_str());
  }
  double rehearse() override;
  void write(const Frame& frame) override;
  void finish() override;
  void sync() override;
  uint64_t bytes() const override;

 private:
  fs::path path_;
  FrameFormat format_;
  int file_ = -1;
  CodecPtr codec_;
  AVFormatContext* muxer_ = nullptr;
  FramePtr image_;
  PacketPtr packet_;
  int64_t whole_bytes_ = 0;  ///< up to the end of the last whole frame
  bool begun_ = false;       ///< the head is on the disk
  bool failed_ = false;
  bool finished_ = false;
  int64_t first_time_ns_ = 0, last_time_ns_ = 0, last_tick_ = -1;
  int64_t nominal_ticks_ = 1;
  int64_t encoded_ = 0;

  static int put(void* self, uint8_t* bytes, int count) {
    const int file = static_cast<Writer*>(self)->file_;
    for (int done = 0; done < count;) {
      const ssize_t n = ::write(file, bytes + done, static_cast<size_t>(count - done));
      if (n < 0 && errno != EINTR) return AVERROR(errno);
      if (n > 0) done += static_cast<int>(n);
    }
    return count;
  }
  static int64_t go(void* self, int64_t offset, int whence) {
    if (whence & AVSEEK_SIZE) {
      struct stat found {};
      return ::fstat(static_cast<Writer*>(self)->file_, &found) == 0 ? found.st_size : AVERROR(errno);
    }
    const off_t at = ::lseek(static_cast<Writer*>(self)->file_, offset, whence);
    return at < 0 ? AVERROR(errno) : at;
  }

  /// Removes a partly written frame, so that the file ends with a whole one.
  [[noreturn]] void give_up(int code) {
    failed_ = true;
    if (::ftruncate(file_, whole_bytes_) == 0) ::lseek(file_, whole_bytes_, SEEK_SET);
    fail(path_, code);
  }
  void check(int code) {
    if (code >= 0 && muxer_ && muxer_->pb) {
      avio_flush(muxer_->pb);
      code = muxer_->pb->error;
    }
    if (code < 0) give_up(code);
  }

  void open_codec(double rate_Hz);
  void open_muxer(double rate_Hz, const std::string& session_text);
  int64_t tick(const Frame& frame);
  int encode(const Frame& frame);
};

void Writer::open_codec(double rate_Hz) {
  int code = 0;
  codec_ = open_session_encoder(format_, rate_Hz, code);
  if (code == AVERROR_ENCODER_NOT_FOUND)
    throw Error(Failure::Output, "libavcodec with FFV1, to record", "one without", "Debian's own libavcodec");
  if (!codec_) fail(path_, code);
}

void Writer::open_muxer(double rate_Hz, const std::string& session_text) {
  check(avformat_alloc_output_context2(&muxer_, nullptr, "matroska", nullptr));
  auto* buffer = static_cast<uint8_t*>(av_malloc(kBuffer_bytes));
  muxer_->pb = avio_alloc_context(buffer, kBuffer_bytes, 1, this, nullptr, &Writer::put, &Writer::go);
  muxer_->flags |= AVFMT_FLAG_CUSTOM_IO;
  AVStream* stream = avformat_new_stream(muxer_, nullptr);
  if (!stream) check(AVERROR(ENOMEM));
  check(avcodec_parameters_from_context(stream->codecpar, codec_.get()));
  stream->time_base = codec_->time_base;
  if (rate_Hz > 0) stream->avg_frame_rate = codec_->framerate;
  av_dict_set(&muxer_->metadata, kSessionTag, session_text.c_str(), 0);
  check(avformat_write_header(muxer_, nullptr));
  const std::vector<uint8_t> spare = spare_head(
      {.text = session_text,
       .width = static_cast<uint32_t>(codec_->width),
       .height = static_cast<uint32_t>(codec_->height),
       .codec_private = {codec_->extradata, codec_->extradata + std::max(0, codec_->extradata_size)}});
  avio_write(muxer_->pb, spare.data(), static_cast<int>(spare.size()));
  check(0);
  whole_bytes_ = avio_tell(muxer_->pb);
}

/// Milliseconds from the first frame, rising also where the frames' own times do not.
int64_t Writer::tick(const Frame& frame) {
  if (last_tick_ < 0) {
    first_time_ns_ = frame.time_ns;
    last_tick_ = 0;
  } else if (frame.time_ns <= last_time_ns_) {
    last_tick_ += nominal_ticks_;
  } else {
    constexpr int64_t kTick_ns = 1'000'000;
    const int64_t wanted = (frame.time_ns / 2 - first_time_ns_ / 2) / (kTick_ns / 2);
    last_tick_ = std::max(last_tick_ + 1, wanted);
  }
  last_time_ns_ = frame.time_ns;
  return last_tick_;
}

Writer::Writer(const fs::path& file, const FrameFormat& format, double rate_Hz,
               const std::string& session_text)
    : Writer() {
  silence_libav();
  path_ = file;
  format_ = format;
  nominal_ticks_ = rate_Hz > 0 ? std::max<int64_t>(1, std::llround(kTick_per_s / rate_Hz)) : 100;
  open_codec(rate_Hz);
  image_.reset(av_frame_alloc());
  packet_.reset(av_packet_alloc());
  file_ = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file_ < 0) fail(path_, AVERROR(errno));
  open_muxer(rate_Hz, session_text);
  sync();
  begun_ = true;
}

/// The frame as a packet of its own; 0 or libav's error.
int Writer::encode(const Frame& frame) {
  const bool as_it_is = format_.channels == 1 && !is_tiny(format_);
  image_->format = codec_->pix_fmt;
  image_->width = codec_->width;
  image_->height = codec_->height;
  if (!as_it_is) {
    int code = image_->buf[0] ? 0 : av_frame_get_buffer(image_.get(), 0);
    if (code >= 0) code = av_frame_make_writable(image_.get());
    if (code < 0) return code;
    put_pixels(frame, *image_);
  } else {
    // The encoder is done with the pixels when it has answered.
    auto* pixels = const_cast<uint8_t*>(frame.pixels());
    image_->data[0] = pixels;
    image_->linesize[0] = static_cast<int>(format_.row_bytes());
    image_->buf[0] = av_buffer_create(
        pixels, format_.frame_bytes(), [](void*, uint8_t*) {}, nullptr, AV_BUFFER_FLAG_READONLY);
  }
  image_->pts = ++encoded_;
  int code = avcodec_send_frame(codec_.get(), image_.get());
  if (code >= 0) code = avcodec_receive_packet(codec_.get(), packet_.get());
  if (as_it_is) av_frame_unref(image_.get());
  return code;
}

double Writer::rehearse() {
  Frame noise;
  noise.reshape(format_);
  std::minstd_rand random(1);
  for (uint32_t c = 0; c < format_.channels; ++c)
    for (uint32_t y = 0; y < format_.height; ++y)
      for (uint32_t x = 0; x < format_.width; ++x)
        noise.set(c, x, y, static_cast<uint32_t>(random() >> 8) & format_.max_gray());
  const auto begun = std::chrono::steady_clock::now();
  check(encode(noise));
  av_packet_unref(packet_.get());
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

void Writer::write(const Frame& frame) {
  check(encode(frame));
  AVPacket& packet = *packet_;
  packet.pts = packet.dts = tick(frame);
  packet.duration = nominal_ticks_;
  packet.flags |= AV_PKT_FLAG_KEY;
  const int marked = add_record(packet, frame);
  const int muxed = marked < 0 ? marked : av_write_frame(muxer_, &packet);
  av_packet_unref(&packet);
  check(muxed);
  check(av_write_frame(muxer_, nullptr));  // closes the cluster
  whole_bytes_ = avio_tell(muxer_->pb);
}

void Writer::finish() {
  if (failed_ || finished_) return;
  finished_ = true;
  check(av_write_trailer(muxer_));
  sync();
}

void Writer::sync() {
  if (::fdatasync(file_) != 0 && errno != EINVAL && errno != EROFS) fail(path_, AVERROR(errno));
}

uint64_t Writer::bytes() const {
  return static_cast<uint64_t>(finished_ && !failed_ ? avio_size(muxer_->pb) : whole_bytes_);
}

}  // namespace

std::unique_ptr<SessionVideoWriter> write_session_video(const fs::path& file, const FrameFormat& format,
                                                        double rate_Hz, const std::string& session_text) {
  return std::make_unique<Writer>(file, format, rate_Hz, session_text);
}

}  // namespace palpate
