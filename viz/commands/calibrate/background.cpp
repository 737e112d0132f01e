// palpate calibrate background: from untouched frames to the background image and its noise.
#include <cstdio>
#include <filesystem>

#include "capture/calibrate/background.h"
#include "capture/files/images/images.h"
#include "capture/files/output_file.h"
#include "capture/session/session.h"
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
  uint32_t every = 1;
  bool set_threshold = false;
};

Report background(const Common& common, const Options& options) {
  Sensor sensor = load_sensor(options.sensor);
  if (sensor.background.kind == BackgroundKind::None)
    throw Error(Failure::Sensor, "a sensor that subtracts an untouched image, " + options.sensor.string(),
                "background.source 'none'", "\"source\": \"untouched\"");
  const bool rectifies = sensor.crop_px || sensor.quad_px || sensor.lens || sensor.flat;
  if (rectifies && is_session(options.input))
    throw Error(Failure::Input, "frames as the camera gives them, which the sensor file then rectifies",
                "the session " + options.input + ", whose frames may be rectified already",
                "--camera frames, a video or images; a session brings its own untouched image");
  catch_interrupts();
  ProgressBar bar(common, "untouched frames", options.frames);
  const std::vector<Frame> frames =
      take_frames(options.input, unrectified(sensor), options.frames, options.every, [&](uint64_t n) {
        bar.update(n);
        return !interrupted();
      });
  if (interrupted()) return {"", "", kInterrupted};
  const UntouchedImage found = untouched_image(frames, sensor);
  const fs::path image =
      fs::absolute(common.out).parent_path() / (common.out.stem().string() + "_background.png");
  write_whole(image, encode_image(found.mean, ".png"));
  sensor.background.image = image.string();
  const double before = sensor.threshold_gray;
  if (options.set_threshold) sensor.threshold_gray = found.threshold_gray;
  save_sensor(sensor, common.out);

  const json::Value value = {{"sensor", common.out.string()},
                             {"image", image.string()},
                             {"frames_used", found.used},
                             {"frames_left_out", found.left_out},
                             {"noise_gray", found.noise_gray},
                             {"largest_filtered_change_gray", found.largest_change_gray},
                             {"suggested_threshold_gray", found.threshold_gray},
                             {"threshold_gray", sensor.threshold_gray},
                             {"drift_gray", found.drift_gray},
                             {"saturated_px", found.saturated_px},
                             {"warning", found.warning}};
  const std::string line = text(
      "untouched image of %zu frames, noise %.2f gray a pixel; filtered, nothing changes by more than "
      "%.2f gray\nthreshold: %.2f gray suggested, %.2f %s\n",
      found.used, found.noise_gray, found.largest_change_gray, found.threshold_gray,
      options.set_threshold ? found.threshold_gray : before,
      options.set_threshold                ? "set"
      : before < found.largest_change_gray ? "in the sensor file: noise counts as contact (--set-threshold)"
                                           : "in the sensor file");
  std::string all = line;
  if (!found.warning.empty()) all += "WARNING: " + found.warning + "\n";
  all += "written: " + common.out.string() + " and " + image.string();
  return {all, value.dump(2), 0};
}

}  // namespace

void add_calibrate_background(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("background", "The untouched image, its noise, and a threshold that fits");
  auto options = std::make_shared<Options>();
  command
      ->add_option("INPUT", options->input,
                   "Untouched frames as the camera gives them: camera:NODE, a video, images")
      ->required()
      ->check(input_exists);
  command->add_option("--sensor", options->sensor, "Sensor file to start from")->required();
  command->add_option("--frames", options->frames, "How many frames")
      ->check(Check::range(2, 1000))
      ->capture_default_str();
  command->add_option("--every", options->every, "Take every n-th frame")->check(Check::range(1, 10000));
  command->add_flag("--set-threshold", options->set_threshold,
                    "Also set contact.threshold_gray as suggested");
  command->add_option("--out", common.out, "Sensor file to write; the image goes beside it")
      ->required()
      ->option_text("FILE (required)");
  add_common(
      *command, common,
      "  palpate calibrate background camera:/dev/video0 --sensor pad.json --out pad.json\n"
      "  palpate calibrate background rest.avi --sensor pad.json --frames 60 --set-threshold --out pad.json\n"
      "Frames unlike the others are left out and counted; a warning says where something touches or "
      "moves.\n");
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return background(common, *options); }; });
}

}  // namespace palpate
