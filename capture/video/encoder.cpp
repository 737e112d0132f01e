extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <climits>
#include <cmath>
#include <thread>
#include <utility>

#include "capture/video/packet.h"
#include "capture/video/parts.h"
#include "engine/base/readable.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

class Encoder final : public VideoEncoder {
 public:
  Encoder(const fs::path& file, const std::string& name, uint32_t width, uint32_t height, double rate_Hz);
  ~Encoder() override;
  void write(std::span<const uint8_t> rgb) override;
  void close() override;

 private:
  [[noreturn]] void fail(int code) const;
  int check(int code) const {
    if (code < 0) fail(code);
    return code;
  }
  void choose_quality(double rate_Hz);
  void open_codec(double rate_Hz);
  void drain();
  void release();

  fs::path file_;
  std::string name_;  ///< in errors
  int width_, height_;
  AVFormatContext* muxer_ = nullptr;
  AVStream* stream_ = nullptr;
  CodecPtr codec_;
  FramePtr image_;
  PacketPtr packet_;
  SwsContext* scaler_ = nullptr;
  bool head_written_ = false;
};

Encoder::Encoder(const fs::path& file, const std::string& name, uint32_t width, uint32_t height,
                 double rate_Hz)
    : file_(file), name_(name), width_(static_cast<int>(width)), height_(static_cast<int>(height)) {
  silence_libav();
  try {
    const std::string url = "file:" + file.string();
    check(avformat_alloc_output_context2(&muxer_, nullptr, nullptr, url.c_str()));
    open_codec(rate_Hz);
    check(avio_open(&muxer_->pb, url.c_str(), AVIO_FLAG_WRITE));
    // The index before the pictures: a browser plays before it has everything.
    AVDictionary* settings = nullptr;
    av_dict_set(&settings, "movflags", "+faststart", 0);
    const int written = avformat_write_header(muxer_, &settings);
    av_dict_free(&settings);
    check(written);
    head_written_ = true;
  } catch (const Error&) {
    release();
    throw Error(Failure::Output, "to write the film '" + name + "'", "it cannot be opened",
                "a writable folder and the ending .mp4 or .avi");
  }
}

Encoder::~Encoder() {
  release();
}

void Encoder::release() {
  sws_freeContext(std::exchange(scaler_, nullptr));
  if (!muxer_) return;
  if (muxer_->pb) avio_closep(&muxer_->pb);
  avformat_free_context(std::exchange(muxer_, nullptr));
}

void Encoder::fail(int code) const {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(code, text, sizeof text);
  throw Error(Failure::Output, "to write '" + name_ + "'", within_sentence(text),
              "freeing disk space, or another --out folder");
}

/// H.264, VP9 where its library is missing, MPEG-4 where that is missing too: which browsers do not play.
const AVCodec* film_codec() {
  for (const char* name : {"libx264", "libvpx-vp9"})
    if (const AVCodec* codec = avcodec_find_encoder_by_name(name)) return codec;
  return avcodec_find_encoder(AV_CODEC_ID_MPEG4);
}

void Encoder::choose_quality(double rate_Hz) {
  const auto set = [this](const char* key, const char* value) {
    check(av_opt_set(codec_->priv_data, key, value, 0));
  };
  switch (codec_->codec_id) {
    case AV_CODEC_ID_MJPEG:
      codec_->flags |= AV_CODEC_FLAG_QSCALE;
      codec_->global_quality = 2 * FF_QP2LAMBDA;  // JPEG's quality of about 95
      return;
    case AV_CODEC_ID_H264:
      set("preset", "veryfast");
      set("crf", "18");          // text and lines stay sharp
      codec_->max_b_frames = 0;  // the first picture is at time 0 in every player
      return;
    case AV_CODEC_ID_VP9:
      set("deadline", "good");
      set("cpu-used", "5");
      set("row-mt", "1");
      set("crf", "24");
      codec_->bit_rate = 0;
      return;
    default:
      // A bit a pixel.
      codec_->bit_rate =
          std::min<int64_t>(std::llround(rate_Hz * codec_->width * codec_->height), INT_MAX / 2);
  }
}

void Encoder::open_codec(double rate_Hz) {
  const bool avi = file_.extension() == ".avi";
  const AVCodec* encoder = avi ? avcodec_find_encoder(AV_CODEC_ID_MJPEG) : film_codec();
  codec_.reset(encoder ? avcodec_alloc_context3(encoder) : nullptr);
  if (!codec_) fail(AVERROR_ENCODER_NOT_FOUND);
  codec_->width = avi ? width_ : width_ & ~1;  // half as many colours as pixels
  codec_->height = avi ? height_ : height_ & ~1;
  codec_->framerate = av_d2q(rate_Hz, 65535);  // MPEG-4 counts time in 16 bits
  codec_->time_base = av_inv_q(codec_->framerate);
  codec_->thread_count = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  codec_->pix_fmt = avi ? AV_PIX_FMT_YUVJ420P : AV_PIX_FMT_YUV420P;
  // The matrix by which swscale converts RGB.
  codec_->colorspace = AVCOL_SPC_SMPTE170M;
  codec_->color_range = avi ? AVCOL_RANGE_JPEG : AVCOL_RANGE_MPEG;
  codec_->gop_size = 12;
  choose_quality(rate_Hz);
  if (muxer_->oformat->flags & AVFMT_GLOBALHEADER) codec_->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  check(avcodec_open2(codec_.get(), encoder, nullptr));
  stream_ = avformat_new_stream(muxer_, nullptr);
  if (!stream_) fail(AVERROR(ENOMEM));
  check(avcodec_parameters_from_context(stream_->codecpar, codec_.get()));
  stream_->time_base = codec_->time_base;
  stream_->avg_frame_rate = codec_->framerate;
  image_.reset(av_frame_alloc());
  packet_.reset(av_packet_alloc());
  image_->format = codec_->pix_fmt;
  image_->width = codec_->width;
  image_->height = codec_->height;
  image_->pts = -1;
  check(av_frame_get_buffer(image_.get(), 0));
  scaler_ = sws_getContext(codec_->width, codec_->height, AV_PIX_FMT_RGB24, codec_->width, codec_->height,
                           codec_->pix_fmt, SWS_BICUBIC, nullptr, nullptr, nullptr);
  if (!scaler_) fail(AVERROR(EINVAL));
}

/// Writes the finished packets of the encoder to the file.
void Encoder::drain() {
  while (true) {
    const int code = avcodec_receive_packet(codec_.get(), packet_.get());
    if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) return;
    check(code);
    av_packet_rescale_ts(packet_.get(), codec_->time_base, stream_->time_base);
    packet_->stream_index = stream_->index;
    packet_->duration = av_rescale_q(1, codec_->time_base, stream_->time_base);
    check(av_interleaved_write_frame(muxer_, packet_.get()));
  }
}

void Encoder::write(std::span<const uint8_t> rgb) {
  check(av_frame_make_writable(image_.get()));
  const uint8_t* rows[1] = {rgb.data()};
  const int row_bytes[1] = {3 * width_};
  sws_scale(scaler_, rows, row_bytes, 0, codec_->height, image_->data, image_->linesize);
  ++image_->pts;
  check(avcodec_send_frame(codec_.get(), image_.get()));
  drain();
}

void Encoder::close() {
  if (!head_written_) return;
  head_written_ = false;
  check(avcodec_send_frame(codec_.get(), nullptr));
  drain();
  check(av_write_trailer(muxer_));
  check(avio_closep(&muxer_->pb));
}

}  // namespace

std::unique_ptr<VideoEncoder> encode_video(const fs::path& file, const std::string& name, uint32_t width,
                                           uint32_t height, double rate_Hz) {
  return std::make_unique<Encoder>(file, name, width, height, rate_Hz);
}

}  // namespace palpate
