// A real gel with printed markers that is pressed and dragged. The recording is not part of the repository
// (see tests/recordings/recordings_test.cpp).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "capture/open_source.h"
#include "palpate/pipeline.h"
#include "tests/support/recordings.h"

namespace palpate {
namespace {

class RealMarkers : public RecordingsTest {
 protected:
  RealMarkers() : RecordingsTest("NOT CHECKED AGAINST A REAL MARKER GEL", "gelsight-driver") {}
};

TEST_F(RealMarkers, AreFoundRestAndAreFollowedThroughAPressAndDrag) {
  const std::string video = (recordings_folder() / "gelsight-driver/marker_video.avi").string();
  const Sensor sensor = load_sensor(shipped_sensor("gelsight_driver_markers"));
  const auto source = open_source(video, sensor);
  PipelineOptions options;
  options.outputs = Output::Force | Output::Skin;
  Pipeline pipeline(context(), for_rectified_frames(sensor), source->format(), options);
  pipeline.set_background(load_background(video, sensor, *source));
  double still_px = 0, peak_px = 0, median_peak_px = 0;
  uint32_t most_lost = 0, frames = 0, points = 0;
  Frame frame;
  while (source->next(frame)) {
    const Touch touch = pipeline.process(frame).touch;
    std::vector<double> shifts;
    for (const SkinPoint& p : touch.skin_points)
      if (p.correlation > 0) shifts.push_back(std::hypot(double{p.shift_x_px}, double{p.shift_y_px}));
    std::sort(shifts.begin(), shifts.end());
    ASSERT_FALSE(shifts.empty());
    const double median = shifts[shifts.size() / 2];
    points = touch.skin->points + touch.skin->lost;
    if (frames < 13) still_px = std::max(still_px, median);
    peak_px = std::max(peak_px, shifts.back());
    median_peak_px = std::max(median_peak_px, median);
    most_lost = std::max(most_lost, touch.skin->lost);
    ++frames;
  }
  std::printf(
      "%u markers; before the press half of them within %.2f px; at the peak half beyond %.1f px, none "
      "beyond %.1f px; "
      "at most %u lost at once, %u frames\n",
      points, still_px, median_peak_px, peak_px, most_lost, frames);
  EXPECT_EQ(frames, 48u);
  // 129 are printed in view; those that the frame cuts are left out.
  EXPECT_GE(points, 116u);
  EXPECT_LE(points, 129u);
  EXPECT_LT(still_px, 0.2);
  EXPECT_NEAR(median_peak_px, 30, 2);
  EXPECT_LT(peak_px, 50);
  EXPECT_LE(most_lost, 6u);
}

}  // namespace
}  // namespace palpate
