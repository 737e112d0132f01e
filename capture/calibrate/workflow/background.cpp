// From untouched frames to the background image and its noise.
#include "capture/calibrate/workflow/workflow.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include "capture/calibrate/background.h"
#include "capture/calibrate/untouched_recording.h"
#include "capture/camera/camera_options.h"
#include "capture/files/images/images.h"
#include "capture/files/output_file.h"
#include "capture/run/input.h"
#include "capture/session/session.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "palpate/sensor.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

/// An untouched image by what the recording shows; nothing where it was interrupted.
std::optional<UntouchedRecording> look_at(const CalibrationRun& run, const BackgroundRequest& options,
                                          Sensor& sensor) {
  const Sensor reading = unrectified(sensor);
  if (is_camera(options.input)) {
    // A camera's frames cannot be read twice.
    const RunWatch::Progress progress = run.watch.begin("untouched frames", options.frames);
    const std::vector<Frame> frames =
        take_frames(options.input, reading, options.frames, std::max(1u, options.every), [&](uint64_t n) {
          progress(n);
          return !run.watch.stopped();
        });
    if (run.watch.stopped()) return std::nullopt;
    UntouchedRecording found;
    found.image = untouched_image(frames, sensor);
    return found;
  }
  const RunWatch::Progress progress = run.watch.begin("looking for untouched frames", 0);
  const auto more = [&](uint64_t n) {
    progress(n);
    return !run.watch.stopped();
  };
  UntouchedRecording found = find_untouched(
      options.input, reading, {.frames = options.frames, .every = options.every, .like = options.like}, more);
  if (found.looked > found.untouched.size()) {
    // Without a sensor file the first look is both ways; what it finds says which way a touch goes.
    if (options.sensor.empty()) {
      const FrameFormat& format = found.image.mean.format;
      judge_threshold(options.input, reading, clear_threshold(found.image.threshold_gray, format), found,
                      more);
      sensor.signal = signal_of(found);
    }
    Sensor judged = reading;
    judged.signal = sensor.signal;
    const bool set = options.set_threshold || options.sensor.empty();
    judge_threshold(options.input, judged, set ? found.image.threshold_gray : sensor.threshold_gray, found,
                    more);
  }
  if (run.watch.stopped()) return std::nullopt;
  return found;
}

/// Touches that the threshold finds in that recording.
std::string given_by(const UntouchedRecording& found) {
  if (found.looked <= found.untouched.size()) return "";
  std::string line = text("with a threshold of %.2f gray %llu of %llu frames touch, %.0f px in the median",
                          found.threshold_gray, static_cast<unsigned long long>(found.touched_frames),
                          static_cast<unsigned long long>(found.looked), found.touched_px);
  line += found.untouched_that_touch ? text("; %llu of the untouched ones do: too low (--set-threshold)",
                                            static_cast<unsigned long long>(found.untouched_that_touch))
                                     : std::string("; none of the untouched ones does");
  return line + text("\n%.0f %% of the change is upwards\n", 100 * found.brighter);
}

std::string doubt_about(const UntouchedRecording& look) {
  if (look.rivals.empty()) return {};
  constexpr size_t kShown = 5;
  std::string list;
  for (size_t i = 0; i < std::min(kShown, look.rivals.size()); ++i)
    list += (i == 0 ? "" : ", ") + std::to_string(look.rivals[i]);
  return "the frames like " + std::to_string(look.untouched.front()) +
         " are taken to be untouched, for they come first; by the picture alone those like " + list +
         (look.rivals.size() > kShown ? ", ..." : "") + " could be: look at the image, --like N chooses";
}

CalibrationReport report_of(const UntouchedRecording& look, const Sensor& sensor, double before,
                            const CalibrationRun& run, const BackgroundRequest& options,
                            const fs::path& image) {
  const UntouchedImage& found = look.image;
  const bool one = found.used == 1;
  const std::string doubt = doubt_about(look);
  json::Value value = {{"sensor", run.out.string()},
                       {"image", image.string()},
                       {"frames_looked_at", look.looked},
                       {"untouched_frames", look.untouched.size()},
                       {"frames_used", found.used},
                       {"frames_left_out", found.left_out},
                       {"noise_gray", found.noise_gray},
                       {"largest_filtered_change_gray", found.largest_change_gray},
                       {"suggested_threshold_gray", found.threshold_gray},
                       {"threshold_gray", sensor.threshold_gray},
                       {"signal", to_string(sensor.signal)},
                       {"drift_gray", found.drift_gray},
                       {"saturated_px", found.saturated_px},
                       {"warning", found.warning}};
  std::string all;
  if (look.looked > look.untouched.size()) {
    value.update({{"untouched", look.untouched},
                  {"may_be_untouched_too", look.rivals},
                  {"doubt", doubt},
                  {"touched_frames", look.touched_frames},
                  {"untouched_frames_that_touch", look.untouched_that_touch},
                  {"touched_px", look.touched_px},
                  {"brighter", look.brighter},
                  {"brighter_peak", look.brighter_peak},
                  {"colour", look.colour}});
    all += text("nothing touches in %zu of %llu frames: ", look.untouched.size(),
                static_cast<unsigned long long>(look.looked)) +
           frame_ranges(look.untouched, look.step) + "\n";
  }
  if (one) {
    all += text("untouched image of one picture: its noise is not known, threshold %.2f gray as it was\n",
                before);
  } else {
    const bool set = options.set_threshold || options.sensor.empty();
    all += text(
        "untouched image of %zu frames, noise %.2f gray a pixel; filtered, nothing changes by more than "
        "%.2f gray\nthreshold: %.2f gray suggested, %.2f %s\n",
        found.used, found.noise_gray, found.largest_change_gray, found.threshold_gray,
        set ? found.threshold_gray : before,
        set                                  ? "set"
        : before < found.largest_change_gray ? "in the sensor file: noise counts as contact (--set-threshold)"
                                             : "in the sensor file");
  }
  all += given_by(look);
  for (const std::string& warning : {found.warning, doubt})
    if (!warning.empty()) all += "WARNING: " + warning + "\n";
  all += "written: " + run.out.string() + " and " + image.string();
  return {all, value};
}

}  // namespace

CalibrationReport calibrate_background(const BackgroundRequest& options, const CalibrationRun& run) {
  Sensor sensor =
      options.sensor.empty() ? bare_sensor(options.input) : load_sensor(options.sensor, ToMake::Scale);
  if (options.sensor.empty()) sensor.name = run.out.stem().string();
  if (sensor.background.kind == BackgroundKind::None)
    throw Error(Failure::Sensor, "a sensor that subtracts an untouched image, " + options.sensor.string(),
                "background.source 'none'", "\"source\": \"untouched\"");
  const bool rectifies = sensor.crop_px || sensor.quad_px || sensor.lens || sensor.flat;
  if (rectifies && is_session(options.input))
    throw Error(Failure::Input, "frames as the camera gives them, which the sensor file then rectifies",
                "the session " + options.input + ", whose frames may be rectified already",
                "--camera frames, a video or images; a session has its own untouched image");
  const std::optional<UntouchedRecording> found = look_at(run, options, sensor);
  if (!found || run.watch.stopped()) return {.stopped = true};
  const fs::path image = fs::absolute(run.out).parent_path() / (run.out.stem().string() + "_background.png");
  write_whole(image, encode_image(found->image.mean, ".png"));
  sensor.background.image = image.string();
  const double before = sensor.threshold_gray;
  if ((options.set_threshold || options.sensor.empty()) && found->image.used > 1)
    sensor.threshold_gray = found->image.threshold_gray;
  save_sensor(sensor, run.out);
  return report_of(*found, sensor, before, run, options, image);
}

}  // namespace palpate
