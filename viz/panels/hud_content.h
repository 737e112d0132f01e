// What the panels of one picture show.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "palpate/frame.h"
#include "palpate/pipeline.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"
#include "viz/live/stats.h"
#include "viz/render/image/map_view.h"
#include "viz/render/image/strain_view.h"
#include "viz/render/image/unknown_cells.h"

namespace palpate::viz {

/// Contents of the display in this picture.
struct HudContent {
  const Sensor& sensor;
  const Frame& frame;
  const Touch& touch;  ///< as measured
  bool has_surface = false;
  const LiveStats* live = nullptr;  ///< null: a picture of a recording
  std::string device;
  std::pair<uint32_t, uint32_t> mesh{0, 0};
  const StrainTexels* strain = nullptr;  ///< over the raw image; null: not asked for
  TractionMaps traction = {};
  const UnknownCells* unknown = nullptr;  ///< hatched over surface and image
  const MapLook* map = nullptr;           ///< of what the pad moves over; null: none is asked for
  bool separate = false;                  ///< a picture by itself: nothing has moved
};

}  // namespace palpate::viz
