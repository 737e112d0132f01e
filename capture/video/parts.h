// Functions of the video module; its table of functions (module.h) points here.
#pragma once

#include "capture/video/module.h"

namespace palpate {

std::unique_ptr<SessionVideoReader> read_session_video(const std::filesystem::path& file);
std::unique_ptr<SessionVideoWriter> write_session_video(const std::filesystem::path& file,
                                                        const FrameFormat& format, double rate_Hz,
                                                        const std::string& session_text);
std::unique_ptr<VideoDecoder> decode_video(const std::filesystem::path& file);
std::unique_ptr<VideoPackets> read_video_packets(const std::filesystem::path& file);
std::unique_ptr<VideoEncoder> encode_video(const std::filesystem::path& file, const std::string& name,
                                           uint32_t width, uint32_t height, double rate_Hz);

}  // namespace palpate
