// A recording as one height map larger than the pad.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "capture/run/map/touched_depths.h"
#include "capture/run/run_settings.h"
#include "capture/run/run_watch.h"
#include "engine/base/json.h"
#include "engine/map/object_map.h"

namespace palpate {
namespace gpu {
class Context;
}

/// Settings that count: those of measuring, and max_frames. Frames follow one another.
struct MapRequest : RunSettings {
  static constexpr double kLeastOverlap = 0.3, kMostOverlap = 0.95, kLeastShare = 0.05, kMostShare = 0.9;
  static constexpr uint32_t kMostLinks = 50, kMostKeys = 5000;

  MapOptions map;
  /// Places deeper than this part of the way from a frame's lowest fiftieth to its deepest count as touched,
  /// > 0 and < 1.
  double contact_share = kContactShare;
};

struct RecordingMap {
  std::shared_ptr<const MapSnapshot> map;  ///< never null
  uint64_t frames = 0;                     ///< measured
  uint64_t tracked = 0;                    ///< of them, with the object's motion known, or first of a track
  uint64_t no_contact = 0, lost = 0;
  uint32_t tracks = 0;
  std::map<std::string, uint64_t> surfaces;  ///< tracked frames by what their contact is (Slippage)
  double pitch_mm = 0;                       ///< of the recording's pixels
  bool complete = false;                     ///< to the recording's end
  std::string warning;                       ///< of the source: one that was cut short
  std::string error;                         ///< that ended it, and is no frame's before; empty: none
};

/// What map.json says: all of map_json(), and the counts of frames.
json::Value map_report(const RecordingMap& found);
/// The files of write_map() and map.json, into `folder`, which is made; returns their names.
std::vector<std::string> write_map(const std::filesystem::path& folder, const RecordingMap& found);

/// Measures the surface of each frame, follows the object by it and maps it. Throws Error: Failure::Usage of
/// a sensor without a surface or a scale and of options out of their ranges, and as process_recording.
RecordingMap map_recording(gpu::Context& context, const MapRequest& request, const RunWatch& watch);

}  // namespace palpate
