// Printed markers of real gels: the surface under them is as smooth as around them. The recordings are not
// part of the repository: the tests look for them next to it and say loudly when they are skipped.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>

#include "capture/calibrate/frame/markers.h"
#include "capture/open_source.h"
#include "palpate/pipeline.h"
#include "tests/support/csv_table.h"
#include "tests/support/pipelines.h"
#include "tests/support/pits.h"
#include "tests/support/recordings.h"
#include "tests/support/text_file.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

class MarkedGelRecordings : public RecordingsTest {
 protected:
  MarkedGelRecordings() : RecordingsTest("MARKERS NOT CHECKED ON REAL GELS") {}

  static std::vector<float> depth_of(const Frame& frame, const Frame& untouched, const Sensor& sensor) {
    PipelineOptions options;
    options.outputs = Output::Force | Output::Surface;
    options.solver = SurfaceSolver::Best;
    Pipeline pipeline(context(), for_rectified_frames(sensor), frame.format, options);
    pipeline.set_background(untouched);
    EXPECT_TRUE(pipeline.submit(frame));
    const std::optional<Result> result = pipeline.wait();
    EXPECT_EQ(result->touch.markers.has_value(), sensor.skin.has_value());
    return depth_map(*result);
  }
};

struct Press {
  double x_px, y_px, radius_px;
};

// In the dimple and far from it, with markers as they are (0) and filled (1).
using Found = std::array<std::array<Pits, 2>, 2>;

void print(const std::string& name, const Found& found) {
  std::printf("%-16s", name.c_str());
  for (const size_t part : {size_t{0}, size_t{1}})
    std::printf("   %.4f -> %.4f  %.4f -> %.4f", found[0][part].at_markers_mm, found[1][part].at_markers_mm,
                found[0][part].elsewhere_mm, found[1][part].elsewhere_mm);
  std::printf("\n");
}

// A ridged object pressed and dragged: by the gray change alone its moved dots were 45 contacts with 84 ids.
TEST_F(MarkedGelRecordings, MovedMarkersAreNoContacts) {
  const std::string film = (recordings_folder() / "gelsight-driver/marker_video.avi").string();
  const Sensor sensor = load_sensor(shipped_sensor("gelsight_driver_markers"));
  const std::unique_ptr<Source> source = open_source(film, sensor);
  Pipeline pipeline(context(), for_rectified_frames(sensor), source->format(),
                    {.outputs = Output::Force | Output::Contacts});
  pipeline.set_background(load_background(film, sensor, *source));
  std::set<uint32_t> ids;
  size_t most = 0, touched = 0, early = 0;
  Frame frame;
  constexpr uint64_t kStill = 13;  // frames before anything moves
  while (source->next(frame)) {
    const Touch touch = pipeline.process(frame).touch;
    for (const ContactTouch& contact : touch.contacts) ids.insert(contact.id);
    most = std::max(most, touch.contacts.size());
    (frame.sequence < kStill ? early : touched) += touch.contacts.size() == 1;
  }
  std::printf("at most %zu contacts, %zu ids, one contact in %zu frames and in %zu still ones\n", most,
              ids.size(), touched, early);
  EXPECT_EQ(most, 1u);
  EXPECT_EQ(ids.size(), 1u);
  EXPECT_EQ(early, 0u);
  EXPECT_GT(touched, 25u);
}

TEST_F(MarkedGelRecordings, GelSlimIsAsSmoothUnderMarkersAsBeside) {
  const fs::path folder = recordings_folder() / "gelslim-balls";
  std::array<Sensor, 2> sensors;
  sensors.fill(load_sensor(shipped_sensor("gelslim_balls")));
  for (Sensor& sensor : sensors) sensor.background.image = (folder / "ref.jpg").string();
  sensors[0].skin.reset();
  const Table presses(slurp(shipped_sensor("gelslim_balls").replace_filename("gelslim_balls_presses.csv")));
  ASSERT_EQ(presses.rows.size(), 10u);
  std::printf(
      "fine structure    dimple: under markers, beside (mm)   elsewhere: under markers, beside (mm)\n");
  Found squares{};
  for (size_t i = 0; i < presses.rows.size(); ++i) {
    const Press press{presses.number(i, "center_x_px"), presses.number(i, "center_y_px"),
                      presses.number(i, "contact_radius_px")};
    const std::string file = (folder / presses.at(i, "image")).string();
    const std::unique_ptr<Source> source = open_source(file, sensors[0]);
    const Frame untouched = load_background(file, sensors[0], *source);
    Frame frame;
    ASSERT_TRUE(source->next(frame));
    const std::vector<uint8_t> markers =
        either(find_markers(frame, sensors[0]), find_markers(untouched, sensors[0]));
    std::array<std::vector<uint8_t>, 2> inside;
    for (uint32_t y = 0; y < frame.format.height; ++y)
      for (uint32_t x = 0; x < frame.format.width; ++x) {
        const double r = std::hypot(x - press.x_px, y - press.y_px);
        inside[0].push_back(r < 0.8 * press.radius_px);
        inside[1].push_back(r > 2 * press.radius_px);
      }
    Found found;
    for (const size_t filled : {size_t{0}, size_t{1}}) {
      const std::vector<float> depth_mm = depth_of(frame, untouched, sensors[filled]);
      for (const size_t part : {size_t{0}, size_t{1}}) {
        constexpr int kHalf_px = 6;  // more than half a marker
        const Pits pits = pits_of(depth_mm, frame.format.width, markers, inside[part], kHalf_px);
        found[filled][part] = pits;
        squares[filled][part].at_markers_mm += pits.at_markers_mm * pits.at_markers_mm / 10;
        squares[filled][part].elsewhere_mm += pits.elsewhere_mm * pits.elsewhere_mm / 10;
      }
    }
    print(presses.at(i, "image"), found);
  }
  for (auto& of : squares)
    for (Pits& pits : of) pits = {std::sqrt(pits.at_markers_mm), std::sqrt(pits.elsewhere_mm)};
  print("RMS", squares);
  for (const size_t part : {size_t{0}, size_t{1}}) {
    EXPECT_LT(squares[1][part].at_markers_mm, 0.6 * squares[0][part].at_markers_mm);
    EXPECT_LT(squares[1][part].at_markers_mm, 1.25 * squares[1][part].elsewhere_mm);
    EXPECT_LT(squares[1][part].elsewhere_mm, squares[0][part].elsewhere_mm);
  }
}

}  // namespace
}  // namespace palpate
