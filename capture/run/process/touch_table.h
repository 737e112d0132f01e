// summary.csv: one row for each time that something touches.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/files/measurements.h"
#include "palpate/touch.h"

namespace palpate {

/// One time that something touches, from its first frame to its last.
struct TouchSpan {
  uint64_t first_frame = 0, last_frame = 0;
  double from_s = 0, to_s = 0;
  uint64_t frames = 0;
  /// At the frame of the largest force; without one, of the largest depth; without one, of the largest area.
  uint64_t peak_frame = 0;
  std::string peak_source{};                ///< its file, of inputs that have one for each frame
  std::optional<Estimate> force_N{};        ///< the largest, where force is calibrated
  std::optional<SurfaceSummary> surface{};  ///< at the deepest frame
  uint64_t largest_area_px = 0;
  double largest_area_mm2 = 0;
  uint64_t most_contacts = 0;
  uint64_t slip_frames = 0, saturated_frames = 0;
};

/// Collects the spans from frames in order; of separate pictures each one that is touched is a span.
class TouchTable {
 public:
  /// `separate`: each frame is a press of its own.
  explicit TouchTable(bool separate = false) : separate_(separate) {}
  void add(const Touch& touch, const std::string& source);
  const std::vector<TouchSpan>& spans() const { return spans_; }

  /// Header and rows, only of the columns that the recording fills, numbers with the digits they deserve.
  std::string csv(MeasuredColumns columns) const;

 private:
  bool separate_;
  std::vector<TouchSpan> spans_;
  double peak_ = 0;
  bool touching_ = false;
};

}  // namespace palpate
