// From presses of known shapes to a colour calibration.
#include "capture/calibrate/workflow/workflow.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "capture/calibrate/background.h"
#include "capture/calibrate/frame/markers.h"
#include "capture/calibrate/frame/origin.h"
#include "capture/calibrate/photometric/press_contact.h"
#include "capture/calibrate/workflow/balls.h"
#include "capture/run/input.h"
#include "engine/base/json.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "engine/calibrate/photometric/fit.h"
#include "engine/measure/depth_error.h"
#include "palpate/error.h"
#include "palpate/sensor.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

// A press is of another ball where its held-out depth gain lies so far from the median (logarithms): by a
// factor, and by so many times the usual scatter. And the least number of presses for that decision.
constexpr double kUnlikeGain = 1.35, kUnlikeScatter = 3;
constexpr size_t kEnoughToJudge = 6;
// So many presses unlike the others are looked at one by one; more are another ball.
constexpr size_t kFewUnlike = 4;

std::string fixed(double value, int digits) {
  std::string line = palpate::text("%.*f", digits, value);
  return line;
}

json::Value errors_json(const HeldOutErrors& e) {
  return {{"normal_rms", e.normal_rms},
          {"normal_angle_deg", e.normal_angle_deg},
          {"depth_rmse_mm", e.depth_rmse_mm},
          {"depth_gain", e.depth_gain}};
}

std::string refused_text(const BallPresses& found) {
  constexpr size_t kShown = 12;
  std::string text;
  for (size_t i = 0; i < found.refused.size() && i < kShown; ++i)
    text += "not used: " + found.refused[i].label + ": " + found.refused[i].reason + "\n";
  if (found.refused.size() > kShown)
    text += "not used: " + std::to_string(found.refused.size() - kShown) + " more\n";
  return text;
}

/// "gain 0.99, 0.67 (at 204, 98 px) to 1.42 (at 61, 250 px) over 22 presses": one number for all hides what
/// differs over the pad.
std::string gain_text(const PhotometricFitResult& result, const BallPresses& found) {
  size_t least = 0, most = 0;
  for (size_t i = 0; i < result.presses.size(); ++i) {
    if (result.presses[i].depth_gain < result.presses[least].depth_gain) least = i;
    if (result.presses[i].depth_gain > result.presses[most].depth_gain) most = i;
  }
  const auto at = [&](size_t i) {
    const FoundBall& ball = found.presses[i].ball;
    return palpate::text("%.2f (at %.0f, %.0f px)", result.presses[i].depth_gain, ball.center_x_px,
                         ball.center_y_px);
  };
  return palpate::text("depth gain %.2f, from ", result.depth_gain) + at(least) + " to " + at(most) +
         palpate::text(" over %zu presses", result.presses.size());
}

PhotometricFitResult fit_presses(const BallPresses& found, const Sensor& reading,
                                 const PhotometricRequest& options, std::optional<size_t> without = {}) {
  PhotometricFit fit(found.format, reading.pitch_mm_per_px);
  fit.set_frame_noise(found.frame_sd);
  for (size_t i = 0; i < found.presses.size(); ++i) {
    if (i == without) continue;
    const BallPress& p = found.presses[i];
    fit.add_press(p.frame, found.backgrounds[i], p.ball, p.shape, p.label, p.mask);
  }
  return fit.solve(options.rest_weight, options.model);
}

/// True where the others are read better without press `i`: they are without another ball, but not without a
/// press at the pad's dim edge, which is read unlike them as well.
bool misleads(size_t i, const PhotometricFitResult& result, const BallPresses& found, const Sensor& reading,
              const PhotometricRequest& options) {
  double squares = 0;
  for (size_t k = 0; k < result.presses.size(); ++k)
    if (k != i) squares += std::pow(result.presses[k].depth_rmse_mm, 2);
  const double with_mm = std::sqrt(squares / static_cast<double>(result.presses.size() - 1));
  return fit_presses(found, reading, options, i).depth_rmse_mm < with_mm;
}

/// Takes out presses whose depth is read unlike the others'; true where there are any.
bool refuse_other_balls(const PhotometricFitResult& result, const Sensor& reading,
                        const PhotometricRequest& options, BallPresses& found) {
  if (result.presses.size() < kEnoughToJudge) return false;
  std::vector<double> gains, apart;
  for (const HeldOutPress& p : result.presses) gains.push_back(std::log(std::max(p.depth_gain, 1e-3)));
  const double usual = median(gains);
  for (const double gain : gains) apart.push_back(std::abs(gain - usual));
  const double limit = std::max(std::log(kUnlikeGain), kUnlikeScatter * 1.4826 * median(apart));
  std::vector<size_t> unlike;
  for (size_t i = gains.size(); i-- > 0;)
    if (apart[i] > limit) unlike.push_back(i);
  if (unlike.size() <= kFewUnlike)
    std::erase_if(unlike, [&](size_t i) { return !misleads(i, result, found, reading, options); });
  for (const size_t i : unlike)
    refuse_press(found, i,
                 "reads " + fixed(std::exp(gains[i] - usual), 2) +
                     " times the depth that others do: another " + name_of(found.presses[i].shape.kind));
  return !unlike.empty();
}

Sensor checked_sensor(const PhotometricRequest& options) {
  Sensor sensor =
      sensor_to_calibrate(options.input, options.sensor, ToMake::Reading, options.pitch_mm_per_px);
  if (sensor.channels != 3)
    throw Error(Failure::Sensor, "a colour sensor (\"channels\": 3) in " + options.sensor.string(),
                std::to_string(sensor.channels) + " channel",
                "palpate calibrate lookup for a gray gel, or another sensor file");
  if (sensor.background.kind == BackgroundKind::None)
    throw Error(Failure::Sensor, "a sensor with an untouched image in " + options.sensor.string(),
                "background.source 'none'", "frames as the camera sees them: slopes need a change's sign");
  return sensor;
}

/// A fit with the presses it was made from.
struct Fitted {
  PhotometricFitResult result;
  BallPresses found;
  bool masked = false;  ///< markers were left out
};

Fitted fit_found(BallPresses found, const Sensor& reading, const PhotometricRequest& options) {
  Fitted fitted{{}, std::move(found), false};
  fitted.masked = std::any_of(fitted.found.presses.begin(), fitted.found.presses.end(),
                              [](const BallPress& p) { return p.markers; });
  fitted.result = fit_presses(fitted.found, reading, options);
  // Each round sees the rest more clearly.
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds && options.balls.empty() &&
                      refuse_other_balls(fitted.result, reading, options, fitted.found);
       ++round)
    fitted.result = fit_presses(fitted.found, reading, options);
  refuse_contradictions(fitted.found, reading, options.input);
  return fitted;
}

Sensor calibrated(Sensor sensor, const Fitted& fitted, const PhotometricRequest& options) {
  const PhotometricFitResult& result = fitted.result;
  sensor.reading = SurfaceReading::Photometric;
  sensor.photometric = result.calibration;
  sensor.photometric.origin = origin_now(
      fs::path(options.input).filename().string(),
      std::to_string(fitted.found.presses.size()) + " presses, " + result.model().order.name +
          " model, held out: depth " + error_text(result.depth_rmse_mm, result.cap_rms_mm) + ", normals " +
          fixed(result.normal_angle_deg, 2) + " deg" + (fitted.masked ? ", markers left out" : ""));
  // The surface has to fill what the fit left out.
  if (fitted.masked && !sensor.skin) sensor.skin = marker_pattern(fitted.found.background, sensor);
  // Weights vary across the frame: another size of frame is another camera mode.
  sensor.size_px = {fitted.found.format.width, fitted.found.format.height};
  return sensor;
}

/// Adds a press's line to `text`; gives its values.
json::Value add_press(const HeldOutPress& p, const BallPress& press, std::string& text) {
  const FoundBall& ball = press.ball;
  const std::string row =
      palpate::text("%-26.80s %7.1f %7.1f %9.1f %11.2f %14.4f %11.3f\n", p.label.c_str(), ball.center_x_px,
                    ball.center_y_px, ball.radius_px, p.normal_angle_deg, p.depth_rmse_mm, p.depth_gain);
  text += row;
  json::Value value = {{"press", p.label},
                       {"center_x_px", ball.center_x_px},
                       {"center_y_px", ball.center_y_px},
                       {"contact_radius_px", ball.radius_px},
                       {"center_sd_px", ball.center_sd_px},
                       {"contact_radius_sd_px", ball.radius_sd_px},
                       {"contact_px", p.contact_px},
                       {"normal_rms", p.normal_rms},
                       {"normal_angle_deg", p.normal_angle_deg},
                       {"depth_rmse_mm", p.depth_rmse_mm},
                       {"cap_rms_mm", p.cap_rms_mm},
                       {"depth_gain", p.depth_gain}};
  if (press.shape.kind != PressedShape::Kind::Ball) value["shape"] = describe(press.shape);
  if (!press.shape.round())
    value.update(
        {{"axis_deg", ball.axis_rad * 180 / std::numbers::pi}, {"length_px", 2 * ball.half_length_px}});
  return value;
}

/// Part of the pad that the presses saw.
struct PressedPart {
  double share = 0;
  std::string text;
  bool little() const { return share < kLittle; }
  static constexpr double kLittle = 0.6;
};

PressedPart pressed_part(const Sensor& sensor, const FrameFormat& format) {
  const DepthError::SeenPart seen = DepthError(sensor.photometric, format).seen_part();
  return {
      seen.share,
      palpate::text("presses saw %.0f %% of the picture, within x %u to %u, y %u to %u px; depth elsewhere "
                    "is extrapolated",
                    100 * seen.share, seen.around.x, seen.around.x + seen.around.width, seen.around.y,
                    seen.around.y + seen.around.height)};
}

/// "model: quadratic, slopes fitted to 90 % of each circle; the simplest that ... (linear 0.0435, quadratic
/// 0.0151 mm)".
std::string models_text(const PhotometricFitResult& result) {
  std::string text = std::string("model: ") + result.model().order.name + ", slopes fitted to " +
                     fixed(100 * result.followed_share, 0) + " % of each circle";
  if (result.candidates.size() == 1) return text;
  text += "; the simplest that is as good as any on presses";
  if (result.model().ball) text += " and balls";
  text += " held out (";
  for (const NormalCandidate& c : result.candidates) {
    text += (&c == &result.candidates.front() ? "" : ", ") + std::string(c.order.name) + " " +
            fixed(c.press.depth_rmse_mm, 4);
    if (c.ball) text += " / " + fixed(c.ball->depth_rmse_mm, 4);
  }
  return text + (result.model().ball ? " mm without the press / the ball)" : " mm)");
}

json::Value models_json(const PhotometricFitResult& result) {
  json::Value models = json::Value::array();
  for (const NormalCandidate& c : result.candidates) {
    json::Value value = {{"model", c.order.name}, {"press_held_out", errors_json(c.press)}};
    if (c.ball) value["ball_held_out"] = errors_json(*c.ball);
    models.push_back(value);
  }
  return models;
}

/// The sensor file's markers, which a surface is made without.
const SkinPattern* filled_markers(const Sensor& sensor) {
  return sensor.skin && sensor.skin->kind == SkinKind::Markers ? &*sensor.skin : nullptr;
}

std::string markers_text(const Sensor& sensor) {
  const SkinPattern* markers = filled_markers(sensor);
  if (!markers)
    return "markers: left out of the fit; too uneven a pattern to be filled in the surface, unless 'skin' in "
           "the sensor file says what it is";
  return palpate::text("markers: %.1f px wide, %.1f px apart; left out of the fit, filled in the surface",
                       markers->size_px, markers->spacing_px);
}

std::string noise_text(const PhotometricCalibration& by) {
  if (by.noise_sd <= 0) return "";
  return ", noise " + fixed(by.noise_sd, 4) + ", the rest alike over " + fixed(by.pad_reach_px, 0) + " px";
}

std::string summary(const Fitted& fitted, const Sensor& sensor) {
  const PhotometricFitResult& result = fitted.result;
  std::string text = "all: normals " + fixed(result.normal_rms_held_out, 4) + " (fitted " +
                     fixed(result.normal_rms_fitted, 4) + noise_text(result.calibration) + "), " +
                     fixed(result.normal_angle_deg, 2) + " deg, depth " + fixed(result.depth_rmse_mm, 4) +
                     " mm RMS on presses held out, depth gain " + fixed(result.depth_gain, 3) + ", " +
                     fixed(100 * result.explained_x, 1) + " / " + fixed(100 * result.explained_y, 1) +
                     " % of n_x / n_y explained, condition " + fixed(result.condition, 1) +
                     (result.ridge > 0 ? ", regularised" : "") + "\n" + models_text(result);
  if (fitted.masked) text += "\n" + markers_text(sensor);
  return text;
}

json::Value contact_json(const PressContact& c) {
  return {{"signal", to_string(c.signal)},
          {"change_upwards", c.brighter},
          {"contact_gray", c.contact_gray},
          {"untouched_gray", c.rest_gray},
          {"threshold_gray", c.threshold_gray},
          {"contact_gray_per_px", c.contact_gray_per_px},
          {"gradient_gray_per_px", c.gradient_gray_per_px}};
}

CalibrationReport report_of(const Fitted& fitted, const Sensor& sensor, const PressVerdict& verdict,
                            const CalibrationRun& run, const PhotometricRequest& options,
                            const std::optional<PressContact>& contact, const KeptSensor& kept) {
  const PhotometricFitResult& result = fitted.result;
  json::Value presses = json::Value::array();
  const std::string error = "depth to " + error_text(result.depth_rmse_mm, result.cap_rms_mm) +
                            " on presses held out; " + gain_text(result, fitted.found);
  std::string text = describe(verdict, error);
  text +=
      "\npress                       center_px       radius_px  normal_deg  depth_rmse_mm  depth_gain   "
      "(fitted "
      "without it)\n";
  for (size_t i = 0; i < result.presses.size(); ++i)
    presses.push_back(add_press(result.presses[i], fitted.found.presses[i], text));
  json::Value value = {{"sensor", run.out.string()},
                       {"presses", presses},
                       {"refused", refused_json(fitted.found)},
                       {"untouched_frames", fitted.found.untouched},
                       {"markers_masked", fitted.masked},
                       {"model", result.model().order.name},
                       {"models", models_json(result)}};
  value.update({{"contact_px", result.contact_px},
                {"followed_share", result.followed_share},
                {"rest_weight", options.rest_weight},
                {"condition", result.condition},
                {"ridge", result.ridge},
                {"explained_x", result.explained_x},
                {"explained_y", result.explained_y},
                {"normal_rms_fitted", result.normal_rms_fitted},
                {"normal_rms_held_out", result.normal_rms_held_out},
                {"noise_sd", result.calibration.noise_sd},
                {"pad_reach_px", result.calibration.pad_reach_px},
                {"normal_angle_deg_held_out", result.normal_angle_deg},
                {"depth_rmse_held_out_mm", result.depth_rmse_mm},
                {"cap_rms_mm", result.cap_rms_mm},
                {"depth_share_of_caps", result.cap_rms_mm > 0 ? result.depth_rmse_mm / result.cap_rms_mm : 0},
                {"depth_gain_held_out", result.depth_gain}});
  if (const SkinPattern* markers = filled_markers(sensor); markers && fitted.masked)
    value["markers"] = {{"size_px", markers->size_px},
                        {"spacing_px", markers->spacing_px},
                        {"spacing_mm", markers->spacing_px * sensor.pitch_mm_per_px}};
  add_verdict(verdict, error, value);
  const PressedPart part = pressed_part(sensor, fitted.found.format);
  value["seen_share"] = part.share;
  value["seen_text"] = part.text;
  value["seen_little"] = part.little();
  text += refused_text(fitted.found) + (part.little() ? "WARNING: " : "") + part.text + "\n" +
          summary(fitted, sensor);
  if (contact) {
    value["contact"] = contact_json(*contact);
    text += "\n" + describe(*contact);
  }
  if (!kept.background.empty()) value["background"] = kept.background;
  if (!kept.line.empty()) text += "\n" + kept.line;
  return {text, value};
}

}  // namespace

CalibrationReport calibrate_photometric(const PhotometricRequest& options, const CalibrationRun& run) {
  check_ball_options(options);
  const Sensor original = checked_sensor(options);
  const Sensor reading = with_background(original, options);
  BallPresses found = presses_of(run, options, reading, !options.keep_markers, 2);
  if (run.watch.stopped()) return {.stopped = true};
  const Fitted fitted = fit_found(std::move(found), reading, options);
  const PressVerdict verdict = judge_presses(fitted.found, options, reading);
  Sensor sensor = calibrated(original, fitted, options);
  std::optional<PressContact> contact;
  if (!options.keep_contact) apply(contact.emplace(contact_of_presses(fitted.found, sensor.filter)), sensor);
  const KeptSensor kept = keep_sensor(sensor, options.background, run, options.sensor.empty());
  CalibrationReport report = report_of(fitted, sensor, verdict, run, options, contact, kept);
  report.sensor = std::move(sensor);
  return report;
}

}  // namespace palpate
