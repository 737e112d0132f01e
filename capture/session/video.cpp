#include "capture/session/video.h"

#include "capture/video/module.h"

namespace palpate {

std::unique_ptr<SessionVideoWriter> SessionVideoWriter::create(const std::filesystem::path& file,
                                                               const FrameFormat& format, double rate_Hz,
                                                               const std::string& session_text) {
  return video_module().write_session(file, format, rate_Hz, session_text);
}

std::unique_ptr<SessionVideoReader> SessionVideoReader::open(const std::filesystem::path& file) {
  return video_module().read_session(file);
}

}  // namespace palpate
