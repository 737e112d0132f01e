// A pipeline that computes only touched tiles, beside one that computes the whole frame: the same sums to the
// last bit, the same depth within the solver's error, whatever the contact does.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <random>

#include "capture/synthetic/synthetic.h"
#include "engine/gpu/commands.h"
#include "engine/pipeline/windowed_frame.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

struct Blob {
  double x, y, radius;
};

Sensor shading_sensor(uint32_t bits) {
  Sensor sensor;
  sensor.name = "test";
  sensor.pitch_mm_per_px = 0.05;
  sensor.bit_depth = bits;
  sensor.reconstruction = Reconstruction::Shading;
  const double unit = (1u << bits) / 256.0;
  sensor.shading.facing_gray = 150 * unit;
  sensor.threshold_gray = 4 * unit;
  sensor.saturation_gray = (1u << bits) - 1;
  sensor.max_slope = 2;
  sensor.force = ForceCalibration{1e-6, 0, 1e-3, {}, 0, 1e12};
  sensor.shear = ShearCalibration{1, 1, 0.5, 0.1};
  return sensor;
}

Sensor photometric_sensor() {
  Sensor sensor = shading_sensor(8);
  sensor.channels = 3;
  sensor.signal = Signal::Either;
  sensor.reconstruction = Reconstruction::Photometric;
  sensor.photometric.wx[0] = {1.2, 0.4, 0.1};
  sensor.photometric.wy[1] = {1.1, -0.2, 0.3};
  return sensor;
}

FrameFormat format_of(const Sensor& sensor, uint32_t width, uint32_t height) {
  return {width, height, sensor.channels, sensor.bit_depth};
}

Frame rest_of(const Sensor& sensor, uint32_t width, uint32_t height) {
  Frame frame;
  frame.reshape(format_of(sensor, width, height));
  const uint32_t unit = (frame.format.max_gray() + 1) / 256;
  for (uint32_t c = 0; c < frame.format.channels; ++c)
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x)
        frame.set(c, x, y, (sensor.channels == 3 ? 128 : 20) * unit + (x * 7 + y * 13 + x * y) % 5);
  return frame;
}

// Round dents: for one gray image what a facet that falls off smoothly shows, for colour the change that the
// sensor's weights turn back into the normals of a smooth bump.
Frame touched_frame(const Sensor& sensor, const Frame& rest, const std::vector<Blob>& blobs,
                    std::mt19937& random) {
  Frame frame = rest;
  const FrameFormat& f = rest.format;
  const double unit = (f.max_gray() + 1) / 256.0;
  std::normal_distribution noise(0.0, 0.8);
  for (uint32_t y = 0; y < f.height; ++y) {
    for (uint32_t x = 0; x < f.width; ++x) {
      std::array<double, 3> change{};
      for (double& c : change) c = noise(random);
      for (const Blob& b : blobs) {
        const double dx = (x - b.x) / b.radius, dy = (y - b.y) / b.radius, r2 = dx * dx + dy * dy;
        if (r2 >= 1) continue;
        if (f.channels == 1) {
          change[0] += 150 / std::sqrt(1 + 0.36 * r2);  // a slope of up to 0.6
          continue;
        }
        // h = (1 - r^2)^2 radius / 4, pitch and radius in px: slopes of size up to 0.4.
        const double p = -(1 - r2) * dx, q = -(1 - r2) * dy, norm = std::sqrt(1 + p * p + q * q);
        const double at_x = (2.0 * x + 1) / f.width - 1, at_y = (2.0 * y + 1) / f.height - 1;
        const auto weight = [&](const std::array<double, 3>& w) { return w[0] + w[1] * at_x + w[2] * at_y; };
        change[0] += 255 * p / norm / weight(sensor.photometric.wx[0]);
        change[1] += 255 * q / norm / weight(sensor.photometric.wy[1]);
      }
      for (uint32_t c = 0; c < f.channels; ++c)
        frame.set(c, x, y,
                  static_cast<uint32_t>(std::clamp(std::lround(rest.at(c, x, y) + change[c] * unit), 0L,
                                                   static_cast<long>(f.max_gray()))));
    }
  }
  return frame;
}

uint64_t bits(double value) {
  uint64_t whole = 0;
  std::memcpy(&whole, &value, sizeof whole);
  return whole;
}

void expect_same_sums(const Touch& skipped, const Touch& dense, const std::string& what) {
  EXPECT_EQ(skipped.sequence, dense.sequence) << what;
  EXPECT_EQ(skipped.time_ns, dense.time_ns) << what;
  EXPECT_EQ(skipped.contact, dense.contact) << what;
  EXPECT_EQ(skipped.area_px, dense.area_px) << what;
  EXPECT_EQ(skipped.saturated_px, dense.saturated_px) << what;
  EXPECT_EQ(skipped.force_N.validity, dense.force_N.validity) << what;
  EXPECT_EQ(skipped.slip, dense.slip) << what;
  EXPECT_EQ(skipped.surface->validity, dense.surface->validity) << what;
  const std::pair<double, double> exact[] = {{skipped.gray_sum, dense.gray_sum},
                                             {skipped.centroid_x_px, dense.centroid_x_px},
                                             {skipped.centroid_y_px, dense.centroid_y_px},
                                             {skipped.area_mm2, dense.area_mm2},
                                             {skipped.ellipse.major_mm, dense.ellipse.major_mm},
                                             {skipped.ellipse.minor_mm, dense.ellipse.minor_mm},
                                             {skipped.ellipse.angle_rad, dense.ellipse.angle_rad},
                                             {skipped.peak_gray, dense.peak_gray},
                                             {skipped.force_N.value, dense.force_N.value},
                                             {skipped.force_N.standard_error, dense.force_N.standard_error},
                                             {skipped.shift_x_mm, dense.shift_x_mm},
                                             {skipped.shear_x_N.value, dense.shear_x_N.value},
                                             {skipped.shear_y_N.value, dense.shear_y_N.value}};
  for (size_t i = 0; i < std::size(exact); ++i)
    EXPECT_EQ(bits(exact[i].first), bits(exact[i].second))
        << what << ": number " << i << ", " << exact[i].first << " and " << exact[i].second;
}

class SkipUntouchedTest : public GpuTest {
 protected:
  // Both ways to process the same frames.
  struct Both {
    Both(gpu::Context& context, const Sensor& of, uint32_t width, uint32_t height,
         PipelineOptions options = {})
        : sensor(of),
          rest(rest_of(of, width, height)),
          dense(context, sensor, rest.format, options),
          skipped(context, sensor, rest.format, [&] {
            options.skip_untouched = true;
            return options;
          }()) {
      dense.set_background(rest);
      skipped.set_background(rest);
    }

    /// Returns the window that was computed.
    PixelRect compare(const Frame& frame, const std::string& what, double tolerance = 0.03) {
      EXPECT_TRUE(dense.submit(frame));
      EXPECT_TRUE(skipped.submit(frame));
      const Result d = *dense.wait(), s = *skipped.wait();
      expect_same_sums(s.touch, d.touch, what);
      PixelRect window{0, 0, frame.format.width, frame.format.height};
      if (d.touch.surface) {
        window = s.surface.window.value_or(window);
        compare_depth(d, s, what, tolerance);
      }
      return window;
    }

    void compare_depth(const Result& d, const Result& s, const std::string& what, double tolerance) {
      ASSERT_TRUE(s.touch.surface.has_value());
      EXPECT_EQ(s.surface.width, d.surface.width);
      EXPECT_EQ(s.surface.height, d.surface.height);
      const std::vector<float> a = skipped.read_depth_mm(s), b = dense.read_depth_mm(d);
      ASSERT_EQ(a.size(), b.size());
      if (!s.touch.contact) {
        EXPECT_TRUE(std::ranges::all_of(a, [](float depth) { return depth == 0; })) << what;
        EXPECT_EQ(s.touch.surface->depth_max_mm, 0) << what;
        return;
      }
      double worst = 0;
      for (size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(double{a[i]} - double{b[i]}));
      EXPECT_LT(worst, tolerance * d.touch.surface->depth_max_mm)
          << what << ", deepest " << d.touch.surface->depth_max_mm << " mm";
      EXPECT_NEAR(s.touch.surface->depth_max_mm, d.touch.surface->depth_max_mm,
                  tolerance * d.touch.surface->depth_max_mm)
          << what;
      largest_error = std::max(largest_error, worst / d.touch.surface->depth_max_mm);
    }

    Sensor sensor;
    Frame rest;
    Pipeline dense, skipped;
    double largest_error = 0;
  };

  std::mt19937 random_{7};
};

TEST_F(SkipUntouchedTest, SmallContactsAnywhereAreMeasuredAsInTheWholeFrame) {
  for (const uint32_t depth : {8u, 12u}) {
    const uint32_t width = depth == 8 ? 320 : 333, height = depth == 8 ? 240 : 261;
    Both both(context(), shading_sensor(depth), width, height);
    uint32_t windows = 0;
    const auto check = [&](double x, double y, double radius) {
      const std::string what = std::to_string(depth) + " bits, radius " + std::to_string(radius) + " at " +
                               std::to_string(x) + ", " + std::to_string(y);
      Frame frame = touched_frame(both.sensor, both.rest, {{x, y, radius}}, random_);
      frame.sequence = ++windows;
      // The dark rim of a dent this small reads as slopes that no surface has: how far what is left of them
      // spreads depends on where the map ends.
      const PixelRect window = both.compare(frame, what, 0.03);
      EXPECT_LT(window.width, width) << what;
    };
    for (int i = 0; i < 10; ++i)
      check(std::uniform_real_distribution(0.0, double(width))(random_),
            std::uniform_real_distribution(0.0, double(height))(random_),
            std::uniform_real_distribution(12.0, 30.0)(random_));
    for (const double x : {0.0, width / 2.0, width - 1.0})
      for (const double y : {0.0, height / 2.0, height - 1.0}) check(x, y, 17);
    std::printf("%u bits: depth differs by up to %.1e of the deepest\n", depth, both.largest_error);
  }
}

TEST_F(SkipUntouchedTest, APressOnTheSyntheticSensorHasTheSameDepth) {
  for (const char* text :
       {"synthetic:press?size=640x480&mode=lambert", "synthetic:press?size=640x480&mode=gel"}) {
    const SyntheticOptions scene = parse_synthetic(text);
    const SyntheticSensor source(scene);
    Frame frame;
    Both both(context(), synthetic_sensor(scene), 640, 480);
    both.dense.set_background(*source.own_background());
    both.skipped.set_background(*source.own_background());
    uint32_t windows = 0;
    for (uint64_t k = 0; k < *source.frame_count(); k += *source.frame_count() / 8) {
      ASSERT_TRUE(source.render(k, frame));
      // Beyond the window of a gel the skin still leans, by less than what counts as contact.
      const double tolerance = scene.mode == SyntheticMode::Gel ? 0.05 : 0.012;
      const PixelRect window = both.compare(frame, text + (", frame " + std::to_string(k)), tolerance);
      windows += window.width > 0 && window.width < 640;
    }
    EXPECT_GT(windows, 2u) << text;
    std::printf("%s: depth differs by up to %.1e of the deepest\n", text, both.largest_error);
  }
}

TEST_F(SkipUntouchedTest, PhotometricWeightsKeepTheirPlaceInTheFrame) {
  Both both(context(), photometric_sensor(), 325, 243);
  for (const auto& [x, y] : {std::pair{60, 50}, {270, 60}, {60, 200}, {262, 190}, {160, 120}}) {
    const Frame frame = touched_frame(both.sensor, both.rest, {{double(x), double(y), 32}}, random_);
    const PixelRect window = both.compare(frame, "at " + std::to_string(x) + ", " + std::to_string(y), 0.03);
    EXPECT_LT(window.width, 325u);
  }
  std::printf("photometric: depth differs by up to %.1e of the deepest\n", both.largest_error);
}

TEST_F(SkipUntouchedTest, AGrowingContactPassesEveryWindowAndFillsTheFrame) {
  Both both(context(), shading_sensor(8), 320, 240);
  std::vector<PixelRect> seen;
  for (double radius = 6; radius < 120; radius += 3) {
    const Frame frame = touched_frame(both.sensor, both.rest, {{150, 110, radius}}, random_);
    const PixelRect window = both.compare(frame, "radius " + std::to_string(radius), 0.02);
    if (seen.empty() || window.width != seen.back().width) seen.push_back(window);
  }
  const std::vector<PixelRect> sizes = window_sizes(both.rest.format);
  ASSERT_EQ(seen.size(), sizes.size() + 1);
  for (size_t i = 0; i < sizes.size(); ++i) EXPECT_EQ(seen[i].width, sizes[i].width);
  EXPECT_EQ(seen.back(), (PixelRect{0, 0, 320, 240}));
}

TEST_F(SkipUntouchedTest, ContactsFarApartNeedTheWholeFrame) {
  Both both(context(), shading_sensor(8), 320, 240);
  Frame frame = touched_frame(both.sensor, both.rest, {{30, 30, 12}, {290, 210, 15}}, random_);
  EXPECT_EQ(both.compare(frame, "far apart", 0.02), (PixelRect{0, 0, 320, 240}));
  frame = touched_frame(both.sensor, both.rest, {{100, 100, 12}, {135, 120, 15}}, random_);
  EXPECT_LT(both.compare(frame, "close together", 0.02).width, 320u);
}

TEST_F(SkipUntouchedTest, WithoutContactNothingIsComputed) {
  Both both(context(), shading_sensor(8), 320, 240);
  const Frame frame = touched_frame(both.sensor, both.rest, {}, random_);
  EXPECT_EQ(both.compare(frame, "nothing"), PixelRect{});
}

TEST_F(SkipUntouchedTest, PixelsThatAreSaturatedUntouchedDoNotCount) {
  Both both(context(), shading_sensor(8), 320, 240);
  for (const bool touching : {true, false}) {
    Frame frame = touched_frame(both.sensor, both.rest,
                                touching ? std::vector<Blob>{{80, 80, 20}} : std::vector<Blob>{}, random_);
    // As good as saturated in the untouched image: touch does not show there.
    Frame rest = both.rest;
    for (uint32_t x = 250; x < 259; ++x) {
      rest.set(0, x, 200, x % 2 == 0 ? 255 : 252);
      frame.set(0, x, 200, 255);
    }
    both.dense.set_background(rest);
    both.skipped.set_background(rest);
    const PixelRect window = both.compare(frame, touching ? "touching" : "untouched", 0.03);
    EXPECT_LT(window.width, 150u);
    EXPECT_EQ(both.skipped.process(frame).saturated_px, 0u);
    EXPECT_EQ(both.dense.process(frame).saturated_px, 0u);
  }
}

// Frames in flight while the window moves under them, results in the order of submission.
TEST_F(SkipUntouchedTest, ALongSlideKeepsItsOrder) {
  for (const Sensor& sensor : {shading_sensor(8), photometric_sensor()}) {
    Both both(context(), sensor, 320, 240, {.slots = 3});
    constexpr uint64_t kFrames = 40;
    std::vector<Frame> frames;
    for (uint64_t k = 0; k < kFrames; ++k) {
      std::vector<Blob> blobs{{20 + 7.0 * double(k), 60 + 60 * std::sin(double(k) / 5) + 40, 18}};
      if (k % 9 == 4) blobs.clear();
      if (k % 11 == 7) blobs.push_back({300 - 7.0 * double(k), 20, 12});
      frames.push_back(touched_frame(sensor, both.rest, blobs, random_));
      frames.back().sequence = 100 + k;
      frames.back().time_ns = static_cast<int64_t>(k) * 1000;
    }
    std::vector<Touch> skipped, dense;
    uint32_t places = 0;
    std::optional<PixelRect> last;
    const auto take = [&](const std::optional<Result>& result) {
      ASSERT_TRUE(result.has_value());
      skipped.push_back(result->touch);
      const std::vector<float> depth = both.skipped.read_depth_mm(*result);
      EXPECT_NEAR(*std::ranges::max_element(depth), result->touch.surface->depth_max_mm, 1e-6)
          << skipped.size();
      places += result->surface.window != last;
      last = result->surface.window;
    };
    for (const Frame& frame : frames) {
      while (!both.skipped.submit(frame)) take(both.skipped.wait());
      dense.push_back(both.dense.process(frame));
    }
    while (skipped.size() < kFrames) take(both.skipped.wait());
    EXPECT_FALSE(both.skipped.wait().has_value());
    for (size_t k = 0; k < kFrames; ++k) {
      expect_same_sums(skipped[k], dense[k], "frame " + std::to_string(k));
      if (!dense[k].contact) continue;
      EXPECT_NEAR(skipped[k].surface->depth_max_mm, dense[k].surface->depth_max_mm,
                  0.03 * dense[k].surface->depth_max_mm)
          << k;
    }
    EXPECT_GT(places, 8u);
  }
}

// Every slot can be held, and a held map does not change while the window moves on.
TEST_F(SkipUntouchedTest, HeldMapsStayAsTheyAre) {
  Both both(context(), shading_sensor(8), 320, 240, {.slots = 2});
  const Frame here = touched_frame(both.sensor, both.rest, {{60, 60, 18}}, random_);
  const Frame there = touched_frame(both.sensor, both.rest, {{250, 180, 18}}, random_);
  ASSERT_TRUE(both.skipped.submit(here));
  const Result held = *both.skipped.wait();
  const std::vector<float> before = both.skipped.read_depth_mm(held);
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(both.skipped.submit(i % 2 ? here : there));
    EXPECT_FALSE(both.skipped.submit(here)) << "both slots are taken";
    both.skipped.wait();
  }
  EXPECT_EQ(both.skipped.read_depth_mm(held), before);
}

// Where a window would not do, the option changes nothing.
TEST_F(SkipUntouchedTest, HasNoEffectWhereTheWholeFrameIsNeeded) {
  const FrameFormat format{320, 240, 1, 8};
  const PipelineOptions plain{.skip_untouched = true};
  EXPECT_TRUE(can_window(shading_sensor(8), format, plain));
  EXPECT_FALSE(can_window(shading_sensor(8), {80, 60, 1, 8}, plain));
  PipelineOptions options = plain;
  options.solver = SurfaceSolver::Exact;
  EXPECT_FALSE(can_window(shading_sensor(8), format, options));
  options = plain;
  options.outputs = options.outputs | Output::Confidence;
  EXPECT_FALSE(can_window(shading_sensor(8), format, options));
  Sensor sensor = shading_sensor(8);
  sensor.threshold_gray = 0;
  EXPECT_FALSE(can_window(sensor, format, plain));
  sensor = shading_sensor(8);
  sensor.shadow_gray = 3;
  EXPECT_FALSE(can_window(sensor, format, plain));
  sensor = shading_sensor(8);
  sensor.background.kind = BackgroundKind::None;
  EXPECT_FALSE(can_window(sensor, format, plain));
  sensor = shading_sensor(8);
  sensor.reconstruction = Reconstruction::Elastic;
  EXPECT_FALSE(can_window(sensor, format, plain));
  options = plain;
  options.outputs = static_cast<uint32_t>(Output::Force);
  EXPECT_TRUE(can_window(sensor, format, options)) << "force does not need the surface";

  Both both(context(), shading_sensor(8), 80, 60);
  const PixelRect window =
      both.compare(touched_frame(both.sensor, both.rest, {{30, 30, 9}}, random_), "small", 1e-9);
  EXPECT_EQ(window, (PixelRect{0, 0, 80, 60}));
}

TEST_F(SkipUntouchedTest, ForceAloneIsMeasuredInTheWindowToo) {
  Both both(context(), shading_sensor(8), 320, 240, {.outputs = static_cast<uint32_t>(Output::Force)});
  for (int i = 0; i < 6; ++i) {
    const Blob blob{std::uniform_real_distribution(0.0, 320.0)(random_),
                    std::uniform_real_distribution(0.0, 240.0)(random_), 20};
    both.compare(touched_frame(both.sensor, both.rest, {blob}, random_), "frame " + std::to_string(i));
  }
}

// Windows hold what they have to, lie in the frame, and stay where they are as long as they can.
TEST(Windows, ArePlacedInTheFrameAroundTheContact) {
  std::mt19937 random(3);
  for (const FrameFormat& format :
       {FrameFormat{640, 480, 1, 8}, FrameFormat{1392, 1042, 1, 8}, FrameFormat{333, 901, 1, 8}}) {
    for (const PixelRect& size : window_sizes(format)) {
      EXPECT_EQ((format.width - size.width) % 8, 0u);
      EXPECT_EQ((format.height - size.height) % 8, 0u);
      std::optional<PixelRect> last;
      for (int i = 0; i < 500; ++i) {
        PixelRect box;
        const auto below = [&](uint32_t n) { return std::uniform_int_distribution<uint32_t>(0, n)(random); };
        box.width = 1 + below(size.width - 8);
        box.height = 1 + below(size.height - 8);
        box.x = below(format.width - box.width);
        box.y = below(format.height - box.height);
        const PixelRect place = place_window(size, box, last, format);
        EXPECT_TRUE(place.contains(box))
            << box.x << " " << box.width << " in " << place.x << " " << place.width;
        EXPECT_TRUE((PixelRect{0, 0, format.width, format.height}).contains(place));
        EXPECT_EQ(place.x % 8 + place.y % 8, 0u);
        EXPECT_TRUE(!last || !last->contains(box) || place == *last);
        last = place;
      }
    }
  }
}

}  // namespace
}  // namespace palpate
