// Gels with printed markers: the surface that they would pit, against the simulator's truth.
#include <gtest/gtest.h>

#include <set>

#include "capture/calibrate/workflow/workflow.h"
#include "shaders/shared/confidence.h"
#include "tests/pipeline/pipeline_fixture.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/pipelines.h"
#include "tests/support/pits.h"
#include "tests/support/test_folder.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

class MarkedGel : public GpuTest {
 protected:
  struct Error {
    double rms_mm;
    Pits pits;
    Touch touch;
  };

  // Error of the depth map, with markers where the untouched image is darker than without them.
  static Error error_of(const SyntheticRun& scene, const Frame& frame, const Truth& truth,
                        const std::vector<uint8_t>& markers, const Sensor& sensor) {
    PipelineOptions options{Output::Force | Output::Surface, SurfaceSolver::Best, 1};
    options.fixed_light = true;
    Pipeline pipeline(context(), sensor, frame.format, options);
    pipeline.set_background(scene.background);
    EXPECT_TRUE(pipeline.submit(frame));
    const std::optional<Result> result = pipeline.wait();
    std::vector<float> depth_mm = depth_map(*result);
    double squares = 0;
    for (size_t i = 0; i < depth_mm.size(); ++i) {
      depth_mm[i] -= truth.depth_mm[i];
      squares += double{depth_mm[i]} * double{depth_mm[i]};
    }
    std::vector<uint8_t> touched;
    for (const float depth : truth.depth_mm) touched.push_back(depth > 0.1 * truth.indentation_mm);
    const int half = static_cast<int>(std::lround(sensor.skin ? sensor.skin->spacing_px / 2 : 10));
    return {std::sqrt(squares / static_cast<double>(depth_mm.size())),
            pits_of(depth_mm, frame.format.width, markers, touched, half), result->touch};
  }

  static std::vector<uint8_t> markers_of(const SyntheticRun& marked, const SyntheticRun& plain) {
    std::vector<uint8_t> markers;
    const FrameFormat& format = marked.background.format;
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x)
        markers.push_back(marked.background.at(1, x, y) < 0.8 * plain.background.at(1, x, y));
    return markers;
  }
};

TEST_F(MarkedGel, DimplesHaveNoPits) {
  std::printf("scene      frame     depth RMS (mm)       under markers     beside them   without markers\n");
  for (const std::string name : {"press", "fingers", "drag"}) {
    SyntheticRun marked(name + "?size=320x240&mode=gel&skin=markers"), plain(name + "?size=320x240&mode=gel");
    const std::vector<uint8_t> markers = markers_of(marked, plain);
    for (const uint64_t k : part_of<uint64_t>({marked.count() / 2, 2 * marked.count() / 3}, 2)) {
      const Frame frame = marked.frame(k);
      const Truth truth = marked.truth(k);
      ASSERT_TRUE(truth.contact);
      Sensor unfilled = marked.sensor;
      unfilled.skin.reset();
      unfilled.shear.reset();
      const Error before = error_of(marked, frame, truth, markers, unfilled),
                  after = error_of(marked, frame, truth, markers, marked.sensor),
                  least = error_of(plain, plain.frame(k), plain.truth(k), markers, plain.sensor);
      std::printf("%-8s %6llu   %.4f -> %.4f   %.5f -> %.5f  %.5f -> %.5f  %.4f, %.5f %.5f\n", name.c_str(),
                  static_cast<unsigned long long>(k), before.rms_mm, after.rms_mm, before.pits.at_markers_mm,
                  after.pits.at_markers_mm, before.pits.elsewhere_mm, after.pits.elsewhere_mm, least.rms_mm,
                  least.pits.at_markers_mm, least.pits.elsewhere_mm);
      EXPECT_FALSE(before.touch.markers);
      ASSERT_TRUE(after.touch.markers);
      EXPECT_LT(after.pits.at_markers_mm, 0.5 * before.pits.at_markers_mm);
      EXPECT_LT(after.pits.at_markers_mm, 0.003);
      EXPECT_LT(after.pits.elsewhere_mm, before.pits.elsewhere_mm);
      EXPECT_LT(after.rms_mm, 1.1 * least.rms_mm);
      EXPECT_GT(after.touch.markers->filled_px, 0.05 * 320 * 240);
      EXPECT_LT(after.touch.markers->unknown_px, 0.005 * 320 * 240);
    }
  }
}

// A sensor file that says nothing of the dots: presses of a ball calibrate it, and its surface is without
// them.
TEST_F(MarkedGel, CalibrationMeasuresTheMarkersThatTheSurfaceFills) {
  const std::filesystem::path folder = test_folder("markers");
  SyntheticRun scene("palpation?mode=gel&size=480x360&rate=1&radius=5&seed=3&skin=markers"),
      plain("palpation?mode=gel&size=480x360&rate=1&radius=5&seed=3");
  Sensor bare = scene.sensor;
  bare.skin.reset();
  bare.shear.reset();
  bare.reading = SurfaceReading::None;
  save_sensor(bare, folder / "bare.json");
  PhotometricRequest request;
  request.input = to_string(scene.options);
  request.sensor = folder / "bare.json";
  request.ball.radius_mm = 5;
  const RunWatch watch;
  const CalibrationReport report = calibrate_photometric(request, {{}, watch});
  ASSERT_TRUE(report.sensor.skin);
  EXPECT_EQ(report.sensor.skin->kind, SkinKind::Markers);
  EXPECT_NE(report.text.find("markers: "), std::string::npos) << report.text;
  request.keep_markers = true;
  EXPECT_FALSE(calibrate_photometric(request, {{}, watch}).sensor.skin);

  const std::vector<uint8_t> markers = markers_of(scene, plain);
  Sensor unfilled = report.sensor;
  unfilled.skin.reset();
  size_t looked = 0;
  for (uint64_t k = 0; k < scene.count() && looked < 2; k += 3) {
    const Truth truth = scene.truth(k);
    if (truth.indentation_mm < 0.3) continue;
    ++looked;
    const Frame frame = scene.frame(k);
    const Error before = error_of(scene, frame, truth, markers, unfilled),
                after = error_of(scene, frame, truth, markers, report.sensor),
                known = error_of(scene, frame, truth, markers, scene.sensor);
    std::printf("frame %llu: under markers %.5f -> %.5f mm, depth %.4f mm RMS, by the true sensor %.4f\n",
                static_cast<unsigned long long>(k), before.pits.at_markers_mm, after.pits.at_markers_mm,
                after.rms_mm, known.rms_mm);
    EXPECT_LT(after.pits.at_markers_mm, 0.5 * before.pits.at_markers_mm);
    EXPECT_LT(after.rms_mm, 1.2 * known.rms_mm);
  }
  EXPECT_EQ(looked, 2u);
  std::filesystem::remove_all(folder);
}

// Dots so large that between them nothing is left: the surface says so, and confidence is 0 under them.
TEST_F(MarkedGel, SaysWhatMarkersCover) {
  SyntheticRun scene("press?size=320x240&mode=gel&skin=markers");
  const uint64_t k = scene.count() / 2;
  Frame frame = scene.frame(k);
  for (uint32_t c = 0; c < 3; ++c)
    for (uint32_t y = 0; y < 240; ++y)
      for (uint32_t x = 0; x < 320; ++x)
        if (std::hypot(x % 16 - 7.5, y % 16 - 7.5) > 2) frame.set(c, x, y, frame.at(c, x, y) / 5);
  PipelineOptions options{Output::Force | Output::Surface | Output::Confidence, SurfaceSolver::Best, 1};
  Pipeline pipeline(context(), scene.sensor, frame.format, options);
  pipeline.set_background(scene.background);
  ASSERT_TRUE(pipeline.submit(frame));
  std::optional<Result> result = pipeline.wait();
  EXPECT_EQ(result->touch.surface->validity, Validity::Covered);
  const uint64_t unknown = result->touch.markers->unknown_px;
  EXPECT_GT(unknown, 320u * 240 / 2);
  uint64_t covered = 0;
  for (const uint16_t pixel : result->confidence()) {
    const bool is_covered = pixel >> shared::kReasonShift & shared::kCovered;
    EXPECT_TRUE(!is_covered || (pixel & 0xff) == 0);
    covered += is_covered;
  }
  EXPECT_EQ(covered, unknown);
  EXPECT_GE(result->touch.confidence->unknown_px, unknown);

  // The same sensor sees again what is not covered.
  result.reset();
  ASSERT_TRUE(pipeline.submit(scene.frame(k)));
  EXPECT_EQ(pipeline.wait()->touch.surface->validity, Validity::Valid);
}

// A ball that drags the skin along: moved markers are no contacts, also of a gel whose colours nobody has
// calibrated.
TEST_F(MarkedGel, MovedMarkersAreNoContacts) {
  SyntheticRun scene("drag?size=320x240&mode=gel&skin=markers");
  Sensor uncalibrated = scene.sensor;
  uncalibrated.reading = SurfaceReading::None;
  for (const Sensor& sensor : {scene.sensor, uncalibrated}) {
    Pipeline pipeline(context(), sensor, scene.background.format,
                      {.outputs = Output::Force | Output::Contacts});
    pipeline.set_background(scene.background);
    std::set<uint32_t> ids;
    size_t touched = 0, one = 0;
    for (uint64_t k = 0; k < scene.count(); k += 4) {
      const Touch touch = pipeline.process(scene.frame(k)).touch;
      for (const ContactTouch& contact : touch.contacts) ids.insert(contact.id);
      EXPECT_LE(touch.contacts.size(), 1u) << "frame " << k;
      if (!scene.truth(k).contact) continue;
      ++touched;
      one += touch.contacts.size() == 1;
    }
    EXPECT_GT(touched, 20u);
    EXPECT_GT(static_cast<double>(one), 0.85 * static_cast<double>(touched));
    EXPECT_LE(ids.size(), 2u);
  }
}

// The skin is followed by its markers as before: it sees the frame as it is.
TEST_F(MarkedGel, SkinIsFollowedAsBefore) {
  SyntheticRun scene("drag?size=320x240&mode=gel&skin=markers");
  Sensor unfilled = scene.sensor;
  unfilled.reading = SurfaceReading::None;
  std::vector<std::vector<SkinPoint>> points;
  for (const Sensor& sensor : {scene.sensor, unfilled}) {
    Pipeline pipeline(context(), sensor, scene.background.format, {Output::Force | Output::Skin});
    pipeline.set_background(scene.background);
    Touch touch;
    for (uint64_t k = scene.count() / 2; k < scene.count() / 2 + 4; ++k)
      touch = pipeline.process(scene.frame(k)).touch;
    points.push_back(touch.skin_points);
  }
  ASSERT_GT(points[0].size(), 100u);
  ASSERT_EQ(points[0].size(), points[1].size());
  for (size_t i = 0; i < points[0].size(); ++i) {
    EXPECT_EQ(points[0][i].shift_x_px, points[1][i].shift_x_px);
    EXPECT_EQ(points[0][i].shift_y_px, points[1][i].shift_y_px);
  }
}

// An exposure that changes in the middle of a run is not taken out among markers: the frames say so.
TEST_F(MarkedGel, AnotherExposureInTheMiddleOfARunIsSaid) {
  SyntheticRun run("palpation?mode=gel&size=320x240&skin=markers&rate=4");
  ASSERT_TRUE(run.sensor.skin);
  for (const double gain : {1.0, 0.8, 1.25}) {
    Pipeline pipeline(context(), run.sensor, run.background.format,
                      {.outputs = Output::Force | Output::Surface | Output::Contacts});
    pipeline.set_background(run.background);
    size_t unknown = 0, touched = 0;
    for (uint64_t k = 0; k < run.count(); ++k) {
      Frame frame = run.frame(k);
      if (k >= run.count() / 2)
        for (uint8_t& value : frame.bytes)
          value = static_cast<uint8_t>(std::min(std::lround(gain * value), 255L));
      const Touch touch = pipeline.process(frame).touch;
      touched += touch.contact;
      if (touch.light->state != LightState::Unknown) continue;
      EXPECT_GE(k, run.count() / 2) << "no frame before";
      EXPECT_EQ(touch.surface->validity, Validity::LightUnknown) << k;
      ++unknown;
    }
    EXPECT_GT(touched, 5u);
    EXPECT_EQ(unknown, gain == 1 ? 0 : run.count() - run.count() / 2) << gain;
  }
}

}  // namespace
}  // namespace palpate
