#include "perf/profile/scene.h"

namespace palpate::perf {

namespace {

Scene scene_of(const SyntheticOptions& options, bool moving) {
  const SyntheticSensor sensor(options);
  Scene scene;
  scene.sensor = synthetic_sensor(options);
  scene.background = *sensor.own_background();
  const uint64_t count = sensor.frame_count().value_or(100);
  const uint64_t frames = moving ? 8 : 4;
  for (uint64_t i = 0; i < frames; ++i)
    sensor.render(moving ? count / 2 + i : count * (i + 2) / 8, scene.frames.emplace_back());
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

Scene scene_for(const Size& size, SyntheticMode mode, bool moving, uint32_t bits) {
  SyntheticOptions options = options_for("slide", size, mode);
  options.bit_depth = bits;
  return scene_of(options, moving);
}

Scene fingers_for(const Size& size, SyntheticMode mode) {
  return scene_of(options_for("fingers", size, mode), false);
}

}  // namespace palpate::perf
