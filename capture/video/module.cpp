#include "capture/video/module.h"

#include "engine/base/module.h"

namespace palpate {

const VideoModule& video_module() {
  static const VideoModule& module = *reinterpret_cast<const VideoModule* (*)()>(
      module_function("palpate_video", "palpate_video_functions", "videos and sessions"))();
  return module;
}

std::unique_ptr<SessionVideoWriter> SessionVideoWriter::create(const std::filesystem::path& file,
                                                               const FrameFormat& format, double rate_Hz,
                                                               const std::string& session_text) {
  return video_module().write_session(file, format, rate_Hz, session_text);
}

std::unique_ptr<SessionVideoReader> SessionVideoReader::open(const std::filesystem::path& file) {
  return video_module().read_session(file);
}

}  // namespace palpate
