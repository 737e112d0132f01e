#include "capture/run/input.h"

#include <memory>

#include "capture/camera/camera_options.h"
#include "capture/open_source.h"
#include "capture/session/session.h"
#include "capture/synthetic/object.h"
#include "capture/synthetic/synthetic.h"
#include "capture/synthetic/tissue.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {

namespace {

bool is_synthetic(const std::string& input) {
  return input.starts_with("synthetic:");
}

bool shows_colour(const Frame& frame) {
  for (uint32_t y = 0; y < frame.format.height; ++y)
    for (uint32_t x = 0; x < frame.format.width; ++x)
      if (frame.at(0, x, y) != frame.at(1, x, y) || frame.at(0, x, y) != frame.at(2, x, y)) return true;
  return false;
}

/// One that takes the frames of `input` as they are: with the channels and bits that it states, or none where
/// its images say them.
Sensor sensor_of_any(const std::string& input) {
  FrameFormat format{.width = 0, .height = 0, .channels = 0, .bit_depth = 0};
  if (is_session(input)) format = Session(input).info().format;
  if (is_camera(input)) format = camera_format(input);
  if (is_synthetic(input)) return find_input(1, input, std::filesystem::path()).sensor;
  Sensor sensor = uncalibrated_sensor({.width = 0, .height = 0});
  sensor.channels = format.channels;
  sensor.bit_depth = format.bit_depth;
  return sensor;
}

}  // namespace

Sensor bare_sensor(const std::string& input) {
  const std::unique_ptr<Source> source = open_source(input, sensor_of_any(input));
  FrameFormat format = source->format();
  Frame frame;
  if (format.channels == 3 && source->next(frame) && !shows_colour(frame)) format.channels = 1;
  Sensor sensor = uncalibrated_sensor(format);
  sensor.name = "uncalibrated sensor";
  if (source->rate_Hz() <= 0) sensor.background.first_frames = 1;  // pictures: each is another touch
  return sensor;
}

Sensor sensor_to_calibrate(const std::string& input, const std::filesystem::path& file, ToMake to_make,
                           double pitch_mm_per_px) {
  Sensor sensor = file.empty() ? bare_sensor(input) : load_sensor(file, to_make);
  if (pitch_mm_per_px > 0) {
    sensor.pitch_mm_per_px = pitch_mm_per_px;
    sensor.pitch_sd_mm_per_px = 0;
  }
  if (to_make == ToMake::Reading && !has_scale(sensor))
    throw Error(Failure::Usage, "the scale of the pictures", "none",
                "--pitch MM_PER_PX, or palpate calibrate scale first");
  return sensor;
}

MeasuredInput find_input(uint64_t seed, const std::string& input, const std::filesystem::path& sensor_file,
                         const std::filesystem::path& background) {
  return find_input(seed, input, sensor_file.empty() ? std::optional<Sensor>() : load_sensor(sensor_file),
                    background);
}

MeasuredInput find_input(uint64_t seed, const std::string& input, const std::optional<Sensor>& sensor,
                         const std::filesystem::path& background) {
  MeasuredInput found{.input = input, .sensor = {}, .session = {}};
  const bool synthetic = is_synthetic(input);
  if (is_session(input)) found.session = Session(input).info();
  if (sensor) {
    found.sensor = *sensor;
  } else if (is_camera(input)) {
    found.sensor = uncalibrated_sensor(camera_format(input));
  } else if (found.session) {
    found.sensor = found.session->sensor.value_or(uncalibrated_sensor(found.session->format));
  } else if (!synthetic) {
    found.sensor = bare_sensor(input);
  }
  if (is_tissue(input)) {
    TissueOptions options = parse_tissue(input);
    if (input.find("seed=") == std::string::npos) options.seed = seed;
    found.input = to_string(options);
    if (!sensor) found.sensor = tissue_sensor(options);
  } else if (is_object(input)) {
    ObjectOptions options = parse_object(input);
    if (input.find("seed=") == std::string::npos) options.camera.seed = seed;
    found.input = to_string(options);
    if (!sensor) found.sensor = object_sensor(options);
  } else if (synthetic) {
    SyntheticOptions options = parse_synthetic(input);
    if (input.find("seed=") == std::string::npos) options.seed = seed;
    found.input = to_string(options);
    if (!sensor) found.sensor = synthetic_sensor(options);
  }
  if (!background.empty()) found.sensor.background.image = std::filesystem::absolute(background).string();
  found.outputs = Output::Force | Output::Contacts;
  if (found.sensor.skin && found.sensor.background.kind == BackgroundKind::Untouched)
    found.outputs |= Output::Skin;
  if (found.sensor.reading != SurfaceReading::None) found.outputs |= Output::Surface;
  if (found.sensor.layer && wants(found.outputs, Output::Surface)) found.outputs |= Output::Traction;
  return found;
}

std::string unused_rate(const Source& source, double rate_Hz) {
  if (rate_Hz <= 0 || source.rate_Hz() <= 0) return {};
  return text("the rate of %g frames/s is not used: the recording has times of its own (%.4g frames/s)",
              rate_Hz, source.rate_Hz());
}

Outputs outputs_of(std::span<const Output> asked) {
  Outputs outputs;
  for (const Output one : asked) outputs |= one;
  if (wants(outputs, Output::Contacts) || wants(outputs, Output::Skin)) outputs |= Output::Force;
  return outputs;
}

const char* to_string(SurfaceSolver solver) {
  for (const auto& [name, value] : kSolverNames) {
    if (value == solver) return name.c_str();
  }
  return "";
}

}  // namespace palpate
