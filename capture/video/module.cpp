#include "capture/video/module.h"
#include "engine/base/module.h"

namespace palpate {

const VideoModule& video_module() {
  static const VideoModule& module = *reinterpret_cast<const VideoModule* (*)()>(
      module_function("palpate_video", "palpate_video_functions", "videos and sessions"))();
  return module;
}

}  // namespace palpate
