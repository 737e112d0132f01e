// One map larger than the pad, as palpate map makes it.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>

#include "capture/run/map/map_recording.h"
#include "viz/python/arrays.h"
#include "viz/python/bindings.h"
#include "viz/python/device.h"
#include "viz/python/sensor.h"
#include "viz/python/stream.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

py::dict map(const RunSettings& settings, double pitch_mm, double key_overlap, uint32_t links, bool loops,
             uint32_t most_keys, double contact_share, const std::filesystem::path& out,
             const std::string& device) {
  const RecordingMap found = run_apart([=](const std::atomic<bool>& stop) {
    MapRequest asked;
    static_cast<RunSettings&>(asked) = settings;
    asked.map.pitch_mm = pitch_mm;
    asked.map.key_overlap = key_overlap;
    asked.map.links = links;
    asked.map.loops = loops;
    asked.map.most_keys = most_keys;
    asked.contact_share = contact_share;
    RecordingMap made = map_recording(*shared_device(device), asked, watch_of(stop));
    if (!out.empty() && !stop) write_map(out, made);
    return made;
  });
  py::dict d;
  d["report"] = map_report(found).dump(2, json::Utf8::Replace);
  d["warning"] = found.error.empty() ? found.warning : found.error;
  py::list pieces;
  for (const MapPiece& piece : found.map->pieces) {
    const Shape shape{piece.map.height, piece.map.width};
    pieces.append(py::make_tuple(hand_out(piece.map.height_mm, shape), hand_out(piece.map.error_mm, shape),
                                 hand_out(piece.map.coverage, shape)));
  }
  d["pieces"] = pieces;
  return d;
}

}  // namespace

void bind_object_map(py::module_& module) {
  bind_function(module, "map", &map,
                "settings pitch_mm key_overlap links loops most_keys contact_share out device");
}

}  // namespace palpate::python
