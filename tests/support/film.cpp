#include "tests/support/film.h"

extern "C" {
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
}

#include <memory>
#include <stdexcept>

#include "capture/video/packet.h"

namespace palpate {
namespace {

constexpr uint32_t kFields = 8;  ///< side by side, a bit each

void check(int code, const char* what) {
  if (code < 0) throw std::runtime_error(std::string("film for a test: ") + what);
}

struct CloseMuxer {
  void operator()(AVFormatContext* muxer) const {
    if (muxer->pb) avio_closep(&muxer->pb);
    avformat_free_context(muxer);
  }
};
struct CloseInput {
  void operator()(AVFormatContext* input) const { avformat_close_input(&input); }
};
using MuxerPtr = std::unique_ptr<AVFormatContext, CloseMuxer>;

MuxerPtr open_muxer(const std::filesystem::path& file, const std::string& format) {
  AVFormatContext* muxer = nullptr;
  check(avformat_alloc_output_context2(&muxer, nullptr, format.empty() ? nullptr : format.c_str(),
                                       file.c_str()),
        "no such container");
  MuxerPtr opened(muxer);
  check(avio_open(&muxer->pb, file.c_str(), AVIO_FLAG_WRITE), "the file cannot be written");
  return opened;
}

/// Bits of the frame's number over a slope and some noise that does not move.
uint8_t gray_of(uint32_t frame, uint32_t x, uint32_t y, uint32_t width) {
  const bool bright = (frame >> (x * kFields / width)) & 1;
  const uint32_t noise = (x * 7919u + y * 104729u) % 13u;
  return static_cast<uint8_t>((bright ? 160 : 60) + y / 8 + noise);
}

void paint(AVFrame& image, uint32_t frame) {
  const auto width = static_cast<uint32_t>(image.width), height = static_cast<uint32_t>(image.height);
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x)
      image.data[0][y * static_cast<uint32_t>(image.linesize[0]) + x] = gray_of(frame, x, y, width);
  for (int plane = 1; plane < 3 && image.data[plane]; ++plane)
    for (uint32_t y = 0; y < height / 2; ++y)
      for (uint32_t x = 0; x < width / 2; ++x)
        image.data[plane][y * static_cast<uint32_t>(image.linesize[plane]) + x] = 128;
}

}  // namespace

void write_film(const std::filesystem::path& file, const FilmSetting& setting) {
  const MuxerPtr muxer = open_muxer(file, setting.format);
  const AVCodec* encoder = avcodec_find_encoder_by_name(setting.codec.c_str());
  if (!encoder) throw std::runtime_error("film for a test: no encoder " + setting.codec);
  const CodecPtr codec(avcodec_alloc_context3(encoder));
  codec->width = static_cast<int>(setting.width);
  codec->height = static_cast<int>(setting.height);
  codec->time_base = {1, setting.time_base_per_s};
  codec->pix_fmt = encoder->pix_fmts ? encoder->pix_fmts[0] : AV_PIX_FMT_YUV420P;
  for (const AVPixelFormat* known = encoder->pix_fmts; known && *known != AV_PIX_FMT_NONE; ++known)
    if (*known == AV_PIX_FMT_GRAY8 || *known == AV_PIX_FMT_YUVJ420P) codec->pix_fmt = *known;
  codec->color_range = AVCOL_RANGE_JPEG;
  codec->gop_size = setting.gop;
  codec->max_b_frames = setting.b_frames;
  codec->flags |= AV_CODEC_FLAG_QSCALE;
  codec->global_quality = 3 * FF_QP2LAMBDA;
  codec->thread_count = 1;
  if (muxer->oformat->flags & AVFMT_GLOBALHEADER) codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  check(avcodec_open2(codec.get(), encoder, nullptr), "the encoder does not open");
  AVStream* stream = avformat_new_stream(muxer.get(), nullptr);
  check(avcodec_parameters_from_context(stream->codecpar, codec.get()), "parameters");
  stream->time_base = codec->time_base;
  AVDictionary* options = nullptr;
  if (!setting.movflags.empty()) av_dict_set(&options, "movflags", setting.movflags.c_str(), 0);
  const int written = avformat_write_header(muxer.get(), &options);
  av_dict_free(&options);
  check(written, "the head cannot be written");
  const FramePtr image(av_frame_alloc());
  image->format = codec->pix_fmt;
  image->width = codec->width;
  image->height = codec->height;
  check(av_frame_get_buffer(image.get(), 0), "no memory");
  const PacketPtr packet(av_packet_alloc());
  size_t packets = 0;
  const bool edits = file.extension() == ".mp4" || file.extension() == ".mov";
  const int64_t b_delay_ms = edits && setting.b_frames > 0 ? 2000 : 40;
  const auto drain = [&] {
    while (avcodec_receive_packet(codec.get(), packet.get()) >= 0) {
      if (setting.damage) {
        check(av_packet_make_writable(packet.get()), "no memory");
        setting.damage(packets, {packet->data, static_cast<size_t>(packet->size)});
      }
      ++packets;
      // An MP4's edit list ends with the last packet's duration, counted from when it is decoded.
      if (packet->duration == 0) packet->duration = av_rescale_q(b_delay_ms, {1, 1000}, codec->time_base);
      av_packet_rescale_ts(packet.get(), codec->time_base, stream->time_base);
      packet->stream_index = stream->index;
      check(av_interleaved_write_frame(muxer.get(), packet.get()), "a packet cannot be written");
    }
  };
  for (size_t i = 0; i < setting.times_ms.size(); ++i) {
    check(av_frame_make_writable(image.get()), "no memory");
    paint(*image, static_cast<uint32_t>(i));
    image->pts = av_rescale_q(setting.times_ms[i], {1, 1000}, codec->time_base);
    check(avcodec_send_frame(codec.get(), image.get()), "a frame is refused");
    drain();
  }
  avcodec_send_frame(codec.get(), nullptr);
  drain();
  check(av_write_trailer(muxer.get()), "the end cannot be written");
}

void cut_film(const std::filesystem::path& from, const std::filesystem::path& to, int64_t from_ms) {
  AVFormatContext* opened = nullptr;
  check(avformat_open_input(&opened, from.c_str(), nullptr, nullptr), "the film does not open");
  const std::unique_ptr<AVFormatContext, CloseInput> input(opened);
  check(avformat_find_stream_info(input.get(), nullptr), "the film is none");
  const AVStream& read = *input->streams[0];
  const int64_t start = av_rescale_q(from_ms, {1, 1000}, read.time_base);
  check(av_seek_frame(input.get(), 0, start, AVSEEK_FLAG_BACKWARD), "no key frame before");
  const MuxerPtr muxer = open_muxer(to, {});
  muxer->avoid_negative_ts = 0;  // the container says what is not shown
  AVStream* stream = avformat_new_stream(muxer.get(), nullptr);
  check(avcodec_parameters_copy(stream->codecpar, read.codecpar), "parameters");
  stream->codecpar->codec_tag = 0;
  stream->time_base = read.time_base;
  check(avformat_write_header(muxer.get(), nullptr), "the head cannot be written");
  const PacketPtr packet(av_packet_alloc());
  while (av_read_frame(input.get(), packet.get()) >= 0) {
    packet->pts -= start;
    packet->dts -= start;
    packet->pos = -1;
    av_packet_rescale_ts(packet.get(), read.time_base, stream->time_base);
    check(av_interleaved_write_frame(muxer.get(), packet.get()), "a packet cannot be written");
  }
  check(av_write_trailer(muxer.get()), "the end cannot be written");
}

uint32_t frame_shown(uint32_t width, uint32_t height,
                     const std::function<double(uint32_t x, uint32_t y)>& gray_at) {
  uint32_t frame = 0;
  for (uint32_t field = 0; field < kFields; ++field)
    if (gray_at((2 * field + 1) * width / (2 * kFields), height / 2) > 118) frame |= 1u << field;
  return frame;
}

}  // namespace palpate
