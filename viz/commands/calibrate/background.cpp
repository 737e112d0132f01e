// palpate calibrate background: from untouched frames to the background image and its noise.
#include <algorithm>
#include <filesystem>
#include <optional>

#include "capture/calibrate/background.h"
#include "capture/calibrate/untouched_recording.h"
#include "capture/files/images/images.h"
#include "capture/files/output_file.h"
#include "capture/run/input.h"
#include "capture/session/session.h"
#include "capture/v4l2/camera_options.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "palpate/sensor.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/command.h"
#include "viz/commands/options.h"
#include "viz/commands/progress.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string input;
  fs::path sensor;
  uint32_t frames = 30;
  uint32_t every = 0;
  std::optional<uint64_t> like;
  bool set_threshold = false;
};

/// An untouched image by what the recording shows; nothing where it was interrupted.
std::optional<UntouchedRecording> look_at(const Common& common, const Options& options, Sensor& sensor) {
  const Sensor reading = unrectified(sensor);
  if (is_camera(options.input)) {
    // What a camera shows cannot be looked at twice.
    ProgressBar bar(common, "untouched frames", options.frames);
    const std::vector<Frame> frames =
        take_frames(options.input, reading, options.frames, std::max(1u, options.every), [&](uint64_t n) {
          bar.update(n);
          return !interrupted();
        });
    if (interrupted()) return std::nullopt;
    UntouchedRecording found;
    found.image = untouched_image(frames, sensor);
    return found;
  }
  ProgressBar bar(common, "looking for untouched frames", 0);
  const auto more = [&](uint64_t n) {
    bar.update(n);
    return !interrupted();
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
  if (interrupted()) return std::nullopt;
  return found;
}

/// What the threshold gives on that recording.
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

Report report_of(const UntouchedRecording& look, const Sensor& sensor, double before, const Common& common,
                 const Options& options, const fs::path& image) {
  const UntouchedImage& found = look.image;
  const bool one = found.used == 1;
  const std::string doubt = doubt_about(look);
  json::Value value = {{"sensor", common.out.string()},
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
  all += "written: " + common.out.string() + " and " + image.string();
  return {all, value.dump(2), 0};
}

Report background(const Common& common, const Options& options) {
  Sensor sensor =
      options.sensor.empty() ? bare_sensor(options.input) : load_sensor(options.sensor, ToMake::Scale);
  if (options.sensor.empty()) sensor.name = common.out.stem().string();
  if (sensor.background.kind == BackgroundKind::None)
    throw Error(Failure::Sensor, "a sensor that subtracts an untouched image, " + options.sensor.string(),
                "background.source 'none'", "\"source\": \"untouched\"");
  const bool rectifies = sensor.crop_px || sensor.quad_px || sensor.lens || sensor.flat;
  if (rectifies && is_session(options.input))
    throw Error(Failure::Input, "frames as the camera gives them, which the sensor file then rectifies",
                "the session " + options.input + ", whose frames may be rectified already",
                "--camera frames, a video or images; a session brings its own untouched image");
  catch_interrupts();
  const std::optional<UntouchedRecording> found = look_at(common, options, sensor);
  if (!found || interrupted()) return {"", "", kInterrupted};
  const fs::path image =
      fs::absolute(common.out).parent_path() / (common.out.stem().string() + "_background.png");
  write_whole(image, encode_image(found->image.mean, ".png"));
  sensor.background.image = image.string();
  const double before = sensor.threshold_gray;
  if ((options.set_threshold || options.sensor.empty()) && found->image.used > 1)
    sensor.threshold_gray = found->image.threshold_gray;
  save_sensor(sensor, common.out);
  return report_of(*found, sensor, before, common, options, image);
}

}  // namespace

void add_calibrate_background(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("background", "The untouched image, its noise, and a threshold that fits");
  auto options = std::make_shared<Options>();
  command
      ->add_option("INPUT", options->input,
                   "Frames as the camera gives them: a recording that shows the pad at rest somewhere, one "
                   "untouched picture, or camera:NODE while nothing touches")
      ->required()
      ->check(input_exists);
  command->add_option("--sensor", options->sensor,
                      "Sensor file to start from (default: what the frames say)");
  command->add_option("--frames", options->frames, "How many untouched frames make the image")
      ->check(Check::range(2, 1000))
      ->capture_default_str();
  command->add_option("--every", options->every, "Look at every n-th frame (default: at 400)")
      ->check(Check::range(1, 10000));
  command->add_option("--like", options->like,
                      "Number of a frame in which nothing touches: those like it are untouched");
  command->add_flag("--set-threshold", options->set_threshold,
                    "Also set contact.threshold_gray as suggested (without a sensor file it is)");
  command->add_option("--out", common.out, "Sensor file to write; the image goes beside it")
      ->required()
      ->option_text("FILE (required)");
  add_common(
      *command, common,
      "  palpate calibrate background camera:/dev/video0 --sensor pad.json --out pad.json\n"
      "  palpate calibrate background press.avi --out pad.json\n"
      "  palpate calibrate background rest.png --sensor pad.json --out pad.json\n"
      "Frames that are alike belong together; the evenest kind that comes often is the untouched one (by "
      "the signal: the darkest, or the brightest). A warning says where something moves.\n");
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return background(common, *options); }; });
}

}  // namespace palpate
