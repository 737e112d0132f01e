#include "capture/video/packet.h"

extern "C" {
#include <libavutil/crc.h>
#include <libavutil/intreadwrite.h>
#include <libavutil/log.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <cstring>
#include <thread>
#include <utility>

namespace palpate {
namespace {

// The record, little endian: 0 mark and version, 4 sequence, 12 time_ns, 20 exposed_ns, 28 delivered_ns,
// 36 flags, 40 CRC-32 of the frame's pixels, 44 CRC-32 of the packet's data, 48 CRC-32 of the 48 bytes
// before. A later version may be longer.
constexpr uint32_t kMark = 0x01504C50;  // "PLP", version 1
constexpr size_t kChecked_bytes = 48;
constexpr uint32_t kAfterGap = 1;
constexpr size_t kId_bytes = 8;  // libav puts the number of the BlockAdditional before it
constexpr uint64_t kId = 1;

}  // namespace

void silence_libav() {
  av_log_set_level(AV_LOG_QUIET);
}

AVPixelFormat pixel_format(const FrameFormat& format) {
  if (format.channels == 3) return AV_PIX_FMT_BGR0;
  if (format.bit_depth <= 8) return AV_PIX_FMT_GRAY8;
  if (format.bit_depth == 9) return AV_PIX_FMT_GRAY9LE;
  if (format.bit_depth == 10) return AV_PIX_FMT_GRAY10LE;
  return format.bit_depth <= 12 ? AV_PIX_FMT_GRAY12LE : AV_PIX_FMT_GRAY16LE;
}

void put_pixels(const Frame& frame, AVFrame& image) {
  if (is_tiny(frame.format)) std::memset(image.buf[0]->data, 0, image.buf[0]->size);
  for (uint32_t y = 0; y < frame.format.height; ++y) {
    uint8_t* to = image.data[0] + static_cast<ptrdiff_t>(y) * image.linesize[0];
    if (frame.format.channels == 1) {
      std::memcpy(to, frame.row(0, y), frame.format.row_bytes());
      continue;
    }
    const uint8_t *r = frame.row(0, y), *g = frame.row(1, y), *b = frame.row(2, y);
    for (uint32_t x = 0; x < frame.format.width; ++x) {
      to[4 * x] = b[x];
      to[4 * x + 1] = g[x];
      to[4 * x + 2] = r[x];
      to[4 * x + 3] = 0;
    }
  }
}

void take_pixels(const AVFrame& image, Frame& frame) {
  for (uint32_t y = 0; y < frame.format.height; ++y) {
    const uint8_t* from = image.data[0] + static_cast<ptrdiff_t>(y) * image.linesize[0];
    if (frame.format.channels == 1) {
      std::memcpy(frame.row(0, y), from, frame.format.row_bytes());
      continue;
    }
    uint8_t *r = frame.row(0, y), *g = frame.row(1, y), *b = frame.row(2, y);
    for (uint32_t x = 0; x < frame.format.width; ++x) {
      b[x] = from[4 * x];
      g[x] = from[4 * x + 1];
      r[x] = from[4 * x + 2];
    }
  }
}

int add_record(AVPacket& packet, const Frame& frame) {
  const FrameStamp stamp = stamp_of(frame);
  uint8_t* side =
      av_packet_new_side_data(&packet, AV_PKT_DATA_MATROSKA_BLOCKADDITIONAL, kId_bytes + kRecord_bytes);
  if (!side) return AVERROR(ENOMEM);
  AV_WB64(side, kId);
  uint8_t* record = side + kId_bytes;
  AV_WL32(record, kMark);
  AV_WL64(record + 4, stamp.sequence);
  AV_WL64(record + 12, static_cast<uint64_t>(stamp.time_ns));
  AV_WL64(record + 20, static_cast<uint64_t>(stamp.exposed_ns));
  AV_WL64(record + 28, static_cast<uint64_t>(stamp.delivered_ns));
  AV_WL32(record + 36, stamp.after_gap ? kAfterGap : 0);
  AV_WL32(record + 40, crc_of(frame));
  AV_WL32(record + 44, crc_of({packet.data, static_cast<size_t>(packet.size)}));
  AV_WL32(record + kChecked_bytes, crc_of({record, kChecked_bytes}));
  return 0;
}

uint32_t crc_of(std::span<const uint8_t> bytes) {
  if (bytes.empty()) return 0;  // libav would look for it at address 0
  return av_crc(av_crc_get_table(AV_CRC_32_IEEE_LE), ~0u, bytes.data(), bytes.size()) ^ ~0u;
}

uint32_t crc_of(const Frame& frame) {
  return crc_of({frame.pixels(), frame.format.frame_bytes()});
}

bool is_record(std::span<const uint8_t> bytes) {
  return bytes.size() >= kRecord_bytes && AV_RL32(bytes.data()) == kMark &&
         AV_RL32(bytes.data() + kChecked_bytes) == crc_of(bytes.first(kChecked_bytes));
}

std::optional<PacketRecord> find_record(std::span<const uint8_t> bytes, std::span<const uint8_t> data) {
  if (!is_record(bytes)) return std::nullopt;
  const uint8_t* record = bytes.data();
  if (AV_RL32(record + 44) != crc_of(data)) return std::nullopt;
  FrameStamp stamp;
  stamp.sequence = AV_RL64(record + 4);
  stamp.time_ns = static_cast<int64_t>(AV_RL64(record + 12));
  stamp.exposed_ns = static_cast<int64_t>(AV_RL64(record + 20));
  stamp.delivered_ns = static_cast<int64_t>(AV_RL64(record + 28));
  stamp.after_gap = (AV_RL32(record + 36) & kAfterGap) != 0;
  return PacketRecord{stamp, AV_RL32(record + 40)};
}

CodecPtr open_session_encoder(const FrameFormat& format, double rate_Hz, int& code) {
  const AVCodec* ffv1 = avcodec_find_encoder(AV_CODEC_ID_FFV1);
  CodecPtr codec(ffv1 ? avcodec_alloc_context3(ffv1) : nullptr);
  code = ffv1 ? AVERROR(ENOMEM) : AVERROR_ENCODER_NOT_FOUND;
  if (!codec) return nullptr;
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
  code = avcodec_open2(codec.get(), ffv1, nullptr);
  return code < 0 ? nullptr : std::move(codec);
}

}  // namespace palpate
