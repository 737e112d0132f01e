// Frames of the synthetic sensor, as benchmarks show them to palpate and to its rivals.
#pragma once

#include <string>
#include <vector>

#include "capture/synthetic/synthetic.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate::perf {

struct Size {
  uint32_t width, height;
  uint32_t padded_width, padded_height;  ///< FFTW's good size next to it
  std::string text() const { return std::to_string(width) + "x" + std::to_string(height); }
};

struct Scene {
  Sensor sensor;
  Frame background;
  std::vector<Frame> frames;  ///< shown in turn, so that no run sees the same one twice in a row

  const Frame& next() { return frames[turn_++ % frames.size()]; }

 private:
  size_t turn_ = 0;
};

/// Four frames with contact from all over a slide.
Scene scene_for(const Size& size, SyntheticMode mode, uint32_t bits = 8);
/// Four frames with several contacts each.
Scene fingers_for(const Size& size, SyntheticMode mode);

}  // namespace palpate::perf
