// SurfaceReading::Lookup: the engine's depth against the table evaluated pixel by pixel, and its states.
#include "engine/stages/surface/lookup.h"

#include <gtest/gtest.h>

#include <random>

#include "engine/sensor/lookup_depth.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "tests/reference/contact.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/pipelines.h"

namespace palpate {
namespace {

class LookupTest : public GpuTest {};

Sensor gel(uint32_t bits) {
  const double unit = std::ldexp(1.0, static_cast<int>(bits) - 8);
  Sensor s;
  s.name = "gray gel";
  s.pitch_mm_per_px = 0.05;
  s.signal = Signal::Darker;
  s.bit_depth = bits;
  s.saturation_gray = (1u << bits) - 1;
  s.threshold_gray = 4 * unit;
  s.reading = SurfaceReading::Lookup;
  s.lookup.points = {{3 * unit, 0}, {20.25 * unit, 0.3}, {40 * unit, 0.9}, {90 * unit, 1.1}};
  s.lookup.depth_sd_mm = 0.04;
  return s;
}

struct Measured {
  Touch touch;
  std::vector<float> depth_mm;
};

Measured measure(gpu::Context& context, const Sensor& sensor, const Frame& image, const Frame& rest,
                 Outputs outputs = Output::Force | Output::Surface) {
  PipelineOptions options;
  options.outputs = outputs;
  Pipeline pipeline(context, sensor, image.format, options);
  pipeline.set_background(rest);
  EXPECT_TRUE(pipeline.submit(image));
  const auto result = pipeline.wait();
  Measured m{result->touch, depth_map(*result)};
  return m;
}

TEST_F(LookupTest, DepthEqualsTheTable) {
  std::mt19937 random(5);
  for (const auto& [width, height] : std::vector<std::pair<uint32_t, uint32_t>>{
           {1, 1}, {3, 2}, {8, 8}, {9, 31}, {67, 33}, {130, 71}, {16, 200}}) {
    for (const uint32_t bits : {8u, 12u}) {
      const Sensor sensor = gel(bits);
      Frame image, rest;
      image.reshape({width, height, 1, bits});
      rest.reshape(image.format);
      const uint32_t top = image.format.max_gray();
      for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
          rest.set(0, x, y, top / 2 + static_cast<uint32_t>(random()) % (top / 4));
          image.set(0, x, y, static_cast<uint32_t>(random()) % (top - 1));
        }
      const Measured m = measure(context(), sensor, image, rest);
      const std::vector<uint32_t> filtered = reference::filtered_change(image, rest, sensor.signal);
      // The GPU keeps 16 bits: fraction bits are dropped above 8 bits a pixel.
      const double units = 256u >> (bits - 8);
      for (size_t i = 0; i < filtered.size(); ++i) {
        const double gray = std::floor(filtered[i] * units / 256) / units;
        ASSERT_EQ(m.depth_mm[i], static_cast<float>(lookup_depth_mm(sensor.lookup, gray)))
            << width << "x" << height << " bits " << bits << " at " << i % width << ", " << i / width;
      }
      EXPECT_EQ(static_cast<float>(m.touch.surface->depth_max_mm),
                *std::max_element(m.depth_mm.begin(), m.depth_mm.end()));
    }
  }
}

TEST_F(LookupTest, TableIsStraightBetweenItsPoints) {
  const LookupCalibration lookup = gel(8).lookup;
  EXPECT_EQ(lookup_depth_mm(lookup, 0), 0);
  EXPECT_EQ(lookup_depth_mm(lookup, 3), 0);
  EXPECT_DOUBLE_EQ(lookup_depth_mm(lookup, 20.25), 0.3);
  EXPECT_DOUBLE_EQ(lookup_depth_mm(lookup, 65), 1.0);
  EXPECT_DOUBLE_EQ(lookup_depth_mm(lookup, 90), 1.1);
  EXPECT_DOUBLE_EQ(lookup_depth_mm(lookup, 200), 1.1);
}

TEST_F(LookupTest, SaysWhereItsDepthCannotBeTrusted) {
  const Sensor sensor = gel(8);
  Frame rest, image;
  rest.reshape({64, 48, 1, 8});
  std::fill(rest.bytes.begin(), rest.bytes.end(), uint8_t{200});
  image = rest;
  Measured m = measure(context(), sensor, image, rest);
  EXPECT_EQ(m.touch.surface->validity, Validity::NoContact);
  EXPECT_EQ(m.touch.surface->depth_max_mm, 0);
  const auto press = [&](uint32_t gray) {
    image = rest;
    for (uint32_t y = 15; y < 30; ++y)
      for (uint32_t x = 20; x < 40; ++x) image.set(0, x, y, gray);
    return measure(context(), sensor, image, rest);
  };
  m = press(200 - 65);
  EXPECT_EQ(m.touch.surface->validity, Validity::Valid);
  EXPECT_NEAR(m.touch.surface->depth_max_mm, 1.0, 1e-6);
  EXPECT_EQ(m.touch.surface->depth_sd_mm, 0.04);
  m = press(200 - 91);
  EXPECT_EQ(m.touch.surface->validity, Validity::AboveRange);
  EXPECT_NEAR(m.touch.surface->depth_max_mm, 1.1, 1e-6);
  image.set(0, 0, 0, 255);
  EXPECT_EQ(measure(context(), sensor, image, rest).touch.surface->validity, Validity::Saturated);
  // With confidence asked for the depth is the same.
  const Measured plain = press(150);
  const Measured with =
      measure(context(), sensor, image, rest, Output::Force | Output::Surface | Output::Confidence);
  EXPECT_TRUE(with.touch.confidence.has_value());
  EXPECT_EQ(with.depth_mm, plain.depth_mm);
  Sensor colour = sensor;
  colour.channels = 3;
  EXPECT_THROW(Pipeline(context(), colour, {64, 48, 3, 8}, {}), Error);
}

}  // namespace
}  // namespace palpate
