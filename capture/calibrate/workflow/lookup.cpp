// From presses of a known ball into a gray gel to its table of depth over change.
#include "capture/calibrate/workflow/workflow.h"

#include <filesystem>

#include "capture/calibrate/background.h"
#include "capture/calibrate/frame/origin.h"
#include "capture/calibrate/untouched_recording.h"
#include "capture/calibrate/workflow/balls.h"
#include "capture/run/input.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/calibrate/lookup_fit.h"
#include "palpate/error.h"
#include "palpate/sensor.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

CalibrationReport report_of(const BallPresses& found, const LookupFitResult& result,
                            const PressVerdict& verdict, const CalibrationRun& run, const KeptSensor& kept) {
  json::Value presses = json::Value::array();
  const std::string error = "depth to " + error_text(result.depth_rmse_mm, result.cap_rms_mm) +
                            ", held out " +
                            (result.by_press ? "press by press" : "by sectors of the one press");
  std::string text = describe(verdict, error);
  text +=
      "\npress                       center_px       radius_px   depth_mm  rmse_mm   mean_mm   (held out)\n";
  for (size_t i = 0; i < result.presses.size(); ++i) {
    const HeldOutLookup& p = result.presses[i];
    const FoundBall& ball = found.presses[i].ball;
    presses.push_back({{"press", p.label},
                       {"center_x_px", ball.center_x_px},
                       {"center_y_px", ball.center_y_px},
                       {"contact_radius_px", ball.radius_px},
                       {"contact_px", p.contact_px},
                       {"largest_depth_mm", p.largest_depth_mm},
                       {"depth_rmse_mm", p.depth_rmse_mm},
                       {"cap_rms_mm", p.cap_rms_mm},
                       {"depth_error_mm", p.depth_error_mm}});
    const std::string row = palpate::text("%-26.80s %7.1f %7.1f %9.1f %10.3f %8.4f %9.4f\n", p.label.c_str(),
                                          ball.center_x_px, ball.center_y_px, ball.radius_px,
                                          p.largest_depth_mm, p.depth_rmse_mm, p.depth_error_mm);
    text += row;
  }
  for (const RefusedPress& r : found.refused) text += "not used: " + r.label + ": " + r.reason + "\n";
  const auto& points = result.calibration.points;
  json::Value value = {
      {"sensor", run.out.string()},
      {"presses", presses},
      {"refused", refused_json(found)},
      {"points", points.size()},
      {"gray_max", points.back()[0]},
      {"depth_max_mm", points.back()[1]},
      {"held_out", result.by_press ? "press" : "sector"},
      {"depth_rmse_held_out_mm", result.depth_rmse_mm},
      {"cap_rms_mm", result.cap_rms_mm},
      {"depth_share_of_caps", result.cap_rms_mm > 0 ? result.depth_rmse_mm / result.cap_rms_mm : 0}};
  add_verdict(verdict, error, value);
  const std::string all =
      palpate::text("all: depth %.4f mm RMS, held out %s; %zu points up to %.1f gray and %.3f mm\n",
                    result.depth_rmse_mm, result.by_press ? "press by press" : "by sectors of the one press",
                    points.size(), points.back()[0], points.back()[1]);
  return {text + all + kept.line, value};
}

}  // namespace

CalibrationReport calibrate_lookup(const BallRequest& options, const CalibrationRun& run) {
  check_ball_options(options);
  Sensor original =
      sensor_to_calibrate(options.input, options.sensor, ToMake::Reading, options.pitch_mm_per_px);
  if (options.sensor.empty()) {
    original.channels = 1;  // pictures of a gray gel are often in colour
    original.signal = signal_of(judge_touches(options.input, with_background(original, options),
                                              [&run](uint64_t) { return !run.watch.stopped(); }));
  }
  if (original.channels != 1)
    throw Error(Failure::Sensor, "a gray sensor (\"channels\": 1) in " + options.sensor.string(),
                std::to_string(original.channels) + " channels",
                "palpate calibrate photometric for a colour gel, or \"channels\": 1");
  if (original.filter == Filter::None)
    throw Error(Failure::Sensor, "contact.filter 'binomial5' for a reading of one gray image", "'none'",
                "another filter in " + options.sensor.string());
  const Sensor reading = with_background(original, options);
  const BallPresses found = presses_of(run, options, reading, true, 1);
  if (run.watch.stopped()) return {.stopped = true};
  const PressVerdict verdict = judge_presses(found, options, reading);

  LookupFit fit(reading.pitch_mm_per_px);
  for (size_t i = 0; i < found.presses.size(); ++i) {
    const BallPress& p = found.presses[i];
    if (p.shape.kind != PressedShape::Kind::Ball)
      throw Error(Failure::Input,
                  "presses of balls, by which a gray gel is read, in " + options.balls.string(),
                  describe(p.shape) + " for " + p.label, "rows of balls alone");
    fit.add_ball(p.frame, found.backgrounds[i], original.signal, p.ball.center_x_px, p.ball.center_y_px,
                 p.ball.radius_px, p.shape.radius_mm, p.label, p.mask);
  }
  const LookupFitResult result = fit.solve();
  const std::string note = palpate::text("%zu presses, held out %s: depth ", result.presses.size(),
                                         result.by_press ? "one at a time" : "by sectors of one press") +
                           error_text(result.depth_rmse_mm, result.cap_rms_mm);
  Sensor calibrated = original;
  calibrated.reading = SurfaceReading::Lookup;
  calibrated.lookup = result.calibration;
  calibrated.lookup.origin = origin_now(fs::path(options.input).filename().string(), note);
  calibrated.size_px = {found.format.width, found.format.height};
  const KeptSensor kept = keep_sensor(calibrated, options.background, run, options.sensor.empty());

  CalibrationReport report = report_of(found, result, verdict, run, kept);
  report.sensor = std::move(calibrated);
  return report;
}

}  // namespace palpate
