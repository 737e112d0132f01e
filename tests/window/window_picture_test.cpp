// Pictures with all parts of the window, on the device and against small stored ones; pressure maps and
// sections.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "capture/synthetic/synthetic.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/pipeline/surface_map.h"
#include "engine/sensor/fit.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"
#include "tests/window/letters.h"
#include "viz/display/picture.h"
#include "viz/panels/section.h"
#include "viz/render/colour_map.h"
#include "viz/render/format.h"
#include "viz/render/image/load_view.h"
#include "viz/render/view_state.h"

namespace palpate::viz {
namespace {

namespace fs = std::filesystem;

/// Pictures of measured frames, with every panel.
class WindowPicture : public GpuTest {
 protected:
  struct Run {
    RgbImage image;
    Touch touch;
    std::string words, fault;  ///< that are drawn, and what is wrong with them
    float smallest_px = 0;     ///< of their fonts
  };
  /// Frame `last` of the scene, with the frames before it in the charts.
  Run draw(const std::string& scene, uint64_t last, const PictureOptions& look,
           const std::function<void(Touch&)>& change = {},
           const std::function<void(Sensor&)>& calibrate = {}) {
    const SyntheticOptions options = parse_synthetic(scene);
    SyntheticSensor source(options);
    Sensor sensor = synthetic_sensor(options);
    if (calibrate) calibrate(sensor);
    const Frame background = *source.own_background();
    PipelineOptions measured;
    if (look.quantity == Quantity::Friction) measured.outputs |= Output::Skin | Output::Traction;
    Pipeline pipeline(context(), sensor, source.format(), measured);
    pipeline.set_background(background);
    PictureRenderer renderer(context(), sensor, look, &background);
    Run run;
    Frame frame;
    for (uint64_t k = 0; k <= last && source.next(frame); ++k) {
      EXPECT_TRUE(pipeline.submit(frame));
      Result result = *pipeline.wait();
      if (change) change(result.touch);
      if (k < last)
        renderer.follow(result.touch);
      else
        run = {renderer.render(frame, result.touch, result), result.touch, {}, {}, 0};
    }
    const std::vector<Letter> letters = letters_of(*ImGui::GetDrawData());
    run.words = words_of(letters);
    run.fault = fault_of(letters, static_cast<float>(run.image.height) / 504);
    run.smallest_px = smallest_of(letters);
    return run;
  }
  /// Compares with a stored picture at a quarter of the size: mean and largest difference of blurred pixels.
  static void expect_as_stored(const RgbImage& image, const std::string& name) {
    const cv::Mat rgb(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC3,
                      const_cast<uint8_t*>(image.rgb.data()));
    cv::Mat bgr, small;
    cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
    cv::resize(bgr, small, {}, 0.25, 0.25, cv::INTER_AREA);
    const fs::path file = fs::path(PALPATE_SOURCE_DIR) / "tests" / "data" / "window" / (name + ".png");
    if (std::getenv("PALPATE_STORE_PICTURES")) {
      fs::create_directories(file.parent_path());
      cv::imwrite(file.string(), small);
      GTEST_SKIP() << "stored " << file;
    }
    const cv::Mat stored = cv::imread(file.string());
    ASSERT_EQ(stored.size(), small.size()) << file;
    cv::Mat difference;
    cv::absdiff(stored, small, difference);
    cv::blur(difference, difference, {5, 5});
    double largest = 0;
    cv::minMaxLoc(difference.reshape(1), nullptr, &largest);
    const cv::Scalar mean = cv::mean(difference);
    EXPECT_LT((mean[0] + mean[1] + mean[2]) / 3, 1.5) << name;
    EXPECT_LT(largest, 40) << name;
    if (HasFailure()) cv::imwrite((fs::temp_directory_path() / ("palpate-" + name + ".png")).string(), small);
  }
  static PictureOptions look() {
    PictureOptions options;
    options.mesh_columns = 128;
    return options;
  }
};

/// Pages show pictures 560 px wide.
TEST_F(WindowPicture, IsReadableInAPageAndSaysTheAnswer) {
  PictureOptions calibrations = look();
  calibrations.calibrations = true;
  const std::tuple<const char*, PictureOptions, std::vector<const char*>> cases[] = {
      {"synthetic:slide?size=320x240", look(), {"largest force", "deepest [mm]", "shear [N]"}},
      {"synthetic:slide?size=320x240&mode=gel", look(), {"largest depth", "deepest [mm]"}},
      {"synthetic:slide?size=320x240", calibrations, {"largest force", "Sensor and calibrations"}}};
  for (const auto& [scene, options, wanted] : cases) {
    SCOPED_TRACE(scene);
    Estimate largest_N;
    double at_s = 0;
    const Run run = draw(scene, 100, options, [&](Touch& t) {
      const bool by_layer = t.traction && t.force_N.validity == Validity::NotCalibrated;
      const Estimate& force = by_layer ? t.traction->fz_N : t.force_N;
      if (!t.contact || force.validity != Validity::Valid || force.value <= largest_N.value) return;
      largest_N = force;
      at_s = 1e-9 * static_cast<double>(t.time_ns);
    });
    EXPECT_EQ(run.fault, "");
    EXPECT_GE(run.smallest_px * 560 / static_cast<float>(run.image.width), 8);
    for (const char* each : wanted) EXPECT_TRUE(says(run.words, each)) << each << " in " << run.words;
    if (largest_N.value > 0) {
      const std::string answer =
          text("%.3f %.3f N at %.2f s", largest_N.value, largest_N.standard_error, at_s);
      EXPECT_TRUE(says(run.words, answer)) << answer << " in " << run.words;
    }
  }
}

TEST_F(WindowPicture, ASlideWithChartsAndSectionIsAsStored) {
  PictureOptions options = look();
  options.section = SectionLine{};
  const Run run = draw("synthetic:slide?size=320x240", 100, options);
  EXPECT_EQ(run.touch.slip, Slip::Slip);
  expect_as_stored(run.image, "slide");
}

TEST_F(WindowPicture, SeveralContactsAndSkinAreAsStored) {
  PictureOptions options = look();
  options.map = ColourMap::Cividis;
  const Run run = draw("synthetic:press?size=320x240&mode=gel", 60, options, [](Touch& t) {
    t.regions.emplace();
    t.at_border = true;
    for (uint32_t i = 0; i < 3; ++i) {
      ContactTouch c;
      c.id = i + 1;
      c.centroid_x_px = 70.0 + 90 * i;
      c.centroid_y_px = 80.0 + 40 * i;
      c.area_px = 900;
      c.area_mm2 = 6.5;
      c.ellipse = {4.0 + i, 3.0, 0.4};
      c.force_N = {0.2 + 0.1 * i, 0.01, Validity::Valid};
      c.shear_x_N = {0.1, 0.01, Validity::Valid};
      c.shear_y_N = {-0.05, 0.01, Validity::Valid};
      c.slip = i == 0 ? Slip::Stick : i == 1 ? Slip::Incipient : Slip::Slip;
      c.at_border = i == 2;
      t.contacts.push_back(c);
    }
    t.skin.emplace();
    for (int y = 20; y < 240; y += 24)
      for (int x = 20; x < 320; x += 24)
        t.skin_points.push_back(
            {static_cast<float>(x), static_cast<float>(y), 0.6f, -0.3f, x == 20 ? 0.0f : 1.0f});
    t.skin.emplace();
    t.skin->points = 100;
    t.skin->lost = 10;
  });
  expect_as_stored(run.image, "contacts");
}

TEST_F(WindowPicture, PressureAndStrainHaveTheirColours) {
  PictureOptions options = look();
  options.quantity = Quantity::Pressure;
  options.map = ColourMap::Magma;
  expect_as_stored(draw("synthetic:press?size=320x240", 60, options).image, "pressure");
  options.quantity = Quantity::Strain;
  options.map = ColourMap::Viridis;
  options.colour_range = 0.1;
  expect_as_stored(draw("synthetic:press?size=320x240&mode=gel", 60, options).image, "strain");
}

// Shear over pressure of a drag, arrows at the friction limit in another colour and the key of the arrows.
TEST_F(WindowPicture, FrictionHasItsColours) {
  PictureOptions options = look();
  options.quantity = Quantity::Friction;
  const Run run = draw("synthetic:drag?size=320x240&mode=gel&skin=texture", 110, options);
  ASSERT_TRUE(run.touch.traction.has_value());
  ASSERT_TRUE(run.touch.traction->slipping_fraction.has_value());
  expect_as_stored(run.image, "friction");
}

TEST(ViewQuantities, OnlyThoseThatTheSensorTells) {
  ViewState state;
  Sensor gel = synthetic_sensor(parse_synthetic("synthetic:drag?size=320x240&mode=gel&skin=texture"));
  gel.shear->friction = 0.7;
  state.fit_to(gel);
  EXPECT_DOUBLE_EQ(state.friction_range, 0.7);
  for (const Quantity next : {Quantity::Pressure, Quantity::Strain, Quantity::Friction, Quantity::Depth}) {
    state.next_quantity();
    EXPECT_EQ(state.quantity, next);
  }
  state.quantity = Quantity::Friction;
  gel.skin.reset();
  state.fit_to(gel);
  EXPECT_EQ(state.quantity, Quantity::Depth);
  EXPECT_FALSE(state.can_show(Quantity::Friction));
}

TEST_F(WindowPicture, CalibrationsAreCurvesWithTheTouchOnThem) {
  PictureOptions options = look();
  options.calibrations = true;
  const Run run = draw("synthetic:slide?size=320x240", 50, options, {}, [](Sensor& s) {
    s.force->loading = ForceCurve{s.force->c1_N_per_gray, s.force->c0_N, 1, {}, 0.02};
    s.force->unloading = ForceCurve{0.9 * s.force->c1_N_per_gray, s.force->c0_N, 1, {}, 0.03};
    s.force->origin.from = "a press with a gauge";
    s.shear->ky_N_per_mm *= 0.7;
    s.shear->relative_sd = 0.05;
    s.shear->shift_max_mm = 0.5;
  });
  EXPECT_EQ(run.touch.force_N.validity, Validity::Valid);
  expect_as_stored(run.image, "calibrations");
}

TEST_F(WindowPicture, PressureMapIsThePressureOfTheScene) {
  const SyntheticOptions options = parse_synthetic("synthetic:press?size=640x480&noise=off&falloff=0");
  SyntheticSensor source(options);
  const Sensor sensor = synthetic_sensor(options);
  ASSERT_TRUE(reads_pressure(sensor));
  const Frame background = *source.own_background();
  Frame frame;
  ASSERT_TRUE(source.render(60, frame));
  LoadMap map(context(), 1);
  const LoadTexels texels = map.update(frame, background, sensor);
  EXPECT_EQ(texels.width, 640u);
  EXPECT_EQ(texels.height, 480u);
  // The pressure of gray levels is force over area: summed up it is the force.
  const Truth truth = *source.truth(60);
  double sum = 0;
  for (uint32_t y = 0; y < 480; ++y)
    for (uint32_t x = 0; x < 640; ++x)
      sum += std::max(0.0, double(frame.at(0, x, y)) - background.at(0, x, y));
  const double force_N = sum / sensor.elastic.gray_per_MPa * sensor.pitch_mm_per_px * sensor.pitch_mm_per_px;
  EXPECT_NEAR(force_N, truth.force_N, 0.05 * truth.force_N);
  uint32_t peak = 0;
  for (uint32_t y = 0; y < 480; ++y)
    for (uint32_t x = 0; x < 640; ++x)
      if (frame.at(0, x, y) > background.at(0, x, y))
        peak = std::max(peak, frame.at(0, x, y) - background.at(0, x, y));
  EXPECT_NEAR(map.largest_MPa(), peak / sensor.elastic.gray_per_MPa, 0.03 * map.largest_MPa());
}

/// Depth along a line through a map of known depths.
TEST_F(WindowPicture, SectionReadsTheDepthsUnderTheLine) {
  constexpr uint32_t kWidth = 200, kHeight = 150, kPitch = 207;
  gpu::DeviceBuffer buffer(context(), "known depths", uint64_t{4} * kPitch * kHeight, gpu::Memory::Upload);
  const auto depth = [](double x, double y) { return 0.01 * x + 0.003 * y; };
  const auto out = buffer.as<float>();
  for (uint32_t y = 0; y < kHeight; ++y)
    for (uint32_t x = 0; x < kWidth; ++x) out[y * kPitch + x] = static_cast<float>(depth(x, y));
  buffer.flush();
  const SurfaceMap map{&buffer, kWidth, kHeight, kPitch};
  const double w = kWidth - 1, h = kHeight - 1;
  for (const SectionLine& line :
       {SectionLine{0, 0, 1, 1}, SectionLine{1, 0.3, 0, 0.9}, SectionLine{0.25, 1, 0.25, 0}}) {
    const Profile profile = probe(context(), map, 0.5, 0.05, line);
    EXPECT_NEAR(profile.length_mm, 0.05 * std::hypot((line.x1 - line.x0) * w, (line.y1 - line.y0) * h), 1e-9);
    for (size_t i = 0; i < profile.depth_mm.size(); ++i) {
      const double t = static_cast<double>(i) / static_cast<double>(profile.depth_mm.size() - 1);
      EXPECT_NEAR(
          profile.depth_mm[i],
          0.5 + depth((line.x0 + t * (line.x1 - line.x0)) * w, (line.y0 + t * (line.y1 - line.y0)) * h),
          1e-5);
    }
    EXPECT_DOUBLE_EQ(profile.most().depth_mm,
                     *std::max_element(profile.depth_mm.begin(), profile.depth_mm.end()));
  }
  const Profile point = probe(context(), map, 0, 0.05, {0.5, 0.5, 0.5, 0.5});
  EXPECT_EQ(point.length_mm, 0);
  EXPECT_EQ(point.depth_mm.size(), 2u);
}

/// A card with memory of its own, as a layer shows the processor's driver: the section is copied from there.
TEST(SectionOnACard, EqualsThatOfMappedMemory) {
  gpu::ContextOptions options;
  options.validation = true;
  setenv("VK_ADD_LAYER_PATH", PALPATE_LAYER_DIR, 1);
  setenv("VK_INSTANCE_LAYERS", "VK_LAYER_PALPATE_discrete", 1);
  gpu::Context card(options);
  unsetenv("VK_INSTANCE_LAYERS");
  constexpr uint32_t kWidth = 61, kHeight = 40, kPitch = 64;
  gpu::DeviceBuffer host(card, "known depths", uint64_t{4} * kPitch * kHeight, gpu::Memory::Upload);
  gpu::DeviceBuffer own(card, "depths on the card", host.bytes(), gpu::Memory::Device);
  if (own.mapped()) GTEST_SKIP() << "the loader did not take the layer";
  for (uint32_t i = 0; i < kPitch * kHeight; ++i)
    host.as<float>()[i] = 0.001f * static_cast<float>(i * 37 % 1000);
  host.flush();
  gpu::Commands commands(card);
  commands.begin();
  commands.copy(host, own, host.bytes());
  commands.end();
  commands.submit();
  commands.wait();
  const SurfaceMap mapped{&host, kWidth, kHeight, kPitch}, unmapped{&own, kWidth, kHeight, kPitch};
  for (const SectionLine& line : {SectionLine{0, 0, 1, 1}, SectionLine{0.9, 0.1, 0.1, 0.7}})
    EXPECT_EQ(probe(card, unmapped, 0.1, 0.05, line).depth_mm, probe(card, mapped, 0.1, 0.05, line).depth_mm);
  for (const std::string& message : card.validation_messages()) ADD_FAILURE() << message;
}

}  // namespace
}  // namespace palpate::viz
