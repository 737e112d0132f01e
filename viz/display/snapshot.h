// Snapshot: the picture of the window, the frame it shows, its depth and its measurements.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/files/measurements.h"
#include "palpate/frame.h"
#include "palpate/pipeline.h"
#include "palpate/touch.h"
#include "viz/render/render_target.h"
#include "viz/render/surface_view.h"

namespace palpate::viz {

struct Snapshot {
  RgbImage picture;  ///< empty: none is written
  Frame frame;       ///< with pixels of its own
  Touch touch;       ///< as measured, whatever zero the picture shows
  MeasuredColumns columns;
  std::vector<float> depth_mm = {};  ///< of the frame's pixels; empty without a surface
  double pitch_mm_per_px = 0;
};

/// Why nothing is written.
inline constexpr const char* kNoFolder = "no folder to write to: HOME is not set, and there is no --out";

/// Of a measured frame, without a picture; its pixels and its depth are copied, since their memory goes back
/// to camera and engine.
Snapshot snapshot_of(const Frame& frame, const Result& result, MeasuredColumns columns,
                     double pitch_mm_per_px);

/// The first of NAME-0001, NAME-0002, ... in `folder`, from `number` on, of which nothing exists; `number`
/// becomes its number.
std::filesystem::path next_file(const std::filesystem::path& folder, const char* name, int& number);

/// Writes STEM.png (the picture), STEM-frame.png (the frame, values as they are), with a surface
/// STEM-depth.tif (write_depth_tiff), and STEM.csv (header and row of measurements.csv). Makes the folder.
/// Returns the names, for people. Throws Error(Failure::Output).
std::string write_snapshot(const Snapshot& snapshot, const std::filesystem::path& stem);

/// What of a picture is within `rect`.
RgbImage part_of(const RgbImage& picture, const ViewRect& rect);

}  // namespace palpate::viz
