#include "viz/render/surface_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <optional>

#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "shaders/shared/colormap.h"
#include "tests/support/gpu_fixture.h"
#include "viz/display/picture.h"
#include "viz/panels/hud.h"
#include "viz/render/desktop.h"
#include "viz/render/mesh_places.h"
#include "viz/render/view_state.h"
#include "viz/render/window.h"

namespace palpate::viz {
namespace {

constexpr double kPitch_mm = 0.05;

std::array<int, 3> map_rgb(double t) {
  const auto v = static_cast<float>(t);
  const auto byte = [](float x) { return static_cast<int>(std::lround(255 * std::clamp(x, 0.0f, 1.0f))); };
  return {byte(viridis_red(v)), byte(viridis_green(v)), byte(viridis_blue(v))};
}

int distance(const uint8_t* rgb, const std::array<int, 3>& to) {
  int worst = 0;
  for (size_t c = 0; c < 3; ++c) worst = std::max(worst, std::abs(rgb[c] - to[c]));
  return worst;
}

/// A map on the device, row pitch larger than its width, and a picture of it.
class SurfaceViewTest : public GpuTest {
 protected:
  SurfaceViewTest()
      : pass_(context(), OffscreenTarget::kFormat, VK_SAMPLE_COUNT_1_BIT,
              VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL),
        target_(context(), pass_, {400, 300}),
        view_(context(), pass_, 1) {}

  void fill(uint32_t width, uint32_t height, const std::function<double(double, double)>& depth_mm) {
    const uint32_t pitch = width + 7;
    buffer_ = gpu::DeviceBuffer(context(), "analytic map", uint64_t{4} * pitch * height, gpu::Memory::Upload);
    const auto out = buffer_.as<float>();
    for (uint32_t y = 0; y < height; ++y) {
      for (uint32_t x = 0; x < width; ++x) {
        out[y * pitch + x] = static_cast<float>(
            depth_mm((x - 0.5 * (width - 1)) * kPitch_mm, (y - 0.5 * (height - 1)) * kPitch_mm));
      }
    }
    buffer_.flush();
    map_ = {&buffer_, width, height, pitch};
  }

  RgbImage draw(const Camera& camera, const SurfaceStyle& style, uint32_t mesh_columns, double offset_mm = 0,
                const std::optional<PixelRect>& dense = std::nullopt) {
    const ViewRect rect{0, 0, target_.extent().width, target_.extent().height};
    eye_ = place(camera, surface_half_size_mm(map_.width, map_.height, kPitch_mm, style), rect.aspect(),
                 {0.05, 0.05, 0.05, 0.05});
    target_.begin();
    map_to_picture_barrier(context(), target_.cmd());
    target_.begin_pass();
    view_.draw(target_.cmd(), map_, offset_mm, kPitch_mm, eye_, style, rect, mesh_columns, {}, dense);
    return target_.finish();
  }

  const uint8_t* at_world(const RgbImage& image, const Vec3& world) const {
    const Projected p = eye_.project(world);
    EXPECT_TRUE(p.in_front);
    return image.at(static_cast<uint32_t>(p.x * image.width), static_cast<uint32_t>(p.y * image.height));
  }

  static uint64_t surface_pixels(const RgbImage& image) {
    const uint8_t* background = image.at(0, 0);
    uint64_t count = 0;
    for (uint32_t y = 0; y < image.height; ++y) {
      for (uint32_t x = 0; x < image.width; ++x)
        count += distance(image.at(x, y), {background[0], background[1], background[2]}) > 4;
    }
    return count;
  }

  RenderPass pass_;
  OffscreenTarget target_;
  SurfaceView view_;
  gpu::DeviceBuffer buffer_;
  SurfaceMap map_;
  Eye eye_;
};

double dimple(double x, double y) {
  return 0.5 * std::exp(-(x * x + y * y) / 2);
}

Camera from_top() {
  Camera camera;
  camera.azimuth_rad = 0;
  camera.elevation_rad = Camera::kMaxElevation_rad;
  return camera;
}

SurfaceStyle plain(double exaggeration) {
  SurfaceStyle style;
  style.exaggeration = exaggeration;
  style.range_mm = 0.5;
  style.lit = false;
  return style;
}

TEST_F(SurfaceViewTest, ColoursAreThoseOfTheMapAtEveryDepth) {
  fill(200, 150, dimple);
  const RgbImage image = draw(from_top(), plain(2), 200);
  for (const double x : {0.0, 0.5, 1.0, 1.5, 2.5, 4.5}) {
    const double depth = dimple(x, 0);
    EXPECT_LE(distance(at_world(image, {x, 0, -2 * depth}), map_rgb(depth / 0.5)), 8)
        << "at x = " << x << " mm";
  }
  EXPECT_LE(distance(at_world(image, {0, 0, -1}), map_rgb(1)), 3) << "the deepest point has the last colour";
  // The corner of the picture is background, and no colour of the map.
  EXPECT_GT(distance(image.at(0, 0), map_rgb(0)), 15);
}

TEST_F(SurfaceViewTest, OrientationIsThatOfTheImage) {
  // Deep only towards +x and +y of the image: right and bottom.
  fill(200, 150, [](double x, double y) { return x > 1 && y > 1 ? 0.5 : 0.0; });
  const RgbImage image = draw(from_top(), plain(1), 200);
  EXPECT_LE(distance(at_world(image, {3, -2.5, -0.5}), map_rgb(1)), 3);
  EXPECT_LE(distance(image.at(300, 220), map_rgb(1)), 3) << "lower right of the picture";
  EXPECT_LE(distance(image.at(100, 220), map_rgb(0)), 3) << "lower left";
  EXPECT_LE(distance(image.at(300, 80), map_rgb(0)), 3) << "upper right";
}

TEST_F(SurfaceViewTest, DatumShiftsTheDepth) {
  fill(200, 150, [](double, double) { return -0.2; });
  EXPECT_LE(distance(draw(from_top(), plain(1), 64, 0.45).at(200, 150), map_rgb(0.5)), 3);
  EXPECT_LE(distance(draw(from_top(), plain(1), 64, 0.70).at(200, 150), map_rgb(1)), 3);
}

TEST_F(SurfaceViewTest, CoarseMeshKeepsTheColoursOfTheFullMap) {
  // Stripes finer than the mesh's cells: colours come from the map, not from the vertices.
  fill(200, 150, [](double x, double) { return std::fmod(x + 100, 1.0) < 0.5 ? 0.0 : 0.5; });
  SurfaceStyle style = plain(1e-6);
  const RgbImage image = draw(from_top(), style, 16);
  EXPECT_LE(distance(at_world(image, {0.25, 0, 0}), map_rgb(0)), 3);
  EXPECT_LE(distance(at_world(image, {0.75, 0, 0}), map_rgb(1)), 3);
}

// The deep end of a dent, seen from the edge: where the mesh is densest it is that of the full map.
TEST_F(SurfaceViewTest, ADentHasTheShapeThatWasMeasured) {
  const auto ball = [](double x, double y) {
    const double r2 = (x - 1) * (x - 1) + (y - 1.5) * (y - 1.5);
    return std::max(0.0, std::sqrt(std::max(0.0, 1.5 * 1.5 - r2)) - 1.0);
  };
  fill(320, 240, ball);
  Camera edge_on;
  edge_on.elevation_rad = 0.15;
  SurfaceStyle style = plain(8);
  const auto differing = [](const RgbImage& a, const RgbImage& b) {
    uint64_t count = 0;
    for (uint32_t y = 0; y < a.height; ++y)
      for (uint32_t x = 0; x < a.width; ++x) {
        const uint8_t* other = b.at(x, y);
        count += distance(a.at(x, y), {other[0], other[1], other[2]}) > 40;
      }
    return count;
  };
  const RgbImage full = draw(edge_on, style, 0);
  const uint64_t even = differing(draw(edge_on, style, 48), full);
  const uint64_t dense = differing(draw(edge_on, style, 48, 0, PixelRect{150, 120, 60, 60}), full);
  RecordProperty("even_px", std::to_string(even));
  RecordProperty("dense_px", std::to_string(dense));
  EXPECT_GT(even, 40u);
  EXPECT_LT(4 * dense, even) << dense << " of " << even << " px";
}

TEST(MeshPlaces, AreTexelsWhereTheyAreWanted) {
  for (const uint32_t texels : {2u, 17u, 320u, 1392u})
    for (const uint32_t count : {2u, 3u, 12u, 96u, 320u})
      for (const auto& [from, to] : {std::pair{0.0, 0.0},
                                     {0.0, 40.0},
                                     {0.3 * texels, 0.5 * texels},
                                     {texels - 10.0, texels + 5.0},
                                     {0.0, 2.0 * texels},
                                     {-5.0, -1.0}}) {
        SCOPED_TRACE(text("%u texels, %u vertices, %g to %g", texels, count, from, to));
        const std::vector<float> places = mesh_places(texels, count, from, to);
        ASSERT_EQ(places.size(), count);
        EXPECT_EQ(places.front(), 0);
        EXPECT_NEAR(places.back(), texels - 1.0, 1e-3);
        for (size_t i = 1; i < places.size(); ++i) EXPECT_GT(places[i], places[i - 1]) << i;
      }
  // A third of the side by 96 vertices: half as far apart there as in an even mesh.
  const std::vector<float> places = mesh_places(320, 96, 100, 200);
  double within = 0;
  for (size_t i = 1; i < places.size(); ++i)
    if (places[i - 1] >= 100 && places[i] <= 200)
      within = std::max<double>(within, places[i] - places[i - 1]);
  EXPECT_LT(within, 0.5 * 319 / 95);
  // A small part by every texel.
  const std::vector<float> small = mesh_places(320, 96, 150, 190);
  for (size_t i = 1; i < small.size(); ++i) {
    if (small[i - 1] >= 150 && small[i] <= 190) {
      EXPECT_LE(small[i] - small[i - 1], 1.001);
    }
  }
}

TEST(MeshPlaces, TheDentedPartIsAroundAllContacts) {
  Touch touch;
  EXPECT_FALSE(dented_part(touch, 320, 240)) << "at rest";
  touch.contact = true;
  touch.centroid_x_px = 100;
  touch.centroid_y_px = 80;
  touch.ellipse.major_px = 40;
  EXPECT_EQ(dented_part(touch, 320, 240), (PixelRect{70, 50, 60, 60})) << "by the ellipse";
  touch.contacts.resize(2);
  touch.contacts[0].box = {200, 100, 40, 40};
  touch.contacts[1].box = {20, 200, 40, 40};
  EXPECT_EQ(dented_part(touch, 320, 240), (PixelRect{10, 90, 240, 150})) << "within the frame";
  touch.contacts.clear();
  touch.centroid_x_px = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(dented_part(touch, 320, 240));
}

TEST_F(SurfaceViewTest, ExaggerationChangesTheSilhouette) {
  fill(200, 150, dimple);
  Camera edge_on;
  edge_on.elevation_rad = 0.02;
  SurfaceStyle flat = plain(1), steep = plain(1);
  flat.range_mm = steep.range_mm = 5;  // the same framing of both but for the exaggeration
  flat.exaggeration = 0.1;
  steep.exaggeration = 5;
  // Seen from the edge, only a deep dimple shows below the pad.
  const uint64_t flat_px = surface_pixels(draw(edge_on, flat, 128));
  const uint64_t steep_px = surface_pixels(draw(edge_on, steep, 128));
  EXPECT_GT(flat_px, 50u);
  EXPECT_GT(steep_px, 2 * flat_px);
}

TEST_F(SurfaceViewTest, LightKeepsLevelFacetsAndShadesSlopes) {
  fill(200, 150, dimple);
  SurfaceStyle style = plain(4);
  style.lit = true;
  const RgbImage image = draw(from_top(), style, 128);
  EXPECT_LE(distance(at_world(image, {4.5, 3, 0}), map_rgb(0)), 16) << "level: the colour of the colour bar";
  // The light comes from the upper left: walls that face it are brighter than those opposite, at the same
  // depth.
  const double r = 0.7, z = -4 * dimple(r, r);
  const uint8_t* toward = at_world(image, {r, -r, z});
  const uint8_t* away = at_world(image, {-r, r, z});
  EXPECT_GT(toward[1], away[1] + 25);
}

// The floor of a pit with a level floor against a plane at its depth: what differs is the sky that its wall
// takes away.
TEST_F(SurfaceViewTest, AWallTakesSkyFromTheFloorBesideIt) {
  constexpr double kDepth_mm = 0.2, kAmbient = 0.55, kOuterRing = 0.055;  // of the map's longer side
  constexpr double kRadius_mm = 0.4;                                      // within the outer ring
  SurfaceStyle style = plain(4);
  style.lit = true;
  const auto floor_of = [&](double radius_mm) {
    fill(200, 150, [=](double x, double y) { return std::hypot(x, y) < radius_mm ? kDepth_mm : 0.0; });
    const RgbImage image = draw(from_top(), style, 200);
    const uint8_t* rgb = at_world(image, {0, 0, -style.exaggeration * kDepth_mm});
    return std::array<int, 3>{rgb[0], rgb[1], rgb[2]};
  };
  const std::array<int, 3> plane = floor_of(100), pit = floor_of(kRadius_mm);
  const double steepness = style.exaggeration * kDepth_mm / (kOuterRing * 200 * kPitch_mm);
  const double sky = 1 / std::sqrt(1 + steepness * steepness);
  const std::array<int, 3> colour = map_rgb(kDepth_mm / style.range_mm);
  for (size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(plane[c] - pit[c], kAmbient * (1 - sky) * colour[c], 3)
        << c << ": " << plane[c] << " and " << pit[c];
  EXPECT_GT(plane[1] - pit[1], 20);
  style.lit = false;
  EXPECT_LE(std::abs(floor_of(kRadius_mm)[1] - colour[1]), 3) << "plain colours are those of the bar";
}

TEST_F(SurfaceViewTest, BothSidesAreDrawn) {
  fill(200, 150, dimple);
  SurfaceStyle style = plain(4);
  style.lit = true;
  Camera below;
  below.elevation_rad = -0.8;
  EXPECT_GT(surface_pixels(draw(below, style, 64)), 400u * 300u / 8);
}

TEST_F(SurfaceViewTest, SmallestMapsAreDrawn) {
  for (const auto& [w, h] : {std::pair{1u, 1u}, {2u, 1u}, {1u, 3u}, {2u, 2u}}) {
    fill(w, h, [](double, double) { return 0.1; });
    EXPECT_NO_THROW(draw(Camera{}, plain(1), 0)) << w << " x " << h;
  }
}

TEST(Camera, FittedBoxFillsItsRoom) {
  for (const double azimuth : {-2.0, -0.42, 0.0, 1.0}) {
    for (const double elevation : {-1.0, 0.1, 0.72, 1.5}) {
      Camera camera;
      camera.azimuth_rad = azimuth;
      camera.elevation_rad = elevation;
      const Vec3 half{13, 10, 2};
      const ViewMargins margins{0.1, 0.2, 0.05, 0.15};
      const Eye eye = place(camera, half, 1.3, margins);
      double left = 1, right = 0, top = 1, bottom = 0;
      for (int corner = 0; corner < 8; ++corner) {
        const Projected p = eye.project(
            {(corner & 1 ? 1 : -1) * half.x, (corner & 2 ? 1 : -1) * half.y, (corner & 4 ? 0 : -2) * half.z});
        ASSERT_TRUE(p.in_front);
        left = std::min(left, p.x), right = std::max(right, p.x);
        top = std::min(top, p.y), bottom = std::max(bottom, p.y);
        const Projected again = eye.project(eye.position + eye.ray(p.x, p.y) * 7);
        EXPECT_NEAR(again.x, p.x, 1e-9);
        EXPECT_NEAR(again.y, p.y, 1e-9);
      }
      EXPECT_GE(std::min(left - 0.1, top - 0.05), -1e-6);
      EXPECT_LE(std::max(right - 0.8, bottom - 0.85), 1e-6);
      // In the middle of its room, which it fills one way.
      EXPECT_NEAR(left - 0.1, 0.8 - right, 1e-6);
      EXPECT_NEAR(top - 0.05, 0.85 - bottom, 1e-6);
      EXPECT_NEAR(std::min(left - 0.1, top - 0.05), 0, 1e-6);
    }
  }
}

TEST(MeshGovernor, CoarsensWhenSlowAndRefinesWithPatience) {
  MeshGovernor governor(false, 20);
  const uint32_t start = governor.columns();
  for (int i = 0; i < 16; ++i) governor.record(60);
  const uint32_t coarse = governor.columns();
  EXPECT_LT(coarse, start);
  for (int i = 0; i < 16; ++i) governor.record(5);
  EXPECT_EQ(governor.columns(), coarse) << "no swinging back at once";
  for (int i = 0; i < 400; ++i) governor.record(5);
  EXPECT_GT(governor.columns(), start);
  const uint32_t fine = governor.columns();
  for (int i = 0; i < 400; ++i) governor.record(16);
  EXPECT_EQ(governor.columns(), fine) << "within the budget nothing changes";
  EXPECT_EQ(MeshGovernor(true, 20).columns(), 0u) << "hardware draws every texel";
}

TEST(ViewState, RangeGrowsAtOnceAndShrinksOnlyAfterSeconds) {
  ViewState state;
  Touch touch;
  touch.contact = true;
  touch.surface.emplace();
  touch.surface->depth_max_mm = 0.42;
  state.follow(touch, 25);
  EXPECT_DOUBLE_EQ(state.range_mm, 0.5);
  touch.surface->depth_max_mm = 0.09;
  touch.time_ns = 1'000'000'000;
  state.follow(touch, 25);
  EXPECT_DOUBLE_EQ(state.range_mm, 0.5);
  touch.time_ns = 10'000'000'000;
  state.follow(touch, 25);
  EXPECT_DOUBLE_EQ(state.range_mm, 0.1);
  touch.contact = false;
  touch.surface->depth_max_mm = 0;
  touch.time_ns = 60'000'000'000;
  state.follow(touch, 25);
  EXPECT_DOUBLE_EQ(state.range_mm, 0.1) << "a resting pad changes nothing";
}

TEST(Hud, EveryDoubtHasItsOwnWordsAndColour) {
  const Validity all[] = {Validity::Valid,      Validity::NotCalibrated, Validity::NoContact,
                          Validity::BelowRange, Validity::AboveRange,    Validity::Saturated,
                          Validity::AtBorder,   Validity::Clipped};
  for (const Validity a : all) {
    for (const Validity b : all) {
      if (a != b) {
        EXPECT_STRNE(force_verdict(a).words, force_verdict(b).words);
      }
    }
    const Verdict good = force_verdict(Validity::Valid), v = force_verdict(a);
    if (a != Validity::Valid) {
      EXPECT_NE(v.meaning, good.meaning);
    }
  }
}

class PictureTest : public GpuTest, public ::testing::WithParamInterface<FrameFormat> {};

TEST_P(PictureTest, ShowsTheRawImageInItsOwnColours) {
  Sensor sensor;
  sensor.name = "test";
  sensor.pitch_mm_per_px = kPitch_mm;
  PictureOptions options;
  options.width = 960;
  options.height = 600;
  PictureRenderer renderer(context(), sensor, options);
  const FrameFormat format = GetParam();
  Frame frame;
  frame.reshape(format);
  const uint32_t max = format.max_gray();
  for (uint32_t c = 0; c < format.channels; ++c) {
    for (uint32_t y = 0; y < format.height; ++y) {
      for (uint32_t x = 0; x < format.width; ++x) frame.set(c, x, y, c == 0 ? max : max / 2);
    }
  }
  // Without a surface the raw image fills the left of the picture.
  Result result;
  const RgbImage image = renderer.render(frame, Touch{}, result);
  const Layout layout = make_layout({960, 600}, 600.0f / 720, format, false);
  const uint8_t* middle = image.at(static_cast<uint32_t>(layout.image.x) + layout.image.width / 2,
                                   static_cast<uint32_t>(layout.image.y) + layout.image.height / 2);
  const int other = format.channels == 3 ? 127 : 255;
  EXPECT_LE(distance(middle, {255, other, other}), 1);

  // What calibration never saw is hatched.
  const uint32_t cells_x = (format.width + 3) / 4, cells_y = (format.height + 3) / 4;
  const std::vector<uint8_t> cells(size_t{cells_x} * cells_y, 1);
  result.extrapolated = {cells_x, cells_y, 4, cells};
  const RgbImage hatched = renderer.render(frame, Touch{}, result);
  uint32_t struck = 0, seen = 0;
  for (uint32_t y = 0; y < layout.image.height; ++y)
    for (uint32_t x = 0; x < layout.image.width; ++x, ++seen) {
      const auto at_x = static_cast<uint32_t>(layout.image.x) + x,
                 at_y = static_cast<uint32_t>(layout.image.y) + y;
      struck += distance(hatched.at(at_x, at_y), {255, 120, 60}) < 40;
    }
  EXPECT_GT(struck, seen / 100);
  EXPECT_LT(struck, seen / 2) << "the picture is seen between the strokes";
}

INSTANTIATE_TEST_SUITE_P(Formats, PictureTest,
                         ::testing::Values(FrameFormat{64, 48, 1, 8}, FrameFormat{64, 48, 3, 8},
                                           FrameFormat{65, 31, 1, 12}, FrameFormat{65, 31, 3, 16}));

TEST(Window, WithoutADisplayOneClearLine) {
  if (!::testing::GTEST_FLAG(death_test_style).empty())
    ::testing::GTEST_FLAG(death_test_style) = "threadsafe";
  // In a process of its own: GLFW connects to a display once.
  const auto attempt = [] {
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    try {
      window_extensions();
    } catch (const Error& e) {
      std::exit(e.failure() == Failure::Display && !display_available() ? e.exit_code() : 99);
    }
    std::exit(98);
  };
  EXPECT_EXIT(attempt(), ::testing::ExitedWithCode(6), "");
}

}  // namespace
}  // namespace palpate::viz
