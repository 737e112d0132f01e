#include "viz/commands/workflow/integrate_lights.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "capture/files/light_files.h"
#include "capture/files/npy.h"
#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/calibrate/light_stack_check.h"
#include "palpate/error.h"

namespace palpate {

Report integrate_lights(const Common& common, const LightsRequest& request) {
  const LightCalibration calibration = load_light_calibration(request.lights);
  const LightImages images = read_light_images(request.images);
  const auto size = [](uint32_t width, uint32_t height) {
    return std::to_string(width) + " x " + std::to_string(height) + " px";
  };
  // Weights are polynomials over the frame: another crop would be another place under the lights.
  if (images.width != calibration.width || images.height != calibration.height)
    throw Error(Failure::Input,
                "images of " + size(calibration.width, calibration.height) + ", as calibrated",
                size(images.width, images.height), "images of the calibrated camera mode");
  std::vector<float> truth_mm;
  if (!request.truth.empty()) truth_mm = read_heights(request.truth, images);
  const std::vector<float> height_mm = integrate_slopes(slopes_of(calibration.stack, images), images.width,
                                                        images.height, calibration.pitch_mm_per_px);
  const auto [lowest, highest] = std::minmax_element(height_mm.begin(), height_mm.end());
  const double peak_to_valley_mm = static_cast<double>(*highest) - static_cast<double>(*lowest);
  make_output_folder(common.out);
  const std::filesystem::path file = common.out / "height.npy";
  write_npy(file, height_mm, {images.height, images.width});
  json::Value value = {{"height", file.string()},
                       {"rows", images.height},
                       {"columns", images.width},
                       {"unit", "mm"},
                       {"lights", calibration.stack.lights},
                       {"pitch_mm_per_px", calibration.pitch_mm_per_px},
                       {"peak_to_valley_mm", peak_to_valley_mm},
                       {"calibration_rms_mm", calibration.bands_mm}};
  std::string line = text(
      "%u x %u heights from %u lights, peak to valley %.4f mm; calibrated to %.1f um RMS on "
      "held-out bands, %.1f um on places it had not seen\n",
      images.height, images.width, calibration.stack.lights, peak_to_valley_mm, 1e3 * calibration.bands_mm,
      1e3 * calibration.halves_mm);
  std::string text = line;
  if (!truth_mm.empty()) {
    const std::vector<uint8_t> all(truth_mm.size(), 1);
    const LevelledError error = levelled_error(height_mm, truth_mm, all, images.width);
    if (error.pixels == 0)
      throw Error(Failure::Input, "known heights in '" + request.truth.string() + "'",
                  "none that is a number", "the height map of the same scan, in mm");
    line = palpate::text(
        "against %s: %.2f um RMS over %llu px, offset and tilt removed (slopes carry neither)\n",
        request.truth.string().c_str(), 1e3 * error.rms_mm, static_cast<unsigned long long>(error.pixels));
    text += line;
    value["truth"] = request.truth.string();
    value["rms_error_mm"] = error.rms_mm;
    value["judged_px"] = error.pixels;
  }
  value["complete"] = true;
  return {text + "written: " + file.string(), value, 0};
}

}  // namespace palpate
