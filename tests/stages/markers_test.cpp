// The markers stage: it finds and fills what plain loops do, to the last bit.
#include "engine/stages/frame/markers.h"

#include <gtest/gtest.h>

#include "tests/reference/markers.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/stage_run.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

Sensor marked_sensor(double size_px, double spacing_px) {
  Sensor sensor;
  sensor.skin = SkinPattern{SkinKind::Markers, spacing_px, size_px, 0};
  return sensor;
}

/// A smooth image with noise under dots that a lattice prints, moved by `shift`.
Frame dotted(const FrameFormat& format, double size_px, double spacing_px, double shift_px,
             std::mt19937& random) {
  std::normal_distribution<double> noise(0, 1.5);
  Frame frame;
  frame.reshape(format);
  for (uint32_t y = 0; y < format.height; ++y)
    for (uint32_t x = 0; x < format.width; ++x) {
      const double u = x - shift_px - spacing_px / 2, v = y + shift_px / 2 - spacing_px / 2;
      const double away = std::hypot(u - spacing_px * std::round(u / spacing_px),
                                     v - spacing_px * std::round(v / spacing_px));
      const double light = 1 - 0.6 * std::clamp(size_px / 2 - away + 0.5, 0.0, 1.0);
      for (uint32_t c = 0; c < 3; ++c) {
        const double plain = 120 + 50 * std::sin(0.02 * (c + 1.0) * x + 0.03 * y + c);
        frame.set(c, x, y, static_cast<uint32_t>(std::clamp(plain * light + noise(random), 0.0, 255.0)));
      }
    }
  return frame;
}

class MarkersStage : public GpuTest {
 protected:
  struct Answer {
    Frame frame, rest;
    MarkerCounts counts;
    std::vector<uint32_t> unknown;
    uint32_t words = 0;
    shared::MarkersPush push;
  };

  static Frame unpadded(const PaddedImage& image, const FrameFormat& format) {
    const PaddedLayout layout(format);
    const gpu::DeviceBuffer staging(context(), "image", layout.bytes, gpu::Memory::Readback);
    copy_out(image.buffer(), staging);
    const auto bytes = staging.as<const uint8_t>();
    Frame frame;
    frame.reshape(format);
    for (uint32_t c = 0; c < 3; ++c)
      for (uint32_t y = 0; y < format.height; ++y) {
        const uint8_t* row = bytes.data() + size_t{c * format.height + y} * layout.pitch * 16;
        std::copy_n(row + 16, format.width, frame.row(c, y));
        // Padded with copies of the edge pixels, as kernels expect.
        for (uint32_t x = 0; x < 16; ++x) EXPECT_EQ(row[x], row[16]) << "row " << y;
        for (uint32_t x = 16 + format.width; x < layout.pitch * 16; ++x)
          EXPECT_EQ(row[x], row[15 + format.width]) << "row " << y;
      }
    return frame;
  }

  static void copy_out(const gpu::DeviceBuffer& from, const gpu::DeviceBuffer& to) {
    gpu::Commands commands(context());
    commands.begin();
    commands.copy(from, to, to.bytes());
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    to.invalidate();
  }

  static Answer run(const Frame& image, const Frame& rest, const Sensor& sensor) {
    const FrameFormat& format = image.format;
    Markers stage(context(), sensor, format);
    FrameOnGpu images(context(), format);
    images.write(image, rest);
    gpu::Commands upload(context());
    upload.begin();
    images.record(upload);
    upload.end();
    upload.submit();
    upload.wait();
    Answer answer;
    answer.rest = stage.set_background(rest, images.background);
    const Markers::Slot slot(context(), format, stage.record_bytes());
    gpu::Commands commands(context());
    commands.begin();
    stage.record(commands, images.frame, images.background, slot);
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    slot.records.invalidate();
    answer.counts = stage.sum(slot.records.as<const uint32_t>());
    answer.frame = unpadded(slot.frame, format);
    answer.push = stage.push();
    return answer;
  }

  static void expect_same(const Frame& image, const Frame& rest, const Sensor& sensor,
                          const std::string& what) {
    const Answer got = run(image, rest, sensor);
    const reference::Filled untouched = reference::fill_markers(rest, nullptr, nullptr, got.push);
    const reference::Filled wanted =
        reference::fill_markers(image, &untouched.frame, &untouched.marked, got.push);
    const auto differing = [](const Frame& a, const Frame& b) {
      size_t count = 0;
      for (uint32_t c = 0; c < 3; ++c)
        for (uint32_t y = 0; y < a.format.height; ++y)
          for (uint32_t x = 0; x < a.format.width; ++x) count += a.at(c, x, y) != b.at(c, x, y);
      return count;
    };
    EXPECT_EQ(differing(got.rest, untouched.frame), 0u) << what << ": untouched";
    EXPECT_EQ(differing(got.frame, wanted.frame), 0u) << what;
    const auto total = [&](const reference::Mask& mask) {
      return uint64_t{got.push.cell} * got.push.cell *
             std::accumulate(mask.values.begin(), mask.values.end(), uint64_t{0});
    };
    EXPECT_EQ(got.counts.marked, total(wanted.marked)) << what;
    EXPECT_EQ(got.counts.unknown, total(wanted.unknown)) << what;
  }
};

TEST_F(MarkersStage, EqualsPlainLoops) {
  std::mt19937 random(11);
  using Size = std::array<uint32_t, 2>;
  for (const auto& [width, height] :
       part_of<Size>({{379, 277}, {64, 64}, {65, 63}, {16, 4}, {1, 1}, {200, 90}, {17, 33}}, 2))
    for (const double size : {5.0, 9.0, 30.0}) {
      const FrameFormat format{width, height, 3, 8};
      const double spacing = 2.3 * size;
      const Sensor sensor = marked_sensor(size, spacing);
      const std::string what = std::to_string(width) + " x " + std::to_string(height) + ", dots of " +
                               std::to_string(size) + " px";
      const Frame rest = dotted(format, size, spacing, 0, random);
      expect_same(dotted(format, size, spacing, 0.7 * size, random), rest, sensor, what);
      expect_same(random_frame(format, 0, 255, random), rest, sensor, what + ", noise");
      expect_same(uniform_frame(format, 0), rest, sensor, what + ", black");
    }
}

TEST_F(MarkersStage, LeavesAnImageWithoutDotsAsItIs) {
  std::mt19937 random(3);
  const FrameFormat format{210, 130, 3, 8};
  const Frame rest = dotted(format, 0, 20, 0, random), image = dotted(format, 9, 20, 0, random);
  EXPECT_EQ(marker_darkness(rest, {SkinKind::Markers, 20, 8, 0}), 0);
  const Answer got = run(image, rest, marked_sensor(8, 20));
  EXPECT_EQ(got.counts.marked, 0u);
  EXPECT_EQ(std::memcmp(got.frame.pixels(), image.pixels(), format.frame_bytes()), 0);
}

TEST_F(MarkersStage, ContinuesWhatLiesBesideTheDots) {
  std::mt19937 random(5);
  const FrameFormat format{320, 240, 3, 8};
  for (const double share : {0.3, 0.45, 0.6}) {
    const double spacing = 24, size = share * spacing;
    const Frame rest = dotted(format, size, spacing, 0, random),
                image = dotted(format, size, spacing, 3, random),
                plain = dotted(format, 0, spacing, 0, random);
    const Answer got = run(image, rest, marked_sensor(size, spacing));
    double before = 0, after = 0, untouched = 0;
    size_t count = 0;
    for (uint32_t c = 0; c < 3; ++c)
      for (uint32_t y = 20; y + 20 < format.height; ++y)
        for (uint32_t x = 20; x + 20 < format.width; ++x, ++count) {
          before += std::pow(image.at(c, x, y) - double(rest.at(c, x, y)), 2);
          after += std::pow(got.frame.at(c, x, y) - double(got.rest.at(c, x, y)), 2);
          untouched += std::pow(got.rest.at(c, x, y) - double(plain.at(c, x, y)), 2);
        }
    const auto rms = [&](double sum) { return std::sqrt(sum / static_cast<double>(count)); };
    std::printf(
        "dots of %4.1f px every %2.0f px: change by moving them %5.2f gray RMS, filled %5.2f; untouched "
        "image %.2f\n",
        size, spacing, rms(before), rms(after), rms(untouched));
    EXPECT_LT(rms(after), 2.5) << "noise alone makes 2.1";
    EXPECT_LT(rms(untouched), 8);
    EXPECT_LT(rms(after), 0.2 * rms(before));
    EXPECT_EQ(got.counts.unknown, 0u);
  }
}

TEST_F(MarkersStage, SaysWhereNothingIsLeftToContinueFrom) {
  std::mt19937 random(7);
  const FrameFormat format{320, 240, 3, 8};
  const Frame rest = dotted(format, 10, 24, 0, random);
  Frame image = rest;
  // A blot much larger than a dot, as a dark object against a torn skin.
  for (uint32_t c = 0; c < 3; ++c)
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < 160; ++x) image.set(c, x, y, (x / 4 + y / 4) % 8 == 0 ? 150 : 15);
  const Answer got = run(image, rest, marked_sensor(10, 24));
  EXPECT_GT(got.counts.unknown, format.width * format.height / 4);
  // There the frame says nothing: it is the untouched image.
  EXPECT_EQ(got.frame.at(1, 80, 120), got.rest.at(1, 80, 120));
}

}  // namespace
}  // namespace palpate
