#include "capture/open_source.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

#include "capture/files/image_sequence.h"
#include "capture/files/images/images.h"
#include "capture/files/video.h"
#include "capture/genicam/camera.h"
#include "capture/session/session.h"
#include "capture/synthetic/object.h"
#include "capture/synthetic/synthetic.h"
#include "capture/synthetic/tissue.h"
#include "capture/v4l2/camera.h"
#include "engine/base/readable.h"
#include "engine/measure/picture/picture_check.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

constexpr const char* kSynthetic = "synthetic:";

std::unique_ptr<Source> open_synthetic(const std::string& input, const Sensor& sensor) {
  std::unique_ptr<Source> source;
  if (is_tissue(input))
    source = std::make_unique<TissueSensor>(parse_tissue(input));
  else if (is_object(input))
    source = std::make_unique<ObjectSensor>(parse_object(input));
  else
    source = std::make_unique<SyntheticSensor>(parse_synthetic(input));
  const FrameFormat format = source->format();
  if (sensor.crop_px || sensor.quad_px || sensor.lens || sensor.flat)
    throw Error(Failure::Input, "a sensor without crop_px, quad_px, lens and flat for a synthetic input",
                "sensor '" + sensor.name + "'", "a synthetic sensor file (palpate simulate writes one)");
  if (sensor.channels != format.channels || sensor.bit_depth != format.bit_depth ||
      (sensor.size_px[0] != 0 && (sensor.size_px[0] != format.width || sensor.size_px[1] != format.height)))
    throw Error(
        Failure::Input, "a synthetic input that fits the sensor '" + sensor.name + "'",
        std::to_string(format.channels) + " channels of " + std::to_string(format.bit_depth) + " bits, " +
            std::to_string(format.width) + "x" + std::to_string(format.height) + " px",
        "other mode, bits and size after " + input.substr(0, input.find('?')) + "?, or another sensor file");
  return source;
}

std::unique_ptr<Source> open_camera(const CameraOptions& options, const Sensor& sensor) {
  if (is_genicam(options)) return std::make_unique<GenicamCamera>(options, sensor);
  return std::make_unique<Camera>(options, sensor);
}

/// Those of the frames whose pictures are whole, by comparison with one that agrees with most.
std::vector<const Frame*> whole_ones(const std::vector<Frame>& frames, const Sensor& sensor) {
  std::vector<const Frame*> best;
  for (const Frame* reference : {&frames.back(), &frames.front()}) {
    PictureCheck check(reference->format, sensor.saturation_gray, sensor.pad);
    check.set_reference(*reference);
    std::vector<const Frame*> whole;
    for (const Frame& frame : frames)
      if (check.look_at(frame) == PictureFault::None) whole.push_back(&frame);
    if (whole.size() > best.size()) best = std::move(whole);
    if (2 * best.size() > frames.size()) break;
  }
  return best;
}

/// Mean of the first frames, rounded; without those whose pictures are damaged.
Frame mean_of_first(const std::string& input, const Sensor& sensor, Source& open) {
  const uint32_t wanted = std::max(1u, sensor.background.first_frames);
  std::unique_ptr<Source> again;
  if (!open.live()) again = open_source(input, sensor);
  Source* source = again ? again.get() : &open;
  if (source->frame_count() == 1)
    throw Error(Failure::Input, "an untouched image to subtract", "only the one image " + input,
                "--background FILE, or \"background\": {\"image\": \"FILE\"} in the sensor file");
  std::vector<Frame> frames(wanted);
  for (uint32_t n = 0; n < wanted; ++n)
    if (!source->next(frames[n]))
      throw Error(Failure::Input, std::to_string(wanted) + " first frames for the background",
                  std::to_string(n) + " in " + input, "fewer first_frames in the sensor file");
  const std::vector<const Frame*> whole = whole_ones(frames, sensor);
  const auto count = static_cast<uint32_t>(whole.size());
  Frame mean;
  mean.reshape(frames.front().format);
  const FrameFormat& f = mean.format;
  for (uint32_t c = 0; c < f.channels; ++c)
    for (uint32_t y = 0; y < f.height; ++y)
      for (uint32_t x = 0; x < f.width; ++x) {
        uint32_t sum = 0;
        for (const Frame* frame : whole) sum += frame->at(c, x, y);
        mean.set(c, x, y, (sum + count / 2) / count);
      }
  return mean;
}

}  // namespace

bool is_recording(const std::string& input) {
  return input.rfind(kSynthetic, 0) != 0 && !is_camera(input);
}

FrameFormat camera_format(const std::string& input) {
  const CameraOptions options = parse_camera(input);
  return is_genicam(options) ? genicam_format(options) : linux_camera_format(options);
}

std::unique_ptr<Source> open_source(const std::string& input, const Sensor& sensor) {
  if (input.rfind(kSynthetic, 0) == 0) return open_synthetic(input, sensor);
  if (is_camera(input)) return open_camera(parse_camera(input), sensor);
  std::error_code error;
  const fs::path path(input);
  if (!fs::exists(path, error))
    throw Error(Failure::Input,
                "a video, an image, a folder of images, a session, camera:NODE or synthetic:SCENE",
                "nothing at '" + input + "'", "checking the path");
  if (const std::string why = why_unreadable(path); !why.empty() && why != "a folder")
    throw Error(Failure::Input, "a video, an image or a folder of images", path.string() + ": " + why,
                "another file");
  if (is_session(path)) return std::make_unique<Session>(path, sensor);
  if (fs::is_directory(path, error) || has_image_name(path))
    return std::make_unique<ImageSequence>(path, sensor);
  return std::make_unique<VideoFile>(path, sensor);
}

std::optional<Frame> background_image(const Sensor& sensor) {
  const std::string& file = sensor.background.image;
  if (file.empty()) return std::nullopt;
  Frame background;
  const cv::Mat image = read_image(file);
  Rectifier(sensor, image, file).apply(image, file, background);
  return background;
}

Frame load_background(const std::string& input, const Sensor& sensor, Source& source) {
  Frame background;
  if (sensor.background.kind == BackgroundKind::None) {
    background.reshape(source.format());  // black: there is nothing to subtract
    return background;
  }
  if (std::optional<Frame> named = background_image(sensor)) {
    background = std::move(*named);
  } else if (std::optional<Frame> own = source.own_background()) {
    background = std::move(*own);
  } else {
    background = mean_of_first(input, sensor, source);
  }
  const FrameFormat wanted = source.format(), &found = background.format;
  if (found != wanted)
    throw Error(Failure::Input,
                "a background of the frames' size " + std::to_string(wanted.width) + "x" +
                    std::to_string(wanted.height) + " px",
                std::to_string(found.width) + "x" + std::to_string(found.height) + " px",
                "the background of this sensor");
  return background;
}

bool separate_presses(const Source& source, bool one_sequence, double rate_Hz) {
  return !one_sequence && source.pictures() && rate_Hz <= 0;
}

BackgroundOrigin background_origin(const Sensor& sensor, const Source& source) {
  if (sensor.background.kind == BackgroundKind::None) return BackgroundOrigin::None;
  if (!sensor.background.image.empty()) return BackgroundOrigin::File;
  return source.own_background() ? BackgroundOrigin::Recording : BackgroundOrigin::FirstFrames;
}

}  // namespace palpate
