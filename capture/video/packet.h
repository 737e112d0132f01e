// Layout of libav's packets and images of a session's video; used by its writer and its reader.
#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/frame.h>
#include <libavutil/pixfmt.h>
}

#include <memory>
#include <optional>
#include <span>

#include "capture/video/session_video.h"

namespace palpate {

struct FreeCodec {
  void operator()(AVCodecContext* codec) const { avcodec_free_context(&codec); }
};
struct FreeFrame {
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
};
struct FreePacket {
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};
using CodecPtr = std::unique_ptr<AVCodecContext, FreeCodec>;
using FramePtr = std::unique_ptr<AVFrame, FreeFrame>;
using PacketPtr = std::unique_ptr<AVPacket, FreePacket>;

/// Name of the tag that holds the session's text.
inline constexpr const char* kSessionTag = "PALPATE_SESSION";

/// libav's own lines on stderr say nothing that our errors do not.
void silence_libav();

/// The pixels as FFV1 stores them: the smallest of its gray formats that holds the bits (values stay as they
/// are), or interleaved blue, green, red and a byte of nothing.
AVPixelFormat pixel_format(const FrameFormat& format);
/// FFV1 of libavcodec 59 loses the pixels of images of one row or column: smaller frames lie in the corner of
/// an image with sides of that many px.
inline constexpr uint32_t kLeastSide_px = 8;
inline bool is_tiny(const FrameFormat& format) {
  return format.width < kLeastSide_px || format.height < kLeastSide_px;
}
void put_pixels(const Frame& frame, AVFrame& image);
/// The corner of `image` that is `frame`, which has its format already.
void take_pixels(const AVFrame& image, Frame& frame);

/// Adds the frame's record, with check sums of the packet's data and of the pixels, as Matroska's
/// BlockAdditional 1. Less than 0: libav's error.
int add_record(AVPacket& packet, const Frame& frame);
inline constexpr size_t kRecord_bytes = 52;
/// True where a whole record begins.
bool is_record(std::span<const uint8_t> bytes);
struct PacketRecord {
  FrameStamp stamp;
  uint32_t pixels_crc = 0;
};
/// The record of a frame, where it and the packet's data are whole.
std::optional<PacketRecord> find_record(std::span<const uint8_t> record, std::span<const uint8_t> data);
uint32_t crc_of(std::span<const uint8_t> bytes);
uint32_t crc_of(const Frame& frame);

inline constexpr int kTick_per_s = 1000;  ///< Matroska's own
/// The encoder as every session has it, opened; `code` is libav's error where there is none.
CodecPtr open_session_encoder(const FrameFormat& format, double rate_Hz, int& code);

}  // namespace palpate
