#include "engine/stages/frame/confidence.h"

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "engine/gpu/commands.h"
#include "palpate/error.h"
#include "tests/reference/confidence.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

class ConfidenceTest : public GpuTest {
 protected:
  struct Answer {
    std::vector<uint16_t> map;
    ConfidenceCounts counts;
    std::vector<float> weights;
    bool only_still = false;
    std::optional<bool> lowered;  ///< as the host finds it
  };
  static Answer run(const Frame& image, const Frame& rest, const Sensor& sensor) {
    const FrameFormat& format = image.format;
    Confidence confidence(context(), sensor, format);
    confidence.set_background(rest);
    PaddedImage frame(context(), "frame", format);
    frame.write(image);
    const ConfidenceMap map(context(), confidence.map_bytes());
    const gpu::DeviceBuffer records(context(), "records", confidence.record_bytes(), gpu::Memory::Readback);
    const Grid grid = grid_for(format.width, format.height);
    const FloatMap weights(context(), "weights", grid);
    const gpu::DeviceBuffer host(context(), "readback", grid.bytes(), gpu::Memory::Readback);
    gpu::Commands commands(context());
    commands.begin();
    frame.record(commands);
    commands.barrier();
    confidence.record(commands, frame, map, records);
    confidence.record_weights(commands, map.pairs, weights);
    commands.copy(weights.buffer, host, grid.bytes());
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    records.invalidate();
    host.invalidate();
    Answer answer;
    answer.map = confidence.unpack(map);
    answer.counts = confidence.sum(records.as<const shared::ConfidenceRecord>());
    answer.only_still = confidence.only_still(answer.counts);
    answer.lowered = confidence.lowered_by(image);
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x)
        answer.weights.push_back(host.as<const float>()[size_t{y} * grid.pitch * 4 + x]);
    return answer;
  }
};

// Every pixel, its reasons and the counts, for all formats, readings, outlines and awkward sizes.
TEST_F(ConfidenceTest, EqualsReference) {
  std::mt19937 random(21);
  const std::vector<std::pair<uint32_t, uint32_t>> sizes{{1, 1},  {2, 1},   {1, 5},   {3, 3},   {15, 4},
                                                         {16, 9}, {17, 16}, {33, 40}, {67, 33}, {130, 71}};
  for (int i = 0; i < of_sweep(120, 40); ++i) {
    const auto& [width, height] = sizes[static_cast<size_t>(i) % sizes.size()];
    const bool colour = i % 3 == 0;
    const uint32_t bits = colour ? 8 : std::array{8u, 12u, 16u}[static_cast<size_t>(i / 3) % 3];
    const FrameFormat format{width, height, colour ? 3u : 1u, bits};
    Frame image, rest;
    image.reshape(format);
    rest.reshape(format);
    // Mostly middling, some at either end.
    const auto value = [&]() -> uint32_t {
      const auto kind = static_cast<uint32_t>(random() % 20);
      return kind == 0  ? format.max_gray()
             : kind < 3 ? static_cast<uint32_t>(random()) % (format.max_gray() / 8)
                        : static_cast<uint32_t>(random()) % format.max_gray();
    };
    for (Frame* frame : {&image, &rest})
      for (uint32_t c = 0; c < format.channels; ++c)
        for (uint32_t y = 0; y < height; ++y)
          for (uint32_t x = 0; x < width; ++x) frame->set(c, x, y, value());
    Sensor sensor;
    sensor.pitch_mm_per_px = 0.05;
    sensor.channels = format.channels;
    sensor.bit_depth = bits;
    sensor.reading = colour ? SurfaceReading::Photometric : SurfaceReading::Shading;
    sensor.saturation_gray = i % 2 ? format.max_gray() : format.max_gray() * 9 / 10;
    if (i % 4) sensor.shadow_gray = format.max_gray() / 10 * static_cast<uint32_t>(i % 4 - 1);
    const double w = width, h = height;
    if (i % 5 == 1) sensor.pad = PadEllipse{w / 2, h / 2, w / 3, h / 2, 0.3};
    if (i % 5 == 2) sensor.pad = PadRectangle{1, 2, w - 2, h - 3};
    if (i % 5 == 3) sensor.pad = PadPolygon{{{w * 0.1, h * 0.1}, {w * 0.9, h * 0.3}, {w * 0.5, h * 0.95}}};
    const Answer got = run(image, rest, sensor);
    const std::vector<reference::Known> wanted = reference::confidence(image, rest, sensor);
    ConfidenceCounts counts;
    for (size_t k = 0; k < wanted.size(); ++k) {
      const reference::Known& known = wanted[k];
      const uint32_t reasons = (known.saturated ? shared::kSaturated : 0u) |
                               (known.shadowed ? shared::kShadowed : 0u) |
                               (known.outside ? shared::kOutside : 0u);
      ASSERT_EQ(got.map[k], known.confidence | (reasons << shared::kReasonShift))
          << "scene " << i << ", " << width << " x " << height << " at " << k % width << ", " << k / width;
      ASSERT_FLOAT_EQ(got.weights[k], static_cast<float>(known.confidence) / 255);
      counts.unknown += known.confidence == 0;
      counts.partial += known.confidence > 0 && known.confidence < 255;
      counts.saturated += known.saturated;
      counts.shadowed += known.shadowed;
      counts.outside += known.outside;
    }
    EXPECT_EQ(got.counts, counts) << "scene " << i;
    EXPECT_EQ(got.lowered, !got.only_still) << "scene " << i;
  }
}

// The host says before a frame is submitted what the device will find: few pixels are at a limit,
// next to what is unknown in every frame or apart from it.
TEST_F(ConfidenceTest, TheHostKnowsBefore) {
  std::mt19937 random(22);
  int lowered = 0, still = 0;
  for (int i = 0; i < of_sweep(240, 80); ++i) {
    const bool colour = i % 3 == 0;
    const uint32_t bits = colour ? 8 : std::array{8u, 12u, 16u}[static_cast<size_t>(i / 3) % 3];
    const FrameFormat format{40 + static_cast<uint32_t>(i) % 50, 31, colour ? 3u : 1u, bits};
    Frame rest;
    rest.reshape(format);
    for (uint32_t c = 0; c < format.channels; ++c)
      for (uint32_t y = 0; y < format.height; ++y)
        for (uint32_t x = 0; x < format.width; ++x)
          rest.set(c, x, y,
                   format.max_gray() / 2 + static_cast<uint32_t>(random()) % (format.max_gray() / 8));
    const auto spoil = [&](Frame& frame, uint32_t x, uint32_t y, bool dark) {
      for (uint32_t c = 0; c < format.channels; ++c) frame.set(c, x, y, dark ? 0 : format.max_gray());
    };
    Sensor sensor;
    sensor.pitch_mm_per_px = 0.05;
    sensor.channels = format.channels;
    sensor.bit_depth = bits;
    sensor.reading = colour ? SurfaceReading::Photometric : SurfaceReading::Shading;
    sensor.saturation_gray = i % 2 ? format.max_gray() : format.max_gray() * 9 / 10;
    if (i % 4) sensor.shadow_gray = format.max_gray() / 20 * static_cast<uint32_t>(i % 4);
    for (int n = 0; n < i % 3; ++n)
      for (uint32_t k = 0; k < 9; ++k) spoil(rest, 10 + k % 3, 5 + k / 3, n == 0);
    Frame image = rest;
    // One more, under those that are unknown, at their rim, or elsewhere.
    const auto place = static_cast<uint32_t>(random()) % 5;
    if (place > 0) spoil(image, std::array{0u, 11u, 12u, 14u, 30u}[place], 6, random() % 2 == 0);
    const Answer got = run(image, rest, sensor);
    ASSERT_TRUE(got.lowered.has_value());
    EXPECT_EQ(*got.lowered, !got.only_still) << "scene " << i << ", place " << place;
    ++(*got.lowered ? lowered : still);
  }
  EXPECT_GT(lowered, 20);
  EXPECT_GT(still, 20);
}

TEST(PadOutlineTest, TellsInsideFromOutside) {
  const PadOutline rectangle = PadRectangle{2, 3, 4, 2};
  EXPECT_TRUE(contains(rectangle, 2, 3));
  EXPECT_TRUE(contains(rectangle, 5, 4));
  EXPECT_FALSE(contains(rectangle, 6, 4));
  EXPECT_FALSE(contains(rectangle, 5, 5));
  const PadOutline circle = PadEllipse{10, 10, 5, 5, 0};
  EXPECT_TRUE(contains(circle, 15, 10));
  EXPECT_TRUE(contains(circle, 13, 14));
  EXPECT_FALSE(contains(circle, 14, 14));
  const PadOutline tilted = PadEllipse{0, 0, 10, 1, std::numbers::pi / 4};
  EXPECT_TRUE(contains(tilted, 6, 6));
  EXPECT_FALSE(contains(tilted, 6, -6));
  // An L: the notch is outside, edges and corners are inside.
  const PadOutline polygon = PadPolygon{{{0, 0}, {10, 0}, {10, 4}, {4, 4}, {4, 10}, {0, 10}}};
  EXPECT_TRUE(contains(polygon, 2, 8));
  EXPECT_TRUE(contains(polygon, 8, 2));
  EXPECT_FALSE(contains(polygon, 8, 8));
  EXPECT_TRUE(contains(polygon, 4, 7));
  EXPECT_TRUE(contains(polygon, 0, 0));
  EXPECT_FALSE(contains(polygon, -1, 0));
}

TEST(PadOutlineTest, SensorFileKeepsItAndRefusesWhatIsNone) {
  namespace fs = std::filesystem;
  const fs::path file = fs::temp_directory_path() / ("palpate-pad-" + std::to_string(getpid()) + ".json");
  Sensor sensor;
  sensor.name = "pad";
  sensor.pitch_mm_per_px = 0.05;
  sensor.shadow_gray = 7;
  EXPECT_EQ(shadow_gray(sensor), 7u);
  for (const PadOutline& outline :
       {PadOutline{PadRectangle{1, 2, 30, 40}}, PadOutline{PadEllipse{10, 20, 5, 6, 0.25}},
        PadOutline{PadPolygon{{{0, 0}, {20, 1}, {10, 30}}}}}) {
    sensor.pad = outline;
    save_sensor(sensor, file);
    const Sensor loaded = load_sensor(file);
    ASSERT_TRUE(loaded.pad);
    EXPECT_EQ(loaded.pad->index(), outline.index());
    EXPECT_EQ(loaded.shadow_gray, sensor.shadow_gray);
    for (int y = -2; y < 45; ++y)
      for (int x = -2; x < 45; ++x) ASSERT_EQ(contains(*loaded.pad, x, y), contains(outline, x, y));
  }
  for (const char* pad : {R"({})", R"({"circle_px": [1, 2]})", R"({"circle_px": [1, 2, 0]})",
                          R"({"circle_px": [1, 2, -3]})", R"({"rectangle_px": [0, 0, 0, 5]})",
                          R"({"polygon_px": [[0, 0], [1, 1]]})", R"({"polygon_px": [[0, 0], [1, 1], "x"]})",
                          R"({"circle_px": [1, 2, 3], "rectangle_px": [0, 0, 5, 5]})",
                          R"({"square_px": [0, 0, 5]})", R"([1])"}) {
    std::ofstream(file) << R"({"palpate_sensor": 1, "pitch_mm_per_px": 0.05, "pad": )" << pad << "}";
    try {
      load_sensor(file);
      ADD_FAILURE() << pad << " was taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Sensor) << pad;
      EXPECT_NE(std::string(error.what()).find("pad"), std::string::npos) << error.what();
    }
  }
  fs::remove(file);
}

}  // namespace
}  // namespace palpate
