// Places of a frame whose depth is not known, and why: hatched over surface and image.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "palpate/frame.h"
#include "palpate/pipeline.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"

namespace palpate::viz {

struct UnknownCells {
  enum Reason : uint8_t {
    Extrapolated = 1,  ///< calibration never saw this place or colour
    Covered = 2,       ///< by markers, or a flaw of the pad
    Outside = 4,       ///< beyond the pad's outline
    Saturated = 8,
    Shadowed = 16,  ///< too dark to carry a slope
  };
  uint32_t width = 0, height = 0;  ///< cells
  uint32_t cell_px = 0;
  std::vector<uint8_t>
      reasons;      ///< of each cell, by rows: those of half of its pixels or more; empty: all is known
  uint8_t all = 0;  ///< those that occur
};

/// Of a measured frame. `background`: the untouched image, whose own saturated pixels mean nothing; may be
/// empty.
UnknownCells unknown_cells(const Frame& frame, const Frame& background, const Touch& touch,
                           const Result& result, const Sensor& sensor);

/// "not known: extrapolated, saturated"; empty where all is known.
std::string words_of(const UnknownCells& cells);

}  // namespace palpate::viz
