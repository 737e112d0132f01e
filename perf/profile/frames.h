// Frames to time the pipeline with: what they cost to make does not matter, which tiles they touch does.
#pragma once

#include <string>
#include <vector>

#include "engine/frame.h"
#include "engine/sensor.h"

namespace palpate::perf {

struct TimingScene {
  Sensor sensor;
  Frame background;
  std::vector<Frame> frames;  ///< shown in turn, so that no run sees the same one twice in a row

  const Frame& next() { return frames[turn_++ % frames.size()]; }

 private:
  size_t turn_ = 0;
};

/// `touched_fraction` of the frame's area is in contact: all of it, or a rectangle in the middle.
TimingScene timing_scene(uint32_t width_px, uint32_t height_px, Reading reading, double touched_fraction);

}  // namespace palpate::perf
