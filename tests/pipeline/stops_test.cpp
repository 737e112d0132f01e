// Stops of a frame: how often the thread that submits and collects it waits for the device, for every shipped
// sensor, every output and each way to solve its surface.
#include "engine/gpu/stops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "tests/scenes/synthetic_run.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/pipelines.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr Solve kSolves[] = {Solve::Live, Solve::Converged, Solve::Exact};

struct OutputSet {
  const char* name;
  Outputs outputs;
};
constexpr OutputSet kOutputs[] = {
    {"force", Output::Force | Output::Gradient},
    {"skin", Output::Force | Output::Contacts | Output::Skin},
    {"surface", Output::Force | Output::Surface},
    {"contacts, surface", Output::Force | Output::Contacts | Output::Surface},
    {"weights", Output::Force | Output::Contacts | Output::Surface | Output::Confidence},
    {"traction", Output::Force | Output::Contacts | Output::Surface | Output::Traction},
    {"all", Output::Force | Output::Contacts | Output::Surface | Output::Confidence | Output::Traction},
};

/// Frames of a sensor that touch comes to, leaves and comes back to, the last time with a highlight.
struct Pressed {
  Sensor sensor;
  Frame untouched;
  std::vector<Frame> frames;
};

void paint(Frame& frame, double x_share, double radius_share, int change) {
  const FrameFormat& f = frame.format;
  const double radius = radius_share * f.height;
  const int most = static_cast<int>(f.max_gray());
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x) {
      const double across = x - x_share * f.width, down = y - 0.5 * f.height;
      if (std::hypot(across, down) > radius) continue;
      for (uint32_t c = 0; c < f.channels; ++c) {
        // A dent's sides face both ways.
        const double slope = f.channels == 1 ? 1 : (c == 1 ? down : across) / radius;
        const int gray = static_cast<int>(frame.at(c, x, y)) + static_cast<int>(change * slope);
        frame.set(c, x, y, static_cast<uint32_t>(std::clamp(gray, 0, most)));
      }
    }
}

/// Dark dots, as they are printed on a skin.
void print_markers(Frame& frame, double spacing_px) {
  const FrameFormat& f = frame.format;
  for (uint32_t y = 0; y < f.height; ++y)
    for (uint32_t x = 0; x < f.width; ++x) {
      const double across = std::remainder(x, spacing_px), down = std::remainder(y, spacing_px);
      for (uint32_t c = 0; c < f.channels && std::hypot(across, down) < 0.2 * spacing_px; ++c)
        frame.set(c, x, y, 25);
    }
}

/// A sensor as it is shipped, with a layer where it has none.
Pressed frames_of(Sensor sensor) {
  if (!sensor.layer && sensor.pitch_mm_per_px > 0)
    sensor.layer = LayerCalibration{.young_MPa = 0.15, .poisson = 0.48, .thickness_mm = 3};
  FrameFormat format{320, 240, sensor.channels, sensor.bit_depth};
  if (sensor.size_px[0] > 0) format.width = sensor.size_px[0], format.height = sensor.size_px[1];
  Pressed made{sensor, {}, {}};
  made.untouched.reshape(format);
  for (uint32_t c = 0; c < format.channels; ++c)
    for (uint32_t y = 0; y < format.height; ++y)
      for (uint32_t x = 0; x < format.width; ++x)
        made.untouched.set(c, x, y, (90 + (7 * x + 3 * y + 11 * c) % 5) << (format.bit_depth - 8));
  if (sensor.skin && sensor.skin->kind == SkinKind::Markers)
    print_markers(made.untouched, sensor.skin->spacing_px);
  const int change =
      (sensor.signal == Signal::Darker ? -50 : 50) * (1 << (static_cast<int>(format.bit_depth) - 8));
  for (const bool touched : {false, true, true, false, true, true}) {
    Frame& frame = made.frames.emplace_back(made.untouched);
    frame.sequence = made.frames.size();
    if (touched) paint(frame, 0.5, 0.2, change);
    if (made.frames.size() == 6) paint(frame, 0.2, 0.05, 1 << format.bit_depth);
  }
  return made;
}

Pressed frames_of(SyntheticRun& run) {
  Pressed made{run.sensor, run.background, {}};
  for (const uint64_t share : {0, 10, 11, 1, 12})
    made.frames.push_back(run.frame(std::min(run.count() - 1, run.count() * share / 20)));
  paint(made.frames.emplace_back(made.frames.back()), 0.2, 0.05, 1 << run.background.format.bit_depth);
  return made;
}

class StopsTest : public GpuTest {
 protected:
  struct Most : gpu::Stops {
    bool touched = false;  ///< some frame
  };
  static std::optional<Pipeline> pipeline_of(const Pressed& of, Outputs outputs, Solve solve) {
    try {
      Pipeline made(context(), of.sensor, of.untouched.format,
                    solved(solve, {.outputs = outputs, .slots = 2, .any_picture = true}));
      made.set_background(of.sensor.background.kind == BackgroundKind::None ? Frame{} : of.untouched);
      return made;
    } catch (const Error&) {
      return std::nullopt;
    }
  }
  /// Stops of the frame that makes most; none where the sensor has not what the outputs need.
  static std::optional<Most> most_of_a_frame(const Pressed& of, Outputs outputs, Solve solve) {
    std::optional<Pipeline> pipeline = pipeline_of(of, outputs, solve);
    if (!pipeline) return std::nullopt;
    Most most;
    for (const Frame& frame : of.frames) {
      const gpu::Stops before = gpu::stops();
      most.touched = pipeline->process(frame).touch.contact || most.touched;
      const gpu::Stops here = gpu::stops() - before;
      most.submits = std::max(most.submits, here.submits);
      most.waits = std::max(most.waits, here.waits);
    }
    return most;
  }

  static void expect_few(const std::vector<Pressed>& sensors) {
    for (const OutputSet& set : kOutputs) {
      uint64_t waits = 0, submits = 0, measured = 0, touched = 0;
      for (const Pressed& of : sensors)
        for (const Solve solve : kSolves) {
          if (solve != Solve::Live && !wants(set.outputs, Output::Surface)) continue;
          const auto most = most_of_a_frame(of, set.outputs, solve);
          if (!most) continue;
          ++measured;
          touched += most->touched;
          waits = std::max(waits, most->waits);
          submits = std::max(submits, most->submits);
          EXPECT_LE(most->waits, most_waits(of.sensor, set.outputs, solve))
              << of.sensor.name << ", " << set.name << ", solved way " << static_cast<int>(solve);
        }
      EXPECT_GE(2 * touched, measured) << set.name << ": most are to be touched";
      std::printf("%-18s %2llu pipelines, at most %llu waits and %llu submits a frame\n", set.name,
                  static_cast<unsigned long long>(measured), static_cast<unsigned long long>(waits),
                  static_cast<unsigned long long>(submits));
    }
  }

  /// The device's traction starts from contacts that the host has found. Where unknown pixels come or go
  /// under printed markers, which only the device fills, the surface is solved again.
  static uint64_t most_waits(const Sensor& sensor, Outputs outputs, Solve solve) {
    const bool device = solve != Solve::Exact, again = has_markers(sensor);
    return 1 + (device && wants(outputs, Output::Traction)) +
           (device && again && wants(outputs, Output::Confidence));
  }
  static bool has_markers(const Sensor& sensor) {
    return sensor.skin && sensor.skin->kind == SkinKind::Markers;
  }
};

TEST_F(StopsTest, SimulatedSensors) {
  std::vector<Pressed> sensors;
  for (const char* scene :
       {"press?mode=gel&size=320x240", "press?mode=waveguide&size=320x240", "press?mode=lambert&size=320x240",
        "drag?mode=gel&size=320x240&skin=markers", "drag?mode=waveguide&size=320x240&skin=texture"}) {
    SyntheticRun run(scene);
    sensors.push_back(frames_of(run));
  }
  expect_few(sensors);
}

TEST_F(StopsTest, EveryShippedSensor) {
  std::vector<Pressed> sensors;
  for (const auto& entry : fs::directory_iterator(fs::path(PALPATE_SOURCE_DIR) / "capture/sensors"))
    if (entry.path().extension() == ".json") sensors.push_back(frames_of(load_sensor(entry.path())));
  EXPECT_GE(sensors.size(), 5u);
  expect_few(sensors);
}

}  // namespace
}  // namespace palpate
