// What a recording measures over time, with a small picture of each moment: what two of them are compared by.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/files/event_log.h"
#include "capture/run/run_settings.h"
#include "capture/run/run_watch.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"

namespace palpate {
namespace gpu {
class Context;
}

/// One frame.
struct CurvePoint {
  double time_s = 0;
  bool contact = false;
  Estimate force_N;   ///< by calibration, else by the elastic layer
  Estimate depth_mm;  ///< deepest place; not calibrated without a surface
  double area_mm2 = 0;
};

struct RecordingCurve {
  static constexpr uint32_t kMapWidth = 200;  ///< px of a picture at most
  static constexpr uint64_t kMostMaps =
      1200;  ///< of a longer recording every second frame, or third, has one
  static constexpr double kDepthUnit_mm = 1e-3;

  std::string input;
  Sensor sensor;
  bool has_depth = false;          ///< pictures are depths, else gray levels
  std::vector<CurvePoint> points;  ///< in order of time
  std::vector<viz::Event> events;  ///< marks
  uint32_t width = 0, height = 0;  ///< px of a picture
  uint64_t map_every = 1;          ///< frames from one picture to the next
  std::vector<uint16_t> maps;      ///< rows of one below those of another: kDepthUnit_mm, or gray of 8 bits
  double rate_Hz = 0;
  std::string warning;  ///< of the source: one that was cut short

  /// The picture nearest to frame `index`: width x height values.
  const uint16_t* map_of(size_t index) const;
  /// The frame nearest to a time.
  size_t index_at(double time_s) const;
};

/// Measures every frame. Throws Error: Failure::Usage where the frames have no times, and as
/// process_recording.
RecordingCurve measure_curve(gpu::Context& context, const RunSettings& settings,
                             std::vector<viz::Event> events, const RunWatch& watch);

}  // namespace palpate
