#include "engine/sensor/fit.h"

#include <string>
#include <utility>

#include "engine/sensor/outline.h"
#include "palpate/error.h"
#include "palpate/options.h"

namespace palpate {
namespace {

constexpr uint32_t kLeastTraction_px = 8;  // two cells each way

void require(bool fits, const Sensor& sensor, const std::string& wanted, const std::string& found,
             const std::string& remedy) {
  if (!fits) throw Error(Failure::Sensor, "sensor '" + sensor.name + "' with " + wanted, found, remedy);
}

std::string size_text(uint32_t width, uint32_t height) {
  return std::to_string(width) + " x " + std::to_string(height) + " px";
}

// Millimetres and places are those of the rectified frame: an image as the camera gives it would be measured
// with all of them wrong.
void require_rectified(const Sensor& sensor, const FrameFormat& format) {
  std::string missing;
  const auto add = [&](bool wanted, const char* key) {
    if (wanted) missing += (missing.empty() ? "" : ", ") + std::string(key);
  };
  add(sensor.crop_px.has_value(), "crop_px");
  add(sensor.lens.has_value(), "lens");
  add(sensor.quad_px.has_value(), "quad_px");
  add(sensor.flat.has_value(), "flat");
  require(missing.empty(), sensor, "frames that are rectified already",
          "frame." + missing + " still to apply",
          "capture/rectify.h for the frames, for_rectified_frames(sensor) for the pipeline");
  for (const auto& [key, size] : {std::pair{"size_px", sensor.size_px}, {"camera_px", sensor.camera_px}})
    require(size[0] == 0 || (size[0] == format.width && size[1] == format.height), sensor,
            "frames of its frame." + std::string(key) + ", " + size_text(size[0], size[1]),
            size_text(format.width, format.height), "the sensor file that belongs to this camera mode");
}

}  // namespace

void check_fit(const Sensor& sensor, const FrameFormat& format, Outputs outputs) {
  const uint64_t pixels = uint64_t{format.width} * format.height;
  require(
      pixels > 0 && pixels <= kMaxPixels && format.width <= kMaxSide_px && format.height <= kMaxSide_px,
      sensor,
      "frames of 1 to " + std::to_string(kMaxPixels) + " pixels, sides up to " + std::to_string(kMaxSide_px),
      std::to_string(format.width) + " x " + std::to_string(format.height), "a crop in the sensor file");
  require(format.channels == 1 || (format.channels == 3 && format.bit_depth == 8), sensor,
          "gray frames, or colour of 8 bits",
          std::to_string(format.channels) + " channels of " + std::to_string(format.bit_depth) + " bits",
          "channels 1, or bit_depth 8");
  require(
      format.channels == sensor.channels && format.bit_depth == sensor.bit_depth, sensor,
      "its " + std::to_string(sensor.channels) + " channels of " + std::to_string(sensor.bit_depth) + " bits",
      "frames of " + std::to_string(format.channels) + " channels of " + std::to_string(format.bit_depth) +
          " bits",
      "frame.channels and frame.bit_depth in the sensor file");
  require_rectified(sensor, format);
  if (sensor.pad) {
    bool seen = false;
    for (uint32_t y = 0; y < format.height && !seen; ++y)
      for (uint32_t x = 0; x < format.width && !seen; ++x) seen = contains(*sensor.pad, x, y);
    require(seen, sensor, "a pad outline that covers some pixel",
            "none inside " + std::to_string(format.width) + " x " + std::to_string(format.height) + " px",
            "'pad' in px of the rectified frame");
  }
  if (follows_skin(sensor, wants(outputs, Output::Skin), wants(outputs, Output::Force))) {
    require(sensor.skin.has_value(), sensor, "a pattern on the skin", "none",
            "'skin' in the sensor file, or outputs without skin");
    require(sensor.background.kind == BackgroundKind::Untouched, sensor,
            "an untouched image in which the skin's pattern is found", "background.source 'none'",
            "'untouched', or outputs without skin");
  }
  require(!wants(outputs, Output::Gradient) || format.bit_depth == 8, sensor,
          "frames of 8 bits, for the sum of gradients", std::to_string(format.bit_depth) + " bits",
          "outputs without it");
  if (wants(outputs, Output::Traction)) {
    require(wants(outputs, Output::Surface), sensor, "the output surface with traction", "traction alone",
            "asking for both");
    require(layer_of(sensor).has_value(), sensor, "an elastic layer, for traction", "none",
            "'layer' in the sensor file (young_MPa, poisson, thickness_mm), or outputs without traction");
    require(format.width >= kLeastTraction_px && format.height >= kLeastTraction_px, sensor,
            "frames of 8 x 8 px or more, for traction",
            std::to_string(format.width) + " x " + std::to_string(format.height), "outputs without traction");
  }
  if (wants(outputs, Output::Motion)) {
    require(wants(outputs, Output::Surface), sensor, "the output surface with motion", "motion alone",
            "asking for both");
    require(has_scale(sensor), sensor, "a scale, for motion in mm", "none",
            "'pitch_mm_per_px' in the sensor file, or outputs without motion");
  }
  if (!wants(outputs, Output::Surface)) return;
  require(sensor.reading != SurfaceReading::None, sensor,
          "a surface reading (shading, photometric, elastic or lookup)", "none",
          "asking for force only, or adding 'surface' to the sensor file");
  require(sensor.reading != SurfaceReading::Photometric || format.channels == 3, sensor,
          "colour frames for reading 'photometric'", "gray frames", "channels 3 in the sensor file");
  require(sensor.reading != SurfaceReading::Shading || format.channels == 1, sensor,
          "gray frames for reading 'shading'", "colour frames", "channels 1 in the sensor file");
  require(sensor.reading != SurfaceReading::Elastic || format.channels == 1, sensor,
          "gray frames for reading 'elastic'", "colour frames", "channels 1 in the sensor file");
  require(sensor.reading != SurfaceReading::Lookup || format.channels == 1, sensor,
          "gray frames for reading 'lookup'", "colour frames", "channels 1 in the sensor file");
}

}  // namespace palpate
