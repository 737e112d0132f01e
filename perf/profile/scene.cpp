#include "perf/profile/scene.h"

namespace palpate::perf {

namespace {

Scene scene_of(const SyntheticOptions& options) {
  const SyntheticSensor sensor(options);
  Scene scene;
  scene.sensor = synthetic_sensor(options);
  scene.background = *sensor.own_background();
  const uint64_t count = sensor.frame_count().value_or(100);
  for (uint64_t i = 0; i < 4; ++i) sensor.render(count * (i + 2) / 8, scene.frames.emplace_back());
  return scene;
}

SyntheticOptions options_for(const char* name, const Size& size, SyntheticMode mode) {
  SyntheticOptions options;
  options.scene = name;
  options.width = size.width;
  options.height = size.height;
  options.mode = mode;
  return options;
}

}  // namespace

Scene scene_for(const Size& size, SyntheticMode mode, uint32_t bits) {
  SyntheticOptions options = options_for("slide", size, mode);
  options.bit_depth = bits;
  return scene_of(options);
}

Scene fingers_for(const Size& size, SyntheticMode mode) {
  return scene_of(options_for("fingers", size, mode));
}

}  // namespace palpate::perf
