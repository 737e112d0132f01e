// palpate calibrate flat: from frames that should look even to the flat field that corrects the light.
#include <cstdio>
#include <filesystem>

#include "capture/calibrate/background.h"
#include "capture/calibrate/flat.h"
#include "capture/calibrate/markers.h"
#include "capture/calibrate/origin.h"
#include "capture/files/images/images.h"
#include "capture/files/output_file.h"
#include "capture/open_source.h"
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
  bool change = false;
};

Report flat(const Common& common, const Options& options) {
  Sensor sensor = load_sensor(options.sensor);
  sensor.flat.reset();
  catch_interrupts();
  ProgressBar bar(common, "even frames", options.frames);
  const std::vector<Frame> frames =
      take_frames(options.input, sensor, options.frames, options.every, [&](uint64_t n) {
        bar.update(n);
        return !interrupted();
      });
  if (interrupted()) return {"", "", kInterrupted};
  if (frames.empty())
    throw Error(Failure::Input, "frames in " + options.input, "none", "a recording of an even target");
  std::optional<Frame> dark;
  if (options.change) {
    if (sensor.background.image.empty())
      throw Error(Failure::Sensor, "an untouched image in " + options.sensor.string() + " for --change",
                  "none", "palpate calibrate background first");
    const std::unique_ptr<Source> source = open_source(options.input, sensor);
    dark = load_background(options.input, sensor, *source);
  }
  const FlatFit fit = fit_flat(frames, dark ? &*dark : nullptr, find_markers(frames.front(), sensor), sensor);
  const fs::path image = fs::absolute(common.out).parent_path() / (common.out.stem().string() + "_flat.png");
  write_whole(image, encode_image(fit.image, ".png"));
  std::string note = text("%zu frames, unevenness %.2f %% to %.2f %% on frames not used", frames.size(),
                          100 * fit.uneven_before, 100 * fit.uneven_after);
  sensor.flat =
      FlatField{image.string(), fit.gain, origin_now(fs::path(options.input).filename().string(), note)};
  // The field belongs to this size of frame.
  sensor.size_px = {frames.front().format.width, frames.front().format.height};
  save_sensor(sensor, common.out);
  const json::Value value = {{"sensor", common.out.string()},
                             {"image", image.string()},
                             {"frames", frames.size()},
                             {"of", options.change ? "change" : "light"},
                             {"unevenness_before", fit.uneven_before},
                             {"unevenness_after", fit.uneven_after},
                             {"factor_min", fit.least},
                             {"factor_max", fit.most},
                             {"limited_share", fit.limited}};
  std::string line = text(
      "light over the frame: %.2f %% uneven, %.2f %% once evened (frames not used for the field); "
      "factors %.2f to %.2f\n",
      100 * fit.uneven_before, 100 * fit.uneven_after, fit.least, fit.most);
  std::string all = line;
  if (fit.limited > 0) {
    line = text("WARNING: the factor is held at 1/4 or 4 in %.1f %% of the frame\n", 100 * fit.limited);
    all += line;
  }
  if (sensor.force || sensor.reconstruction != Reconstruction::None)
    all += "WARNING: gray changes with the field: calibrate force and surface again\n";
  all += "written: " + common.out.string() + " and " + image.string();
  return {all, value.dump(2), 0};
}

}  // namespace

void add_calibrate_flat(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("flat", "Uneven light, as a field that every frame is multiplied with");
  auto options = std::make_shared<Options>();
  command
      ->add_option(
          "INPUT", options->input,
          "Frames of what should look even: the untouched pad of a gel, a flat target pressed all over")
      ->required()
      ->check(input_exists);
  command->add_option("--sensor", options->sensor, "Sensor file to start from")->required();
  command->add_option("--frames", options->frames, "How many frames")
      ->check(Check::range(2, 1000))
      ->capture_default_str();
  command->add_option("--every", options->every, "Take every n-th frame")->check(Check::range(1, 10000));
  command->add_flag(
      "--change", options->change,
      "Even out the change from the untouched image: a waveguide, whose light shows where it is pressed");
  command->add_option("--out", common.out, "Sensor file to write; the field's image goes beside it")
      ->required()
      ->option_text("FILE (required)");
  add_common(
      *command, common,
      "  palpate calibrate flat untouched.avi --sensor gel.json --out gel.json\n"
      "  palpate calibrate flat pressed_flat.avi --change --sensor pad.json --out pad.json\n"
      "One factor for all channels: brightness is evened, colour stays. The untouched image is treated "
      "alike;\n"
      "saturated pixels stay saturated.\n");
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return flat(common, *options); }; });
}

}  // namespace palpate
