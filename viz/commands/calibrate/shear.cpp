// palpate calibrate shear: from recordings of a pulled contact with a tangential gauge to a sensor file
// with stiffness and friction.
#include "capture/calibrate/force/shear.h"
#include "capture/calibrate/background.h"
#include "engine/gpu/context.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/calibrate/gauged.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/run_watch.h"
#include "viz/report/calibration_plots.h"

namespace palpate {
namespace {

struct Options : GaugedOptions {
  ShearRequest request;
};

Report shear(const Common& common, const Options& options) {
  const std::vector<std::string> gauges = paired(options.inputs, options.gauges, "--gauge");
  const std::unique_ptr<gpu::Context> context = open_device(common);
  Sensor sensor;
  std::vector<GaugedRecording> recordings;
  for (size_t i = 0; i < options.inputs.size(); ++i) {
    MeasuredInput found = find_scaled_input(common, options.inputs[i], options);
    found.outputs = shear_outputs(found, options.request.signal);
    if (i == 0) sensor = found.sensor;
    recordings.push_back(
        measure_with_gauge(*context, found,
                           {gauges[i], GaugeColumns::Tangential, parse_alignment(options.align),
                            options.rate_Hz, options.one_sequence},
                           run_watch(common)));
  }
  if (interrupted()) return interrupted_report();
  if (!options.sensor.empty()) sensor = load_sensor(options.sensor);
  const ShearOutcome outcome = calibrate_shear(std::move(recordings), sensor, options.request);
  sensor.shear = outcome.calibration;
  const std::filesystem::path background = keep_background(options.background, common.out, sensor);
  save_sensor(sensor, common.out);

  const std::string stem = plot_stem(common, options, "_shear");
  std::string written = "written: " + common.out.string();
  if (!background.empty()) written += ", " + background.string();
  draw_plot(plot_of(outcome), stem, written);
  const int code = validation_clean(*context) ? 0 : kInternalError;
  return {describe(outcome) + "\n" + written, to_json(outcome, common.out.string()), code};
}

}  // namespace

void add_calibrate_shear(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("shear", "Shift to tangential force and friction, from pulls with a gauge");
  auto options = std::make_shared<Options>();
  add_gauged_options(
      *command, *options, common,
      "CSV with time_s or frame, fx_N and fy_N (or shear_N and direction_deg), and force_N for the "
      "friction");
  command
      ->add_option(
          "--signal", options->request.signal,
          "What moves with the force: centroid or skin (default: what follows the gauge more closely)")
      ->transform(one_of(kShearSignalNames));
  command
      ->add_option("--friction", options->request.friction,
                   "Friction coefficient, where no recording slips (default: the sensor file's)")
      ->check(Check::range(0.0, 100.0));
  add_common(
      *command, common,
      "  palpate calibrate shear out/pull --gauge gauge.csv --out pad_calibrated.json\n"
      "  palpate calibrate shear out/pull out/slide --gauge pull.csv --gauge slide.csv --out pad.json\n"
      "  palpate calibrate shear synthetic:pull synthetic:slide --gauge truth --out pad.json\n"
      "K comes from frames that stick, friction from those that slip; x is to the right in the image, y "
      "down.\n"
      "Next to --out lies its plot (OUT_shear.png, .svg).\n");
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return shear(common, *options); }; });
}

}  // namespace palpate
