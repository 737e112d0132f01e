// palpate demo: calibration on some simulated touches, measurement of others, and errors against the truth.
#include <spdlog/spdlog.h>

#include <cmath>
#include <cstdlib>

#include "capture/files/output_file.h"
#include "capture/run/process/processing.h"
#include "capture/run/run_recording.h"
#include "capture/synthetic/synthetic.h"
#include "engine/base/json.h"
#include "engine/calibrate/force/fit.h"
#include "engine/calibrate/photometric/fit.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"
#include "viz/commands/support/run_watch.h"
#include "viz/display/recording_pictures.h"
#include "viz/display/run_live.h"
#include "viz/render/desktop.h"
#include "viz/render/format.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

struct Options {
  bool headless = false;
  uint64_t frames = 0;  ///< of the palpation; 0: all 600
  uint64_t picture_every = 4;
};

/// Measurement of one frame and the value of the gauge (here: the truth).
struct GaugedFrame {
  Touch touch;
  Truth truth;
};

std::vector<GaugedFrame> read_all(gpu::Context& context, const SyntheticOptions& options,
                                  const Sensor& sensor) {
  SyntheticSensor source(options);
  Pipeline pipeline(context, sensor, source.format(), {.outputs = Output::Force});
  pipeline.set_background(*source.own_background());
  std::vector<GaugedFrame> readings;
  run_recording(source, pipeline, 0, interrupted, [&](const Result& result, const Frame&) {
    readings.push_back({result.touch, *source.truth(result.touch.sequence)});
  });
  return readings;
}

/// Scene and seed of the calibration presses: another touch than the one that is judged, a little harder so
/// that its forces lie inside the calibrated range.
SyntheticOptions calibration_press(SyntheticOptions options, const char* scene, double force_N,
                                   uint64_t seed_step) {
  options.scene = scene;
  options.force_N = force_N;
  options.seed += seed_step;
  return options;
}

/// Gray sum to force from a stepped press, shift to shear and the friction from a slide.
/// Readings below `smallest_N` are left out: lighter touches then count as below the calibrated range.
std::string calibrate_force(gpu::Context& context, const SyntheticOptions& judged, double smallest_N,
                            Sensor& sensor) {
  constexpr double kForce_N = 1.6;
  sensor.force.reset();
  sensor.shear.reset();
  std::vector<double> gray, force_N;
  for (const GaugedFrame& r : read_all(context, calibration_press(judged, "press", kForce_N, 1000), sensor)) {
    if (!r.touch.contact || !r.truth.contact || r.touch.saturated_px > 0) continue;
    if (r.truth.force_N < smallest_N) continue;
    gray.push_back(r.touch.gray_sum);
    force_N.push_back(r.truth.force_N);
  }
  const ForceCalibration fit = line_calibration(gray, force_N);
  sensor.force = fit;

  std::vector<double> x_mm, y_mm, fx_N, fy_N;
  double friction = 0;
  uint64_t slipping = 0;
  for (const GaugedFrame& r : read_all(context, calibration_press(judged, "slide", 0, 2000), sensor)) {
    if (!r.touch.contact || !r.truth.contact) continue;
    if (r.truth.slipping) {
      friction += std::hypot(r.truth.shear_x_N, r.truth.shear_y_N) / r.truth.force_N;
      ++slipping;
    } else if (slipping == 0) {  // after the slip the shift holds the way slipped
      x_mm.push_back(r.touch.shift_x_mm);
      y_mm.push_back(r.touch.shift_y_mm);
      fx_N.push_back(r.truth.shear_x_N);
      fy_N.push_back(r.truth.shear_y_N);
    }
  }
  // F = K u: a line through the origin.
  const CurveFit kx = fit_curve(ForceModel::Scale, x_mm, fx_N), ky = fit_curve(ForceModel::Scale, y_mm, fy_N);
  const auto relative_sd = [](const CurveFit& k) { return std::sqrt(k.covariance[2]) / k.curve.c1; };
  if (slipping == 0)
    throw Error(Failure::Input, "a slide that slips", "one that only sticks", "a lower friction");
  sensor.shear = ShearCalibration{.kx_N_per_mm = kx.curve.c1,
                                  .ky_N_per_mm = ky.curve.c1,
                                  .friction = friction / static_cast<double>(slipping),
                                  .relative_sd = std::hypot(relative_sd(kx), relative_sd(ky))};
  return text(
             "  force: F = c1 G + c0, c1 = %.4g N/gray, c0 = %.4g N, R^2 %.6f, scatter %.2g N, from %zu "
             "frames of scene 'press'\n",
             fit.c1_N_per_gray, fit.c0_N, fit.r_squared, fit.residual_sd_N, gray.size()) +
         text("  shear: K = %.4g, %.4g N/mm, friction %.3f, from %zu + %llu frames of scene 'slide'\n",
              kx.curve.c1, ky.curve.c1, sensor.shear->friction, x_mm.size(),
              static_cast<unsigned long long>(slipping));
}

/// Colour to slope from presses of a larger ball at the scene's places, as `palpate calibrate photometric`
/// does it.
std::string calibrate_colour(const SyntheticOptions& judged, Sensor& sensor) {
  constexpr double kBallRadius_mm = 14;
  constexpr double kForce_N = 0.8;
  constexpr uint64_t kStep = 10;
  SyntheticOptions presses = calibration_press(judged, "palpation", kForce_N, 3000);
  presses.indenter_radius_mm = kBallRadius_mm;
  SyntheticSensor source(presses);
  PhotometricFit fit(source.format(), sensor.pitch_mm_per_px);
  const Frame background = *source.own_background();
  Frame frame;
  for (uint64_t sequence = 0; source.render(sequence, frame); sequence += kStep) {
    const std::optional<Truth> truth = source.truth(sequence);
    constexpr double kSmallest_mm = 1;  // smaller contacts hold too few pixels
    if (!truth->contact || truth->radius_px * sensor.pitch_mm_per_px < kSmallest_mm) continue;
    fit.add_ball(frame, background, truth->center_x_px, truth->center_y_px, truth->radius_px, kBallRadius_mm,
                 "frame " + std::to_string(sequence));
  }
  const PhotometricFitResult result = fit.solve();
  sensor.photometric = result.calibration;
  return text(
      "  colour: %zu presses of a ball of radius %g mm, normals to %.4f (held out), depth gain %.3f\n",
      result.presses.size(), kBallRadius_mm, result.normal_rms_held_out, result.depth_gain);
}

/// The frame in the middle of each contact's hardest stretch: what is worth a picture.
std::vector<uint64_t> hardest_frames(const SyntheticSensor& source) {
  std::vector<uint64_t> chosen;
  double hardest_N = 0;
  uint64_t first = 0, last = 0;
  for (uint64_t k = 0; k < source.frame_count().value_or(0); ++k) {
    const double force_N = source.contact(k).summary().force_N;
    if (force_N > hardest_N) {
      hardest_N = force_N;
      first = k;
    }
    if (force_N > 0 && force_N == hardest_N) last = k;
    if (force_N <= 0 && hardest_N > 0) {
      chosen.push_back((first + last) / 2);
      hardest_N = 0;
    }
  }
  return chosen;
}

/// Shows the palpation once, as it happens, until its end or until the window is closed.
void show(const Common& common, const SyntheticOptions& options, const Sensor& sensor, uint64_t frames) {
  const std::vector<const char*> extensions = viz::window_extensions();
  const std::unique_ptr<gpu::Context> context = open_device(common, &extensions);
  LiveOptions live;
  live.max_frames = frames;
  live.close_at_end = true;
  live.interrupted = interrupted;
  viz::WindowRun shown;
  shown.title = "palpate: a simulated palpation of 20 s";
  shown.notes = common.out;
  const auto open = [&] { return std::make_shared<SyntheticSensor>(options); };
  const Frame background = *SyntheticSensor(options).own_background();
  viz::run_live(*context, open, {sensor, background, {}}, live, shown);
}

Report demo(const Common& common, const Options& options) {
  SyntheticOptions pad{.scene = "palpation"};
  pad.seed = common.seed;
  SyntheticOptions gel = pad;
  gel.mode = SyntheticMode::Gel;

  make_output_folder(common.out);
  const std::unique_ptr<gpu::Context> context = open_device(common);

  // The gel's gray sum follows the slopes, not the pressure, and bends away from the line at light touch.
  constexpr double kGelSmallest_N = 0.05;
  Sensor pad_sensor = synthetic_sensor(pad);
  Sensor gel_sensor = synthetic_sensor(gel);
  spdlog::info("calibrating on other touches than those that are judged");
  const std::string calibration = "waveguide pad\n" + calibrate_force(*context, pad, 0, pad_sensor) +
                                  "gel skin\n" + calibrate_force(*context, gel, kGelSmallest_N, gel_sensor) +
                                  calibrate_colour(gel, gel_sensor);
  save_sensor(pad_sensor, common.out / "waveguide.json");
  save_sensor(gel_sensor, common.out / "gel.json");

  const bool window = !options.headless && viz::display_available();
  if (window) {
    spdlog::info("the palpation once in a window, then (or when the window is closed) the table");
    show(common, gel, gel_sensor, options.frames);
  } else if (!options.headless) {
    spdlog::info("no display: pictures and a film instead of a window");
  }

  ProcessRequest pressure;
  pressure.input = to_string(pad);
  pressure.solver = SurfaceSolver::Live;
  pressure.max_frames = options.frames;
  ProcessRequest surface;
  surface.input = to_string(gel);
  surface.solver = SurfaceSolver::Live;  // what the window shows
  surface.max_frames = options.frames;
  surface.pictures = surface.video = !window;
  surface.draw = viz::recording_pictures({});
  surface.picture_every = options.picture_every;
  surface.picture_frames = hardest_frames(SyntheticSensor(gel));

  spdlog::info("the palpation as the waveguide pad sees it: force, shear, slip, centre, depth from pressure");
  const ProcessSummary felt =
      process_recording(*context, pad_sensor, pressure, common.out / "waveguide", run_watch(common));
  std::optional<ProcessSummary> seen;
  if (felt.complete) {
    spdlog::info("the same palpation as the gel skin sees it: surface, depth from slopes");
    seen = process_recording(*context, gel_sensor, surface, common.out / "gel", run_watch(common));
  }

  Report report;
  report.add("complete", seen && seen->complete, "calibration (other touches, other noise)\n" + calibration);
  const Facts pad_facts = facts_of(felt, pressure, pad_sensor, *context);
  report.add("waveguide", pad_facts.json, "\nwaveguide pad: " + pad_facts.text);
  if (seen) {
    const Facts gel_facts = facts_of(*seen, surface, gel_sensor, *context);
    report.add("gel", gel_facts.json, "\ngel skin: " + gel_facts.text);
    report.say("\nwritten to " + common.out.string() +
               ": waveguide.json, waveguide/measurements.csv, gel.json, gel/measurements.csv" +
               (window ? "" : ", gel/pictures/, gel/recording.mp4"));
  }
  report.exit_code = !seen || !seen->complete     ? kInterrupted
                     : validation_clean(*context) ? 0
                                                  : kInternalError;
  return report;
}

}  // namespace

void add_demo(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command =
      program.add_subcommand("demo", "Measure a 20 s simulated palpation and compare with the truth");
  auto options = std::make_shared<Options>();
  command->add_option("--out", common.out,
                      "Folder for measurements, pictures and the film (default: out/demo)");
  command->add_flag("--headless", options->headless, "No window, even where there is a display");
  command->add_option("--frames", options->frames, "Only that many frames of the palpation");
  command->add_setting("--picture-every", options->picture_every, Check::range(uint64_t{1}, uint64_t{1000}),
                       "Write a frame of the film every N frames");
  add_common(*command, common,
             "  palpate demo                           a window where there is a display, then the table\n"
             "  palpate demo --headless --out out/demo pictures and a film instead\n"
             "Calibration uses other touches and other noise than the palpation that is judged.\n");
  command->callback([&common, &chosen, options] {
    if (common.out.empty()) common.out = "out/demo";
    chosen = [&common, options] { return demo(common, *options); };
  });
}

}  // namespace palpate
