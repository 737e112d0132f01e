#include "engine/stages/frame/contact.h"

#include <random>

#include "engine/gpu/commands.h"
#include "tests/reference/contact.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/stage_run.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

class ContactTest : public GpuTest {
 protected:
  struct Answer {
    ContactMoments moments;
    std::vector<uint16_t> filtered;  // rows of `pitch` pixels
    uint32_t pitch = 0;
    uint32_t units_per_gray = 0;
  };

  static Answer run(const Frame& image, const Frame& rest, const Sensor& sensor, bool keep) {
    const Contact contact(context(), sensor, image.format, keep, default_tuning(context()));
    PaddedImage frame(context(), "frame", image.format), background(context(), "background", image.format);
    frame.write(image);
    background.write(rest);
    const gpu::DeviceBuffer records(context(), "records", contact.record_bytes(), gpu::Memory::Readback);
    const gpu::DeviceBuffer filtered(context(), "filtered", contact.filtered().bytes(),
                                     gpu::Memory::Readback);
    gpu::Commands commands(context());
    commands.begin();
    frame.record(commands);
    background.record(commands);
    commands.barrier();
    contact.record(commands, frame, background, records);
    commands.copy(contact.filtered(), filtered, filtered.bytes());
    commands.host_barrier();
    commands.end();
    commands.submit();
    commands.wait();
    Answer answer;
    answer.moments = contact.sum(records.as<const shared::ContactRecord>());
    const auto words = filtered.as<const uint16_t>();
    answer.filtered.assign(words.begin(), words.end());
    answer.pitch = contact.tiles_x() * contact.tile_columns();
    answer.units_per_gray = contact.filtered_units_per_gray();
    return answer;
  }

  static void expect_equal(const ContactMoments& got, const ContactMoments& wanted,
                           const std::string& scene) {
    EXPECT_EQ(got.area, wanted.area) << scene;
    EXPECT_EQ(got.gray, wanted.gray) << scene;
    EXPECT_EQ(got.gray_x, wanted.gray_x) << scene;
    EXPECT_EQ(got.gray_y, wanted.gray_y) << scene;
    EXPECT_EQ(got.x, wanted.x) << scene;
    EXPECT_EQ(got.y, wanted.y) << scene;
    EXPECT_EQ(got.xx, wanted.xx) << scene;
    EXPECT_EQ(got.xy, wanted.xy) << scene;
    EXPECT_EQ(got.yy, wanted.yy) << scene;
    EXPECT_EQ(got.peak, wanted.peak) << scene;
    EXPECT_EQ(got.saturated, wanted.saturated) << scene;
    EXPECT_EQ(got.border, wanted.border) << scene;
  }
};

// Random frames of all sizes, depths, signals and thresholds: equal to the reference to the last bit. A
// kernel is compiled for each.
TEST_F(ContactTest, EqualsReferenceExactly) {
  std::mt19937 random(1);
  const std::array<uint32_t, 12> sides{1, 2, 3, 5, 15, 16, 17, 31, 33, 64, 67, 129};
  const auto pick = [&](const auto& list) { return list[random() % list.size()]; };
  const auto run_scene = [&](uint32_t width, uint32_t height, uint32_t channels, uint32_t bits) {
    const FrameFormat format{width, height, channels, bits};
    Sensor sensor;
    sensor.pitch_mm_per_px = 0.1;
    sensor.channels = channels;
    sensor.bit_depth = bits;
    sensor.signal = pick(std::array{Signal::Brighter, Signal::Darker, Signal::Either});
    const uint32_t top = format.max_gray();
    sensor.threshold_gray = pick(std::array{0.0, 1.0 / 128, 0.3 * top, 0.25 * top, 1.0 * top});
    sensor.saturation_gray = pick(std::array<uint32_t, 3>{top, top / 2, 1});
    const uint32_t low = pick(std::array<uint32_t, 2>{0, top / 3}),
                   high = pick(std::array<uint32_t, 3>{top, top / 2, top * 3 / 4});
    const Frame image = random_frame(format, std::min(low, high), high, random);
    const Frame rest = random_frame(format, 0, pick(std::array<uint32_t, 3>{0, top / 4, top}), random);
    const std::string scene = std::to_string(width) + "x" + std::to_string(height) + "x" +
                              std::to_string(channels) + " bits " + std::to_string(bits) + " signal " +
                              to_string(sensor.signal) + " threshold " +
                              std::to_string(sensor.threshold_gray);
    expect_equal(run(image, rest, sensor, false).moments, reference::moments(image, rest, sensor), scene);
  };
  for (int i = 0; i < of_sweep(300, 100) && !HasFailure(); ++i) {
    const bool color = i % 4 == 3;
    run_scene(pick(sides), pick(sides), color ? 3 : 1,
              color ? 8 : pick(std::array<uint32_t, 4>{8, 10, 12, 16}));
  }
  for (const auto& [width, height] :
       {std::pair{1u, 1u}, {1u, 2u}, {2u, 1u}, {3u, 3u}, {640u, 480u}, {1391u, 131u}}) {
    for (const uint32_t bits : {8u, 12u, 16u}) run_scene(width, height, 1, bits);
    run_scene(width, height, 3, 8);
  }
}

// Parts that a sensor leaves out change the kernel, not the sums: without the filter, without an untouched
// image, without both, in every format.
TEST_F(ContactTest, WithoutFilterOrBackgroundEqualsReferenceExactly) {
  std::mt19937 random(4);
  const std::array<uint32_t, 12> sides{1, 2, 3, 5, 15, 16, 17, 31, 33, 64, 67, 129};
  const auto pick = [&](const auto& list) { return list[random() % list.size()]; };
  const std::array<std::pair<Filter, BackgroundKind>, 3> leaner{std::pair{Filter::None, BackgroundKind::None},
                                                                {Filter::None, BackgroundKind::Untouched},
                                                                {Filter::Binomial5, BackgroundKind::None}};
  const auto run_scene = [&](uint32_t width, uint32_t height, uint32_t channels, uint32_t bits,
                             const std::pair<Filter, BackgroundKind>& form) {
    const FrameFormat format{width, height, channels, bits};
    Sensor sensor;
    sensor.name = "lean";
    sensor.pitch_mm_per_px = 0.1;
    sensor.channels = channels;
    sensor.bit_depth = bits;
    sensor.filter = form.first;
    sensor.background.kind = form.second;
    const bool subtracts = form.second == BackgroundKind::Untouched;
    sensor.signal = pick(std::array{Signal::Brighter, Signal::Either, Signal::Darker});
    if (!subtracts && sensor.signal == Signal::Darker) sensor.signal = Signal::Brighter;
    const uint32_t top = format.max_gray();
    sensor.threshold_gray = pick(std::array{0.0, 1.0 / 128, 0.3 * top, 127.0, 127.0 + 1.0 / 128, 128.0,
                                            std::floor(0.75 * top), 1.0 * top});
    sensor.saturation_gray = pick(std::array<uint32_t, 5>{top, top / 2, top / 2 + 1, 1, 127});
    ASSERT_NO_THROW(validate(sensor, "lean"));
    const Frame image = random_frame(format, 0, pick(std::array<uint32_t, 3>{top, top / 2, top / 4}), random);
    // The buffer bound in place of a background must not matter.
    const Frame bound = random_frame(format, 0, top / 4, random);
    const Frame rest = subtracts ? bound : random_frame(format, 0, 0, random);
    const std::string scene =
        std::to_string(width) + "x" + std::to_string(height) + "x" + std::to_string(channels) + " bits " +
        std::to_string(bits) + " filter " + to_string(sensor.filter) + " background " +
        to_string(form.second) + " signal " + to_string(sensor.signal) + " threshold " +
        std::to_string(sensor.threshold_gray) + " saturation " + std::to_string(sensor.saturation_gray);
    expect_equal(run(image, bound, sensor, false).moments, reference::moments(image, rest, sensor), scene);
  };
  for (int i = 0; i < of_sweep(150, 50) && !HasFailure(); ++i) {
    const bool color = i % 8 == 7;
    run_scene(pick(sides), pick(sides), color ? 3 : 1,
              color ? 8 : pick(std::array<uint32_t, 6>{8, 8, 8, 10, 12, 16}), leaner[i % 3]);
  }
  for (const auto& form : leaner) {
    for (const auto& [width, height] : {std::pair{1u, 1u}, {3u, 3u}, {640u, 480u}, {1391u, 131u}}) {
      for (const uint32_t bits : {8u, 12u, 16u}) run_scene(width, height, 1, bits, form);
      run_scene(width, height, 3, 8, form);
    }
  }
}

// One bright pixel anywhere in a frame: the border is the outermost rows and columns, no more, in every form.
TEST_F(ContactTest, BorderIsTheOutermostRowsAndColumns) {
  for (const Filter filter : {Filter::Binomial5, Filter::None}) {
    for (const BackgroundKind kind : {BackgroundKind::Untouched, BackgroundKind::None}) {
      for (const uint32_t bits : {8u, 16u}) {
        for (const auto& [width, height] : {std::pair{35u, 66u}, {1u, 5u}}) {
          const FrameFormat format{width, height, 1, bits};
          Sensor sensor;
          sensor.pitch_mm_per_px = 0.1;
          sensor.bit_depth = bits;
          sensor.saturation_gray = format.max_gray();
          sensor.filter = filter;
          sensor.background.kind = kind;
          // With the filter a pixel's own weight is 36/256 and its neighbours' 24/256.
          sensor.threshold_gray = format.max_gray() * (filter == Filter::None ? 0.5 : 30.0 / 256);
          const Contact contact(context(), sensor, format, false, default_tuning(context()));
          PaddedImage frame(context(), "frame", format), rest(context(), "background", format);
          Frame image, black;
          image.reshape(format);
          black.reshape(format);
          rest.write(black);
          const gpu::DeviceBuffer records(context(), "records", contact.record_bytes(),
                                          gpu::Memory::Readback);
          gpu::Commands commands(context());
          commands.begin();
          frame.record(commands);
          rest.record(commands);
          commands.barrier();
          contact.record(commands, frame, rest, records);
          commands.host_barrier();
          commands.end();
          for (const uint32_t x : {0u, 1u, width / 2, width - 2, width - 1}) {
            for (const uint32_t y : {0u, 1u, height / 2, height - 2, height - 1}) {
              if (x >= width || y >= height) continue;
              image.set(0, x, y, format.max_gray());
              frame.write(image);
              commands.submit();
              commands.wait();
              records.invalidate();
              EXPECT_EQ(contact.sum(records.as<const shared::ContactRecord>()).border,
                        reference::moments(image, black, sensor).border)
                  << width << "x" << height << " " << bits << " bits, filter " << to_string(filter) << " at "
                  << x << ", " << y;
              image.set(0, x, y, 0);
            }
          }
        }
      }
    }
  }
}

TEST_F(ContactTest, FilteredImageEqualsReference) {
  std::mt19937 random(3);
  for (const uint32_t bits : {8u, 12u, 16u}) {
    const FrameFormat format{77, 45, 1, bits};
    const Frame image = random_frame(format, 0, format.max_gray(), random),
                rest = random_frame(format, 0, format.max_gray(), random);
    Sensor sensor;
    sensor.pitch_mm_per_px = 1;
    sensor.bit_depth = bits;
    sensor.saturation_gray = format.max_gray();
    const Answer answer = run(image, rest, sensor, true);
    const auto wanted = reference::filtered_change(image, rest, sensor.signal);
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x)
        ASSERT_EQ(answer.filtered[y * answer.pitch + x],
                  wanted[y * format.width + x] * answer.units_per_gray / 256)
            << bits << " bits at " << x << ", " << y;
  }
}

}  // namespace
}  // namespace palpate
