// palpate calibrate force: from recordings with a force gauge to a sensor file with its force calibration.
#include <cmath>
#include <cstdio>
#include <map>

#include "capture/calibrate/background.h"
#include "capture/calibrate/force/force.h"
#include "capture/files/images/images.h"
#include "capture/files/output_file.h"
#include "capture/open_source.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
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
  std::vector<std::string> objects, checks, check_gauges;
  std::string branches = "auto";
  bool keep_border = false;
  std::optional<ForceSignal> signal;
  std::optional<ForceModel> model;
  std::vector<double> images_N;
};

std::optional<bool> branches_of(const std::string& text) {
  if (text == "auto") return std::nullopt;
  return text == "apart";
}

/// The frames of the first recording that come nearest to some forces while loading, as files, and a script
/// that shows them side by side with their force and gray sum (as the paper's Fig. 11 does).
Plot write_images(const MeasuredInput& input, const ForceOutcome& outcome,
                  const std::vector<double>& forces_N, const std::string& stem) {
  std::map<uint64_t, const ForceSample*> wanted;  // by frame
  for (const double force_N : forces_N) {
    const ForceSample* nearest = nullptr;
    for (size_t i = 0; i < outcome.samples.size(); ++i) {
      const ForceSample& s = outcome.samples[i];
      if (s.recording != 0 || s.left_out != LeftOut::Used || outcome.choice.unloading_fraction[i] > 0.5)
        continue;
      if (!nearest || std::abs(s.force_N - force_N) < std::abs(nearest->force_N - force_N)) nearest = &s;
    }
    constexpr double kNear = 0.02;
    if (!nearest || std::abs(nearest->force_N - force_N) > kNear * outcome.choice.calibration.force_max_N) {
      const std::string line = palpate::text("%.4g N", force_N);
      throw Error(Failure::Usage, "--images at forces that the first recording has while loading",
                  std::string("none near ") + line, "other forces");
    }
    wanted[nearest->frame] = nearest;
  }
  const std::unique_ptr<Source> source = open_source(input.input, input.sensor);
  Plot plot{.across = static_cast<uint32_t>(wanted.size()), .height_px = 380};
  plot.width_px = 420 * static_cast<int>(wanted.size());
  for (Frame frame; source->next(frame) && frame.sequence <= wanted.rbegin()->first;) {
    const auto found = wanted.find(frame.sequence);
    if (found == wanted.end()) continue;
    const std::string file = stem + "_" + numbered_name(frame.sequence, "png");
    write_whole(file, encode_image(frame, ".png"));
    const std::string title = palpate::text("%.3f N, G = %.4g gray levels", found->second->force_N,
                                            found->second->features.gray_sum);
    plot.panels.push_back({.title = title, .picture = file});
  }
  return plot;
}

Report force(const Common& common, Options options) {
  const std::vector<std::string> gauges = paired(options.inputs, options.gauges, "--gauge"),
                                 check_gauges = paired(options.checks, options.check_gauges, "--check-gauge");
  options.objects = named_objects(options.objects, options.inputs.size());
  GaugeRequest request{"", GaugeColumns::Normal, parse_alignment(options.align), options.rate_Hz,
                       options.one_sequence};
  const std::unique_ptr<gpu::Context> context = open_device(common);
  MeasuredInput first;
  const auto find = [&](const std::string& input) {
    // Brightness, gradients and area in px need no scale.
    MeasuredInput found = find_input(common.seed, input, options.sensor, options.background);
    found.outputs = force_outputs(found, options.signal);
    return found;
  };
  const auto measure = [&](MeasuredInput found, const std::string& gauge, double thickness,
                           const std::string& object = {}) {
    if (found.sensor.layer) found.sensor.layer->thickness_mm *= thickness;
    request.gauge = gauge;
    request.object = object;
    return measure_with_gauge(*context, found, request, run_watch(common));
  };
  first = find(options.inputs.front());
  const ForceChoiceOptions choosing{options.signal, options.model, branches_of(options.branches),
                                    interrupted};
  LayerPresses presses = measure_presses(
      options.inputs.size(), choosing, first.sensor, options.keep_border, [&](size_t i, double thickness) {
        return measure(find(options.inputs[i]), gauges[i], thickness, options.objects[i]);
      });
  if (interrupted()) return interrupted_report();
  const double thickness = presses.factor();
  ForceOutcome outcome = calibrate_force(std::move(presses), choosing, options.keep_border);
  if (outcome.choice.stopped) return interrupted_report();
  for (size_t i = 0; i < options.checks.size(); ++i)
    outcome.checks.push_back(check_force(outcome.choice.calibration,
                                         measure(find(options.checks[i]), check_gauges[i], thickness),
                                         options.keep_border));
  if (interrupted()) return interrupted_report();

  Sensor sensor = options.sensor.empty() ? first.sensor : load_sensor(options.sensor);
  set_force(sensor, outcome.choice.calibration, thickness);
  const std::filesystem::path background = keep_background(options.background, common.out, sensor);
  save_sensor(sensor, common.out);
  const std::string stem = plot_stem(common, options, "_force");
  write_whole(stem + ".csv", std::string_view(samples_csv(outcome)));
  std::string written = "written: " + common.out.string() + ", " + stem + ".csv";
  if (!background.empty()) written += ", " + background.string();
  draw_plot(plot_of(outcome), stem, written);
  if (!options.images_N.empty())
    draw_plot(write_images(first, outcome, options.images_N, stem), stem + "_images", written);
  const int code = !validation_clean(*context)               ? kInternalError
                   : !outcome.choice.calibration.fit_for_use ? static_cast<int>(Failure::Input)
                                                             : 0;
  return {describe(outcome) + "\n" + written, to_json(outcome, common.out.string()), code};
}

}  // namespace

void add_calibrate_force(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("force", "Signal to newtons, from recordings with a force gauge");
  auto options = std::make_shared<Options>();
  add_gauged_options(
      *command, *options, common,
      "CSV with time_s (or _ms, _us, _ns) or frame, and force_N (or _mN, _kN, _gf, _kgf, _lbf)");
  command->add_option(
      "--object", options->objects,
      "What is pressed in each recording, in the same order, such as golf golf cube: those of one "
      "object are left out together (default: each recording is an object of its own)");
  command
      ->add_option(
          "--signal", options->signal,
          "gray-sum, gradient (of gels), area, volume, layer (of sensors with a layer), or layer-bending (of "
          "colour gels with a layer; default: as held-out presses say)")
      ->transform(one_of(kForceSignalNames));
  command
      ->add_option(
          "--model", options->model,
          "line, power, spline, or layer: the force by the elastic layer, whose modulus is found (and "
          "thickness, where three recordings or more decide it), alone or with the bending (default: as "
          "held-out presses say)")
      ->transform(one_of(kForceModelNames));
  command
      ->add_option("--branches", options->branches,
                   "Loading and unloading: apart, together, or auto (as held-out presses say)")
      ->check(Check::one_of({"auto", "apart", "together"}))
      ->capture_default_str();
  command->add_flag("--keep-border", options->keep_border,
                    "Use contacts that reach the frame's border too (their forces say so when measured)");
  command->add_option("--check", options->checks, "Recordings to judge the result by; not used for the fit");
  command->add_option("--check-gauge", options->check_gauges, "Their gauge tables");
  command
      ->add_option("--images", options->images_N,
                   "Forces, N, whose frames are written and shown side by side with their gray sums")
      ->delimiter(',');
  add_common(
      *command, common,
      "  palpate calibrate force out/press --gauge gauge.csv --out pad_calibrated.json\n"
      "  palpate calibrate force a.avi b.avi --gauge a.csv --gauge b.csv --sensor gel.json --out gel2.json\n"
      "  palpate calibrate force a.avi --gauge a.csv --check b.avi --check-gauge b.csv --sensor gel.json \\\n"
      "      --out gel2.json\n"
      "  palpate calibrate force ball_*.avi cube_*.avi --object ball ball cube cube --sensor gel.json \\\n"
      "      --gauge ball_1.csv ball_2.csv cube_1.csv cube_2.csv --out gel2.json\n"
      "  palpate calibrate force synthetic:press --gauge truth --out pad.json\n"
      "Next to --out lie its plot (OUT_force.png, .svg) and its points (OUT_force.csv). The first line is "
      "the\n"
      "verdict; a calibration that is not fit for use is written, says so, and ends with exit code 3.\n");
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return force(common, *options); }; });
}

}  // namespace palpate
