#include "perf/scene.h"

namespace palpate::perf {

Scene scene_for(const Size& size, SyntheticMode mode, bool moving, uint32_t bits) {
  SyntheticOptions options;
  options.scene = "slide";
  options.width = size.width;
  options.height = size.height;
  options.mode = mode;
  options.bit_depth = bits;
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

}  // namespace palpate::perf
