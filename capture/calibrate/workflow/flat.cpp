// From frames that should look even to the flat field that corrects the light.
#include "capture/calibrate/workflow/workflow.h"

#include <filesystem>

#include "capture/calibrate/background.h"
#include "capture/calibrate/frame/flat.h"
#include "capture/calibrate/frame/markers.h"
#include "capture/calibrate/frame/origin.h"
#include "capture/files/images/images.h"
#include "capture/files/output_file.h"
#include "capture/open_source.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "palpate/sensor.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

}  // namespace

CalibrationReport calibrate_flat(const FlatRequest& options, const CalibrationRun& run) {
  Sensor sensor = load_sensor(options.sensor);
  sensor.flat.reset();
  const RunWatch::Progress progress = run.watch.begin("even frames", options.frames);
  const std::vector<Frame> frames =
      take_frames(options.input, sensor, options.frames, options.every, [&](uint64_t n) {
        progress(n);
        return !run.watch.stopped();
      });
  if (run.watch.stopped()) return {.stopped = true};
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
  const fs::path image = fs::absolute(run.out).parent_path() / (run.out.stem().string() + "_flat.png");
  write_whole(image, encode_image(fit.image, ".png"));
  std::string note = text("%zu frames, unevenness %.2f %% to %.2f %% on frames not used", frames.size(),
                          100 * fit.uneven_before, 100 * fit.uneven_after);
  sensor.flat =
      FlatField{image.string(), fit.gain, origin_now(fs::path(options.input).filename().string(), note)};
  // The field belongs to this size of frame.
  sensor.size_px = {frames.front().format.width, frames.front().format.height};
  save_sensor(sensor, run.out);
  const json::Value value = {{"sensor", run.out.string()},
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
  if (sensor.force || sensor.reading != SurfaceReading::None)
    all += "WARNING: gray changes with the field: calibrate force and surface again\n";
  all += "written: " + run.out.string() + " and " + image.string();
  return {all, value};
}

}  // namespace palpate
