// Pressure to deflection: the GPU against the plain version, the pyramid against closed forms and against the
// convolution as it is defined, and the whole frame against the synthetic waveguide's truth.
#include "engine/stages/surface/elastic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "capture/synthetic/synthetic.h"
#include "engine/gpu/commands.h"
#include "engine/pad/layer_convolution.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "tests/reference/elastic.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/pipelines.h"

namespace palpate {
namespace {

constexpr double kPitch_mm = 0.0435;
constexpr double kYoung_MPa = 0.2;

/// Thickness 0: a half space, as in a sensor file.
Pad pad(double thickness_mm, double poisson = 0.5) {
  ElasticCalibration elastic;
  elastic.young_MPa = kYoung_MPa;
  elastic.poisson = poisson;
  elastic.thickness_mm = thickness_mm;
  return pad_of(elastic);
}

struct Difference {
  double rms = 0;   // relative to the RMS of the truth
  double peak = 0;  // relative to the truth's largest value
};
Difference compare(const std::vector<double>& found, const std::vector<double>& truth) {
  double errors = 0, squares = 0, worst = 0, largest = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    const double error = found[i] - truth[i];
    if (!std::isfinite(error)) return {INFINITY, INFINITY};
    errors += error * error;
    squares += truth[i] * truth[i];
    worst = std::max(worst, std::abs(error));
    largest = std::max(largest, std::abs(truth[i]));
  }
  return {std::sqrt(errors / squares), worst / largest};
}

/// Mean over each pixel of a function of the distance from (cx, cy) px.
template <typename Function>
std::vector<double> pixel_means(int width, int height, double cx, double cy, double radius_px,
                                const Function& at) {
  constexpr int kSplit = 8;
  std::vector<double> means(static_cast<size_t>(width) * height, 0.0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (std::hypot(x - cx, y - cy) > radius_px + 1) continue;
      double sum = 0;
      for (int j = 0; j < kSplit; ++j)
        for (int i = 0; i < kSplit; ++i)
          sum += at(std::hypot(x - cx + (i + 0.5) / kSplit - 0.5, y - cy + (j + 0.5) / kSplit - 0.5));
      means[static_cast<size_t>(y) * width + x] = sum / (kSplit * kSplit);
    }
  }
  return means;
}

template <typename Function>
std::vector<double> samples(int width, int height, double cx, double cy, const Function& at) {
  std::vector<double> values;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) values.push_back(at(std::hypot(x - cx, y - cy)));
  return values;
}

class ElasticTest : public GpuTest {
 protected:
  static std::vector<double> deflection(const LayerKernel& kernel, int width, int height,
                                        const std::vector<double>& pressure) {
    const Elastic elastic(context(), kernel, static_cast<uint32_t>(width), static_cast<uint32_t>(height),
                          default_tuning(context()));
    const gpu::DeviceBuffer staging(context(), "pressure", elastic.pressure().bytes(), gpu::Memory::Upload);
    const std::span<float> padded = staging.as<float>();
    std::fill(padded.begin(), padded.end(), 0.0f);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        padded[elastic.pressure_start() + static_cast<size_t>(y) * elastic.pressure_pitch() +
               static_cast<size_t>(x)] = static_cast<float>(pressure[static_cast<size_t>(y) * width + x]);
    staging.flush();
    const FloatMap depth(context(), "depth", elastic.grid());
    const gpu::DeviceBuffer readback(context(), "depth readback", elastic.grid().bytes(),
                                     gpu::Memory::Readback);
    gpu::Commands commands(context());
    commands.begin();
    commands.copy(staging, elastic.pressure(), staging.bytes());
    commands.barrier();
    elastic.record_deflection(commands, depth);
    commands.copy(depth.buffer, readback, readback.bytes());
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    readback.invalidate();
    const std::span<const float> raw = readback.as<const float>();
    std::vector<double> out;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        out.push_back(
            double{raw[static_cast<size_t>(y) * elastic.grid().pitch * 4 + static_cast<size_t>(x)]});
    return out;
  }
};

std::vector<double> random_pressure(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> pressure(static_cast<size_t>(width) * height);
  for (double& p : pressure) p = uniform(random) < 0.3 ? 0.1 * uniform(random) : 0;
  return pressure;
}

TEST_F(ElasticTest, GpuEqualsReference) {
  const std::pair<int, int> sizes[] = {{1, 1},   {2, 1},    {3, 3},     {5, 7},   {1, 40},
                                       {64, 48}, {131, 67}, {160, 121}, {700, 3}, {257, 130}};
  unsigned seed = 1;
  for (const auto& [width, height] : sizes) {
    for (const double thickness_mm : {0.0, 1.0}) {
      SCOPED_TRACE(testing::Message()
                   << width << " x " << height << ", thickness " << thickness_mm << " mm, seed " << seed);
      const LayerKernel kernel(pad(thickness_mm), kPitch_mm);
      auto pressure = random_pressure(width, height, seed++);
      pressure[0] = 0.1;
      const ElasticPlan plan(kernel, static_cast<uint32_t>(width), static_cast<uint32_t>(height));
      const Difference d =
          compare(deflection(kernel, width, height, pressure), reference::elastic(plan, pressure));
      EXPECT_LT(d.peak, 3e-6);
    }
  }
}

TEST(LayerKernel, IsLovesIntegral) {
  EXPECT_NEAR(love_cell(0, 0), 4 * std::log(1 + std::numbers::sqrt2), 1e-14);
  // Where the two formulas meet, and by plain quadrature.
  EXPECT_NEAR(love_cell(39.999999, 0), love_cell(40.000001, 0), 1e-8);
  for (const auto& [x, y] : {std::pair{1.0, 0.0}, {2.0, 3.0}, {0.0, 7.0}, {30.0, 40.0}}) {
    double sum = 0;
    constexpr int kSplit = 400;
    for (int j = 0; j < kSplit; ++j)
      for (int i = 0; i < kSplit; ++i)
        sum += 1 / std::hypot(x + (i + 0.5) / kSplit - 0.5, y + (j + 0.5) / kSplit - 0.5);
    EXPECT_NEAR(sum / (kSplit * kSplit) / love_cell(x, y), 1, 1e-6) << x << ", " << y;
  }
  // E = 0.2 MPa, nu = 0.5: u = (1 - nu^2) / (pi E) p A / r far away.
  EXPECT_NEAR(LayerKernel(pad(0), 0.05).depth(1000, 0), 0.75 / (std::numbers::pi * 0.2) * 0.05 * 0.05 / 50,
              1e-11);
}

TEST(LayerConvolution, EqualsTheSum) {
  for (const double thickness_mm : {0.0, 0.6}) {
    const LayerKernel kernel(pad(thickness_mm), kPitch_mm);
    for (const auto& [width, height] : {std::pair{1, 1}, {37, 22}, {8, 31}}) {
      const auto pressure = random_pressure(width, height, 5);
      std::vector<double> found(pressure.size());
      LayerConvolution layer(kernel, static_cast<uint32_t>(width), static_cast<uint32_t>(height), false);
      layer.depth_by_pressure(pressure, found);
      EXPECT_LT(compare(found, reference::elastic_sum(kernel, pressure, width, height)).peak, 1e-12);
    }
  }
}

TEST_F(ElasticTest, OnePixelIsLovesAnswer) {
  const LayerKernel kernel(pad(0), kPitch_mm);
  for (const auto& [x, y] : {std::pair{60, 50}, {61, 50}, {61, 51}, {63, 57}, {0, 0}, {120, 95}}) {
    std::vector<double> pressure(121 * 96, 0.0);
    pressure[static_cast<size_t>(y) * 121 + x] = 1;
    const Difference d =
        compare(deflection(kernel, 121, 96, pressure), reference::elastic_sum(kernel, pressure, 121, 96));
    EXPECT_LT(d.peak, 1e-3) << x << ", " << y;
    EXPECT_LT(d.rms, 2e-3) << x << ", " << y;
  }
}

// K. L. Johnson, Contact Mechanics, Eq. 3.42: inside and outside the contact.
double hertz_deflection(double r, double a, double pressure_MPa, double modulus_MPa) {
  const double q = 2 * a * a - r * r;
  if (r <= a) return std::numbers::pi * pressure_MPa / (4 * modulus_MPa * a) * q;
  return pressure_MPa / (2 * modulus_MPa * a) *
         (q * std::asin(a / r) + r * a * std::sqrt(1 - a * a / (r * r)));
}

TEST_F(ElasticTest, HertzOnTheHalfSpace) {
  const double modulus_MPa = kYoung_MPa / 0.75;
  const LayerKernel kernel(pad(0), kPitch_mm);
  struct Frame {
    int width, height;
    std::vector<double> radii_px;
  };
  for (const Frame& f :
       {Frame{160, 120, {5, 12}}, Frame{401, 333, {5, 20, 60, 130}}, Frame{640, 480, {5, 35, 200}}}) {
    for (const double a : f.radii_px) {
      const double cx = f.width / 2.0 + 0.3, cy = f.height / 2.0 - 0.2;
      const auto pressure = pixel_means(f.width, f.height, cx, cy, a, [&](double r) {
        return r < a ? 0.02 * std::sqrt(1 - r * r / (a * a)) : 0;
      });
      const auto truth = samples(f.width, f.height, cx, cy, [&](double r) {
        return hertz_deflection(r * kPitch_mm, a * kPitch_mm, 0.02, modulus_MPa);
      });
      const auto found = deflection(kernel, f.width, f.height, pressure);
      const Difference d = compare(found, truth);
      const size_t middle = static_cast<size_t>(f.height / 2) * f.width + f.width / 2;
      SCOPED_TRACE(testing::Message() << f.width << " x " << f.height << ", a = " << a << " px");
      // Pressure that is constant in each pixel answers less than pressure that bends: by 1 / (6 a^2) at the
      // centre, a in pixels, and most along the rim.
      EXPECT_LT(d.peak, 0.04 / a);
      EXPECT_LT(d.rms, 0.35 / (a * a) + 5e-6);
      EXPECT_NEAR(found[middle] / truth[middle], 1, 0.35 / (a * a));
      // The remaining error is the pyramid's own.
      std::vector<double> exact(pressure.size());
      LayerConvolution layer(kernel, static_cast<uint32_t>(f.width), static_cast<uint32_t>(f.height), false);
      layer.depth_by_pressure(pressure, exact);
      const Difference own = compare(found, exact);
      EXPECT_LT(own.peak, a < 10 ? 1.2e-3 : 8e-4);
      EXPECT_LT(own.rms, a < 10 ? 1e-3 : 5e-4);
    }
  }
}

TEST_F(ElasticTest, SphereOnTheBondedLayer) {
  constexpr int kWidth = 320, kHeight = 241;
  constexpr double kX = 158.4, kY = 120.7;
  for (const double poisson : {0.5, 0.4}) {
    for (const auto& [thickness_px, radius_px] :
         {std::pair{200.0, 20.0}, {60.0, 30.0}, {40.0, 60.0}, {20.0, 60.0}, {12.0, 12.0}}) {
      const double thickness_mm = thickness_px * kPitch_mm;
      const LayerContact contact =
          Layer({kYoung_MPa, poisson}, thickness_mm).press_sphere_to_radius(radius_px * kPitch_mm, 20);
      const auto pressure = pixel_means(kWidth, kHeight, kX, kY, radius_px,
                                        [&](double r) { return contact.pressure_MPa(r * kPitch_mm); });
      const auto truth =
          samples(kWidth, kHeight, kX, kY, [&](double r) { return contact.deflection_mm(r * kPitch_mm); });
      const Difference d = compare(
          deflection(LayerKernel(pad(thickness_mm, poisson), kPitch_mm), kWidth, kHeight, pressure), truth);
      SCOPED_TRACE(testing::Message()
                   << "nu " << poisson << ", H = " << thickness_px << " px, a = " << radius_px << " px");
      // An incompressible layer moves only where the pressure changes, so errors weigh more the thinner it
      // is.
      EXPECT_LT(d.peak, thickness_px < 30 ? 6e-3 : 1.5e-3);
      EXPECT_LT(d.rms, thickness_px < 30 ? 5e-3 : 1e-3);
    }
  }
}

TEST_F(ElasticTest, IsLinear) {
  const LayerKernel kernel(pad(6), kPitch_mm);
  const auto one = random_pressure(90, 70, 3), other = random_pressure(90, 70, 4);
  std::vector<double> twice, sum;
  for (size_t i = 0; i < one.size(); ++i) {
    twice.push_back(2 * double{static_cast<float>(one[i])});
    sum.push_back(one[i] + other[i]);
  }
  const auto u = deflection(kernel, 90, 70, one), v = deflection(kernel, 90, 70, other);
  auto doubled = u, added = u;
  for (size_t i = 0; i < u.size(); ++i) {
    doubled[i] = 2 * u[i];
    added[i] = u[i] + v[i];
  }
  EXPECT_EQ(compare(deflection(kernel, 90, 70, twice), doubled).peak, 0);
  EXPECT_LT(compare(deflection(kernel, 90, 70, sum), added).peak, 1e-6);
}

TEST_F(ElasticTest, FullAndBorderLoadsSeeFreeSpace) {
  const LayerKernel kernel(pad(0), kPitch_mm);
  std::vector<double> full(150 * 97, 0.01), edge(150 * 97, 0.0);
  for (size_t y = 30; y < 60; ++y)
    for (size_t x = 0; x < 12; ++x) edge[y * 150 + x] = 0.02;
  for (const auto& pressure : {full, edge}) {
    const Difference d =
        compare(deflection(kernel, 150, 97, pressure), reference::elastic_sum(kernel, pressure, 150, 97));
    EXPECT_LT(d.peak, 8e-4);
    EXPECT_LT(d.rms, 3e-4);
  }
  for (const double depth : deflection(kernel, 150, 97, std::vector<double>(150 * 97, 0.0)))
    EXPECT_EQ(depth, 0);
}

Sensor waveguide(uint32_t width, uint32_t height) {
  SyntheticOptions options;
  options.width = width;
  options.height = height;
  return synthetic_sensor(options);
}

struct Seen {
  Touch touch;
  std::vector<float> depth_mm;
};
Seen see(gpu::Context& context, const Sensor& sensor, const Frame& background, const Frame& frame,
         Solve solve = Solve::Live) {
  Pipeline pipeline(context, sensor, frame.format, solved(solve));
  pipeline.set_background(background);
  pipeline.submit(frame);
  const auto result = pipeline.wait();
  return {result->touch, depth_map(*result)};
}
Frame flat(uint32_t width, uint32_t height, uint32_t gray) {
  Frame frame;
  frame.reshape({width, height, 1, 8});
  std::fill(frame.bytes.begin(), frame.bytes.end(), static_cast<uint8_t>(gray));
  return frame;
}

TEST_F(ElasticTest, DepthSaysWhatItRestsOn) {
  const Sensor sensor = waveguide(120, 90);
  const Frame dark = flat(120, 90, 10);
  const auto press = [&](uint32_t x0, uint32_t y0, uint32_t x1, uint32_t y1, uint32_t gray) {
    Frame frame = dark;
    for (uint32_t y = y0; y < y1; ++y)
      for (uint32_t x = x0; x < x1; ++x) frame.set(0, x, y, gray);
    return see(context(), sensor, dark, frame);
  };
  const Seen none = see(context(), sensor, dark, dark);
  EXPECT_EQ(none.touch.surface->validity, Validity::NoContact);
  EXPECT_EQ(none.touch.surface->depth_max_mm, 0);
  EXPECT_THAT(none.depth_mm, testing::Each(0.0f));

  const Seen middle = press(50, 40, 70, 50, 100);
  EXPECT_EQ(middle.touch.surface->validity, Validity::Valid);
  EXPECT_GT(middle.touch.surface->depth_max_mm, 0);
  EXPECT_NEAR(middle.touch.surface->depth_sd_mm,
              sensor.elastic.relative_sd * middle.touch.surface->depth_max_mm, 1e-12);
  EXPECT_EQ(middle.touch.surface->depth_offset_mm, 0);

  // The 5 x 5 filter reaches two pixels further.
  EXPECT_EQ(press(2, 40, 20, 50, 100).touch.surface->validity, Validity::AtBorder);
  EXPECT_EQ(press(10, 4, 20, 10, 100).touch.surface->validity, Validity::Valid);
  EXPECT_EQ(press(110, 40, 120, 50, 100).touch.surface->validity, Validity::AtBorder);
  EXPECT_EQ(press(40, 80, 50, 90, 100).touch.surface->validity, Validity::AtBorder);
  EXPECT_EQ(press(40, 0, 50, 9, 100).touch.surface->validity, Validity::AtBorder);
  EXPECT_EQ(press(50, 40, 70, 50, 255).touch.surface->validity, Validity::Saturated);
  const Seen white = press(0, 0, 120, 90, 255);
  EXPECT_EQ(white.touch.surface->validity, Validity::Saturated);
  for (const float depth : white.depth_mm) ASSERT_TRUE(std::isfinite(depth));
}

TEST_F(ElasticTest, SaturatingResponseIsInverted) {
  Sensor sensor = waveguide(160, 120), saturating = sensor;
  saturating.elastic.limit_gray = 180;
  const Frame dark = flat(160, 120, 10);
  Frame seen = dark, limited = dark, beyond = dark;
  for (uint32_t y = 50; y < 70; ++y) {
    for (uint32_t x = 60; x < 100; ++x) {
      const double gray = 120;  // of the linear sensor
      seen.set(0, x, y, 10 + static_cast<uint32_t>(gray));
      limited.set(0, x, y, 10 + static_cast<uint32_t>(std::lround(180 * (1 - std::exp(-gray / 180)))));
      beyond.set(0, x, y, 10 + 179);
    }
  }
  const Seen linear = see(context(), sensor, dark, seen), inverse = see(context(), saturating, dark, limited);
  EXPECT_EQ(inverse.touch.surface->validity, Validity::Valid);
  // Half a gray level's rounding; the filter works before the inverse, so the edge is read differently.
  EXPECT_NEAR(inverse.touch.surface->depth_max_mm / linear.touch.surface->depth_max_mm, 1, 0.02);
  EXPECT_EQ(see(context(), saturating, dark, beyond).touch.surface->validity, Validity::Saturated);
}

TEST_F(ElasticTest, ExactIsTheConvolution) {
  SyntheticOptions options;
  options.width = 321;
  options.height = 240;
  const SyntheticSensor source(options);
  Frame frame;
  uint64_t sequence = 0;
  while (source.truth(sequence)->force_N < 0.5) ++sequence;
  source.render(sequence, frame);
  const Sensor sensor = synthetic_sensor(options);
  const Seen live = see(context(), sensor, *source.own_background(), frame);
  const Seen exact = see(context(), sensor, *source.own_background(), frame, Solve::Exact);
  const Difference d =
      compare({live.depth_mm.begin(), live.depth_mm.end()}, {exact.depth_mm.begin(), exact.depth_mm.end()});
  EXPECT_LT(d.peak, 3e-4);
  EXPECT_GT(d.peak, 0);
  EXPECT_NEAR(live.touch.surface->depth_max_mm, exact.touch.surface->depth_max_mm,
              3e-4 * exact.touch.surface->depth_max_mm);
}

TEST_F(ElasticTest, WaveguideSceneAgainstItsTruth) {
  struct Case {
    const char* scene;
    SyntheticResponse response;
    uint32_t bits;
    double rms, deepest;  // bounds, relative to the deepest point
  };
  for (const Case& c : {Case{"palpation", SyntheticResponse::Linear, 8, 0.001, 0.006},
                        Case{"slide", SyntheticResponse::Linear, 12, 0.001, 0.006},
                        Case{"palpation", SyntheticResponse::Saturating, 8, 0.0015, 0.008}}) {
    SyntheticOptions options;
    options.scene = c.scene;
    options.bit_depth = c.bits;
    options.response = c.response;
    const SyntheticSensor source(options);
    Pipeline pipeline(context(), synthetic_sensor(options), source.format(), {});
    pipeline.set_background(*source.own_background());
    const uint64_t count = source.frame_count().value_or(100);
    int compared = 0;
    for (uint64_t i = 0; i < 12; ++i) {
      Frame frame;
      source.render(count * i / 12, frame);
      const Truth truth = *source.truth(frame.sequence);
      pipeline.submit(frame);
      const auto result = pipeline.wait();
      const std::vector<float> depth = depth_map(*result);
      double squares = 0;
      for (size_t k = 0; k < depth.size(); ++k) {
        ASSERT_TRUE(std::isfinite(depth[k]));
        squares += std::pow(double{depth[k]} - double{truth.depth_mm[k]}, 2);
      }
      const double rms = std::sqrt(squares / static_cast<double>(depth.size()));
      SCOPED_TRACE(testing::Message()
                   << c.scene << " frame " << frame.sequence << ", " << truth.force_N << " N");
      if (truth.force_N < 0.1) continue;
      ++compared;
      EXPECT_LT(rms, c.rms * truth.indentation_mm);
      if (result->touch.surface->validity == Validity::Valid) {
        EXPECT_NEAR(result->touch.surface->depth_max_mm, truth.indentation_mm,
                    c.deepest * truth.indentation_mm);
      }
    }
    EXPECT_GT(compared, 3);
  }
}

TEST(ElasticSensor, IsCheckedAndSurvivesTheFile) {
  Sensor sensor = waveguide(64, 48);
  EXPECT_EQ(sensor.reading, SurfaceReading::Elastic);
  sensor.elastic.limit_gray = 150;
  const auto file = std::filesystem::path(testing::TempDir()) / "elastic_sensor.json";
  save_sensor(sensor, file);
  const Sensor loaded = load_sensor(file);
  EXPECT_EQ(loaded.reading, SurfaceReading::Elastic);
  EXPECT_EQ(loaded.elastic.gray_per_MPa, sensor.elastic.gray_per_MPa);
  EXPECT_EQ(loaded.elastic.limit_gray, 150);
  EXPECT_EQ(loaded.elastic.young_MPa, sensor.elastic.young_MPa);
  EXPECT_EQ(loaded.elastic.poisson, 0.5);
  EXPECT_EQ(loaded.elastic.thickness_mm, sensor.elastic.thickness_mm);
  EXPECT_EQ(loaded.elastic.relative_sd, sensor.elastic.relative_sd);

  const auto refused = [&](const auto& change, const std::string& key) {
    Sensor bad = sensor;
    change(bad);
    try {
      validate(bad, "s");
      ADD_FAILURE() << "accepted with a bad " << key;
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 4);
      EXPECT_THAT(error.what(), testing::HasSubstr(key));
    }
  };
  refused([](Sensor& s) { s.elastic.gray_per_MPa = 0; }, "gray_per_MPa");
  refused([](Sensor& s) { s.elastic.young_MPa = 0; }, "young_MPa");
  refused([](Sensor& s) { s.elastic.poisson = 0.6; }, "poisson");
  refused([](Sensor& s) { s.elastic.thickness_mm = 1e-3; }, "thickness_mm");
  refused([](Sensor& s) { s.elastic.limit_gray = -1; }, "limit_gray");
  refused([](Sensor& s) { s.elastic.relative_sd = NAN; }, "relative_sd");
  refused([](Sensor& s) { s.channels = 3; }, "channels");
}

}  // namespace
}  // namespace palpate
