// palpate calibrate shear: recordings of a pulled contact beside a tangential gauge in, a sensor file with
// stiffness and friction out.
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <map>

#include "capture/output_file.h"
#include "engine/error.h"
#include "engine/gpu/context.h"
#include "perf/profile/gnuplot.h"
#include "viz/calibrate_shear.h"
#include "viz/command.h"
#include "viz/command_calibrate.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

const std::map<std::string, ShearSignal> kSignalNames = {{"centroid", ShearSignal::Centroid},
                                                         {"skin", ShearSignal::Skin}};

struct Options {
  std::vector<std::string> inputs, gauges;
  fs::path sensor, background, plots;
  std::string align;
  double rate_Hz = 0;
  ShearRequest request;
};

Report shear(const Common& common, const Options& options) {
  std::vector<std::string> gauges = options.gauges;
  if (gauges.size() == 1 && gauges.front() == "truth") gauges.resize(options.inputs.size(), "truth");
  if (gauges.size() != options.inputs.size())
    throw Error(Failure::Usage, "one --gauge for each recording, in the same order",
                std::to_string(options.inputs.size()) + " recordings and " + std::to_string(gauges.size()) +
                    " gauge tables",
                "--gauge once more for each");
  const std::unique_ptr<gpu::Context> context = open_device(common);
  Sensor sensor;
  std::vector<GaugedRecording> recordings;
  for (size_t i = 0; i < options.inputs.size(); ++i) {
    MeasuredInput found = find_input(common, options.inputs[i], options.sensor, options.background);
    if (!has_scale(found.sensor))
      throw Error(Failure::Sensor, "a sensor file to put the calibration in", "an uncalibrated camera",
                  "--sensor FILE with at least \"pitch_mm_per_px\"");
    found.outputs = static_cast<uint32_t>(Output::Force);
    if (found.sensor.skin && options.request.signal != ShearSignal::Centroid)
      found.outputs = found.outputs | Output::Skin;
    if (i == 0) sensor = found.sensor;
    recordings.push_back(measure_beside_gauge(
        *context, common, found,
        {gauges[i], GaugeColumns::Tangential, parse_alignment(options.align), options.rate_Hz}));
  }
  if (interrupted()) return {"", "", kInterrupted};
  if (!options.sensor.empty()) sensor = load_sensor(options.sensor);
  const ShearOutcome outcome = calibrate_shear(std::move(recordings), sensor, options.request);
  sensor.shear = outcome.calibration;
  save_sensor(sensor, common.out);

  const fs::path folder = options.plots.empty() ? common.out.parent_path() : options.plots;
  if (!folder.empty()) make_output_folder(folder);
  const std::string stem = (folder / common.out.stem()).string() + "_shear";
  std::string written = "written: " + common.out.string();
  for (const bool svg : {false, true}) {
    const perf::Picture picture = perf::run_gnuplot(plot_script(outcome, svg));
    const std::string file = stem + (svg ? ".svg" : ".png");
    if (picture.bytes.empty()) {
      spdlog::warn("no plot {}: {}", file, picture.error);
      continue;
    }
    write_whole(file, std::string_view(picture.bytes));
    written += ", " + file;
  }
  const int code = validation_clean(*context) ? 0 : kInternalError;
  return {describe(outcome) + "\n" + written, to_json(outcome, common.out.string()), code};
}

}  // namespace

void add_calibrate_shear(CLI::App& group, Common& common, Command& chosen) {
  CLI::App* command =
      group.add_subcommand("shear", "Shift to tangential force and friction, from pulls beside a gauge");
  auto options = std::make_shared<Options>();
  command->add_option("RECORDING", options->inputs, "Sessions, videos, folders of images, synthetic:SCENE")
      ->required();
  command
      ->add_option(
          "--gauge", options->gauges,
          "The gauge's table of each recording: CSV with time_s or frame, fx_N and fy_N (or shear_N and "
          "direction_deg), and force_N for the friction; 'truth' of a synthetic one")
      ->required();
  command->add_option("--sensor", options->sensor, "Sensor file to start from (sessions bring their own)");
  command
      ->add_option("--background", options->background, "Untouched image to use instead of the sensor file's")
      ->check(CLI::ExistingFile);
  command->add_option(
      "--align", options->align,
      "The gauge's clock: auto (by cross-correlation), none (it is the recording's), or seconds to "
      "add to it (default: auto, and none for tables that count frames)");
  command
      ->add_option(
          "--signal", options->request.signal,
          "What moves with the force: centroid or skin (default: what follows the gauge more closely)")
      ->transform(CLI::CheckedTransformer(kSignalNames));
  command
      ->add_option("--friction", options->request.friction,
                   "Friction coefficient, where no recording slips (default: the sensor file's)")
      ->check(CLI::Range(0.0, 100.0));
  command->add_option("--rate", options->rate_Hz, "Frames a second of images, which know no time themselves")
      ->check(CLI::PositiveNumber);
  command->add_option("--plots", options->plots, "Folder for the plot (default: beside --out)");
  command->add_option("--out", common.out, "Sensor file to write")
      ->required()
      ->option_text("FILE (required)");
  add_common(
      *command, common,
      "  palpate calibrate shear out/pull --gauge gauge.csv --out pad_calibrated.json\n"
      "  palpate calibrate shear out/pull out/slide --gauge pull.csv --gauge slide.csv --out pad.json\n"
      "  palpate calibrate shear synthetic:pull synthetic:slide --gauge truth --out pad.json\n"
      "K comes from frames that stick, friction from those that slip; x is to the right in the image, y "
      "down.\n"
      "Beside --out lies its plot (OUT_shear.png, .svg).\n");
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return shear(common, *options); }; });
}

}  // namespace palpate
