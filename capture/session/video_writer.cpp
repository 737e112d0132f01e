extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
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
#include <thread>

#include "capture/session/packet.h"
#include "capture/session/video.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

constexpr int kBuffer_bytes = 1 << 20;
constexpr int64_t kTick_per_s = 1000;  // Matroska's own

[[noreturn]] void fail(const fs::path& file, int code) {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(code, text, sizeof text);
  const char* remedy = "another folder for the session";
  if (code == AVERROR(ENOSPC) || code == AVERROR(EDQUOT)) remedy = "freeing disk space";
  if (code == AVERROR(EFBIG)) remedy = "a larger limit on file sizes (ulimit -f)";
  throw Error(Failure::Output, "to write '" + file.string() + "'", text, remedy);
}

}  // namespace

struct SessionVideoWriter::Impl {
  fs::path path;
  FrameFormat format;
  int file = -1;
  CodecPtr codec;
  AVFormatContext* muxer = nullptr;
  FramePtr image;
  PacketPtr packet;
  int64_t whole_bytes = 0;  ///< up to the end of the last whole frame
  bool begun = false;       ///< the head is on the disk
  bool failed = false;
  bool finished = false;
  int64_t first_time_ns = 0, last_time_ns = 0, last_tick = -1;
  int64_t nominal_ticks = 1;
  int64_t encoded = 0;

  ~Impl() {
    if (muxer) {
      if (muxer->pb) {
        av_freep(&muxer->pb->buffer);
        avio_context_free(&muxer->pb);
      }
      avformat_free_context(muxer);
    }
    if (file < 0) return;
    ::close(file);
    if (!begun) ::unlink(path.c_str());
  }

  static int put(void* self, uint8_t* bytes, int count) {
    const int file = static_cast<Impl*>(self)->file;
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
      return ::fstat(static_cast<Impl*>(self)->file, &found) == 0 ? found.st_size : AVERROR(errno);
    }
    const off_t at = ::lseek(static_cast<Impl*>(self)->file, offset, whence);
    return at < 0 ? AVERROR(errno) : at;
  }

  /// What was written of a frame in vain goes, so that the file ends with a whole one.
  [[noreturn]] void give_up(int code) {
    failed = true;
    if (::ftruncate(file, whole_bytes) == 0) ::lseek(file, whole_bytes, SEEK_SET);
    fail(path, code);
  }
  void check(int code) {
    if (code >= 0 && muxer && muxer->pb) {
      avio_flush(muxer->pb);
      code = muxer->pb->error;
    }
    if (code < 0) give_up(code);
  }

  void open_codec(double rate_Hz);
  void open_muxer(double rate_Hz, const std::string& session_text);
  int64_t tick(const Frame& frame);
  int encode(const Frame& frame);
};

void SessionVideoWriter::Impl::open_codec(double rate_Hz) {
  const AVCodec* ffv1 = avcodec_find_encoder(AV_CODEC_ID_FFV1);
  if (!ffv1)
    throw Error(Failure::Output, "libavcodec with FFV1, to record", "one without", "Debian's own libavcodec");
  codec.reset(avcodec_alloc_context3(ffv1));
  codec->width = static_cast<int>(std::max(format.width, kLeastSide_px));
  codec->height = static_cast<int>(std::max(format.height, kLeastSide_px));
  codec->pix_fmt = pixel_format(format);
  codec->time_base = {1, kTick_per_s};
  if (rate_Hz > 0) codec->framerate = av_d2q(rate_Hz, 1'000'000);
  codec->level = 3;
  codec->gop_size = 1;  // a damaged frame takes no other with it
  codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  // FFV1 wants four slices from there on; more only cost.
  const bool large = format.width > 352 || format.height > 288;
  constexpr uint32_t kSliced_px = 64;
  codec->slices = large || std::min(format.width, format.height) >= kSliced_px ? 4 : 1;
  constexpr size_t kOneThread_bytes = 600'000;
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  codec->thread_type = FF_THREAD_SLICE;
  codec->thread_count = format.frame_bytes() > kOneThread_bytes ? std::min(4, cores) : 1;
  av_opt_set_int(codec->priv_data, "coder", 0, 0);  // Golomb-Rice: half the time of range coding, as small
  av_opt_set_int(codec->priv_data, "context", 0, 0);
  av_opt_set_int(codec->priv_data, "slicecrc", 1, 0);
  if (const int code = avcodec_open2(codec.get(), ffv1, nullptr); code < 0) fail(path, code);
}

void SessionVideoWriter::Impl::open_muxer(double rate_Hz, const std::string& session_text) {
  check(avformat_alloc_output_context2(&muxer, nullptr, "matroska", nullptr));
  auto* buffer = static_cast<uint8_t*>(av_malloc(kBuffer_bytes));
  muxer->pb = avio_alloc_context(buffer, kBuffer_bytes, 1, this, nullptr, &Impl::put, &Impl::go);
  muxer->flags |= AVFMT_FLAG_CUSTOM_IO;
  AVStream* stream = avformat_new_stream(muxer, nullptr);
  if (!stream) check(AVERROR(ENOMEM));
  check(avcodec_parameters_from_context(stream->codecpar, codec.get()));
  stream->time_base = codec->time_base;
  if (rate_Hz > 0) stream->avg_frame_rate = codec->framerate;
  av_dict_set(&muxer->metadata, kSessionTag, session_text.c_str(), 0);
  check(avformat_write_header(muxer, nullptr));
  whole_bytes = avio_tell(muxer->pb);
}

/// Milliseconds from the first frame, rising also where the frames' own times do not.
int64_t SessionVideoWriter::Impl::tick(const Frame& frame) {
  if (last_tick < 0) {
    first_time_ns = frame.time_ns;
    last_tick = 0;
  } else if (frame.time_ns <= last_time_ns) {
    last_tick += nominal_ticks;
  } else {
    constexpr int64_t kTick_ns = 1'000'000;
    const int64_t wanted = (frame.time_ns / 2 - first_time_ns / 2) / (kTick_ns / 2);
    last_tick = std::max(last_tick + 1, wanted);
  }
  last_time_ns = frame.time_ns;
  return last_tick;
}

SessionVideoWriter::SessionVideoWriter(const fs::path& file, const FrameFormat& format, double rate_Hz,
                                       const std::string& session_text)
    : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  silence_libav();
  m.path = file;
  m.format = format;
  m.nominal_ticks = rate_Hz > 0 ? std::max<int64_t>(1, std::llround(kTick_per_s / rate_Hz)) : 100;
  m.open_codec(rate_Hz);
  m.image.reset(av_frame_alloc());
  m.packet.reset(av_packet_alloc());
  m.file = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (m.file < 0) fail(file, AVERROR(errno));
  m.open_muxer(rate_Hz, session_text);
  sync();
  m.begun = true;
}

SessionVideoWriter::~SessionVideoWriter() = default;

/// The frame as a packet of its own; 0 or libav's error.
int SessionVideoWriter::Impl::encode(const Frame& frame) {
  const bool as_it_is = format.channels == 1 && !is_tiny(format);
  image->format = codec->pix_fmt;
  image->width = codec->width;
  image->height = codec->height;
  if (!as_it_is) {
    int code = image->buf[0] ? 0 : av_frame_get_buffer(image.get(), 0);
    if (code >= 0) code = av_frame_make_writable(image.get());
    if (code < 0) return code;
    put_pixels(frame, *image);
  } else {
    // The encoder is done with the pixels when it has answered.
    auto* pixels = const_cast<uint8_t*>(frame.pixels());
    image->data[0] = pixels;
    image->linesize[0] = static_cast<int>(format.row_bytes());
    image->buf[0] = av_buffer_create(
        pixels, format.frame_bytes(), [](void*, uint8_t*) {}, nullptr, AV_BUFFER_FLAG_READONLY);
  }
  image->pts = ++encoded;
  int code = avcodec_send_frame(codec.get(), image.get());
  if (code >= 0) code = avcodec_receive_packet(codec.get(), packet.get());
  if (as_it_is) av_frame_unref(image.get());
  return code;
}

double SessionVideoWriter::rehearse() {
  Impl& m = *impl_;
  Frame noise;
  noise.reshape(m.format);
  std::minstd_rand random(1);
  for (uint32_t c = 0; c < m.format.channels; ++c)
    for (uint32_t y = 0; y < m.format.height; ++y)
      for (uint32_t x = 0; x < m.format.width; ++x)
        noise.set(c, x, y, static_cast<uint32_t>(random() >> 8) & m.format.max_gray());
  const auto begun = std::chrono::steady_clock::now();
  m.check(m.encode(noise));
  av_packet_unref(m.packet.get());
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

void SessionVideoWriter::write(const Frame& frame) {
  Impl& m = *impl_;
  m.check(m.encode(frame));
  AVPacket& packet = *m.packet;
  packet.pts = packet.dts = m.tick(frame);
  packet.duration = m.nominal_ticks;
  packet.flags |= AV_PKT_FLAG_KEY;
  const int marked = add_record(packet, frame);
  const int muxed = marked < 0 ? marked : av_write_frame(m.muxer, &packet);
  av_packet_unref(&packet);
  m.check(muxed);
  m.check(av_write_frame(m.muxer, nullptr));  // closes the cluster
  m.whole_bytes = avio_tell(m.muxer->pb);
}

void SessionVideoWriter::finish() {
  Impl& m = *impl_;
  if (m.failed || m.finished) return;
  m.finished = true;
  m.check(av_write_trailer(m.muxer));
  sync();
}

void SessionVideoWriter::sync() {
  if (::fdatasync(impl_->file) != 0 && errno != EINVAL && errno != EROFS) fail(impl_->path, AVERROR(errno));
}

uint64_t SessionVideoWriter::bytes() const {
  return static_cast<uint64_t>(impl_->finished && !impl_->failed ? avio_size(impl_->muxer->pb)
                                                                 : impl_->whole_bytes);
}

}  // namespace palpate
