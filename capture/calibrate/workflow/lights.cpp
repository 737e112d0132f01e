// From images of a known shape, each under its own light, to the weights that turn such images into slopes.
#include "capture/calibrate/workflow/workflow.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include "capture/calibrate/frame/origin.h"
#include "capture/files/light_files.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/calibrate/light_stack_check.h"
#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

}  // namespace

CalibrationReport calibrate_lights(const LightsRequest& options, const CalibrationRun& run) {
  const LightImages images = read_light_images(options.images);
  const std::vector<float> truth_mm = read_heights(options.height, images);
  std::vector<HeldOutHeights> tried;
  const int lowest = options.order.value_or(0), highest = options.order.value_or(2);
  const RunWatch::Progress progress =
      run.watch.begin("orders tried", static_cast<uint64_t>(highest - lowest + 1));
  for (int order = lowest; order <= highest; ++order) {
    tried.push_back(judge_light_stack(images, truth_mm, options.pitch_mm_per_px, order));
    progress(tried.size());
    if (run.watch.stopped()) return {.stopped = true};
  }
  const HeldOutHeights best = *std::min_element(
      tried.begin(), tried.end(),
      [](const HeldOutHeights& a, const HeldOutHeights& b) { return a.bands_mm < b.bands_mm; });
  LightCalibration calibration;
  const std::vector<uint8_t> all(truth_mm.size(), 1);
  calibration.stack = fit_light_stack(images, truth_mm, all, options.pitch_mm_per_px, best.order);
  calibration.width = images.width;
  calibration.height = images.height;
  calibration.pitch_mm_per_px = options.pitch_mm_per_px;
  calibration.bands_mm = best.bands_mm;
  calibration.halves_mm = best.halves_mm;
  std::string line = palpate::text("%zu lights, order %d, heights %.1f um RMS on bands held out",
                                   images.images.size(), best.order, 1e3 * best.bands_mm);
  calibration.origin = origin_now(options.images.front().parent_path().filename().string() + " with " +
                                      options.height.filename().string(),
                                  line);
  save_light_calibration(calibration, run.out);

  json::Value orders = json::Value::array();
  std::string text = "order of the light over the frame   held-out bands, um RMS   held-out halves, um RMS\n";
  for (const HeldOutHeights& h : tried) {
    orders.push_back({{"order", h.order}, {"bands_rms_mm", h.bands_mm}, {"halves_rms_mm", h.halves_mm}});
    line = palpate::text("%-33d %24.1f %25.1f%s\n", h.order, 1e3 * h.bands_mm, 1e3 * h.halves_mm,
                         h.order == best.order && tried.size() > 1 ? "   <- taken" : "");
    text += line;
  }
  line = palpate::text("slopes explained: %.1f %% across, %.1f %% down; %u x %u px at %.6g mm/px\nwritten: ",
                       100 * calibration.stack.explained_x, 100 * calibration.stack.explained_y, images.width,
                       images.height, options.pitch_mm_per_px);
  const json::Value value = {{"lights_file", run.out.string()},
                             {"lights", images.images.size()},
                             {"order", best.order},
                             {"orders", orders},
                             {"explained_x", calibration.stack.explained_x},
                             {"explained_y", calibration.stack.explained_y},
                             {"bands_rms_mm", best.bands_mm},
                             {"halves_rms_mm", best.halves_mm}};
  return {text + line + run.out.string(), value};
}

}  // namespace palpate
