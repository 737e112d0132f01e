// Snapshot: the picture of the window, the frame it shows and the measurements of that frame.
#pragma once

#include <filesystem>

#include "capture/files/measurements.h"
#include "palpate/frame.h"
#include "palpate/touch.h"
#include "viz/render/render_target.h"
#include "viz/render/surface_view.h"

namespace palpate::viz {

struct Snapshot {
  RgbImage picture;
  Frame frame;  ///< with pixels of its own
  Touch touch;  ///< as measured, whatever zero the picture shows
  MeasuredColumns columns;
};

/// The first of NAME-0001, NAME-0002, ... in `folder`, from `number` on, of which nothing exists; `number`
/// becomes its number.
std::filesystem::path next_file(const std::filesystem::path& folder, const char* name, int& number);

/// Writes STEM.png (the picture), STEM-frame.png (the frame, values as they are) and STEM.csv (header and row
/// of measurements.csv). Makes the folder. Throws Error(Failure::Output).
void write_snapshot(const Snapshot& snapshot, const std::filesystem::path& stem);

/// What of a picture is within `rect`.
RgbImage part_of(const RgbImage& picture, const ViewRect& rect);

}  // namespace palpate::viz
