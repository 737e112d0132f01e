// Range of frames of a recording: FIRST:END:STEP, as in Python.
#pragma once

#include <cstdint>
#include <string>

#include "capture/source.h"

namespace palpate {

/// Frames by their number, as in the column `frame`: from `first` up to `end`, which is not one of them,
/// every `step`-th.
struct FrameRange {
  uint64_t first = 0;
  uint64_t end = UINT64_MAX;
  uint64_t step = 1;

  bool operator==(const FrameRange&) const = default;
  bool contains(uint64_t frame) const { return frame >= first && frame < end && (frame - first) % step == 0; }
};

/// Reads "10:50:2", "10:50", ":50", "10:", "::2" or "7", that frame alone. Throws Error(Failure::Usage) where
/// it is none of these, empty, or has a step of 0.
FrameRange parse_frame_range(const std::string& text);
/// As it is read, "" for all frames.
std::string to_string(const FrameRange& range);

/// Jumps to the first frame whose number is at least `sequence`; numbers of a recording with lost frames run
/// ahead of its indices. False, and nothing has happened, where the source cannot jump.
bool seek_frame(Source& source, uint64_t sequence);

}  // namespace palpate
