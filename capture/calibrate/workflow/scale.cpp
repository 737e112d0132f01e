// From an object of known size to mm per pixel and the lens's distortion.
#include "capture/calibrate/workflow/workflow.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "capture/calibrate/background.h"
#include "capture/calibrate/frame/origin.h"
#include "capture/calibrate/frame/scale.h"
#include "capture/calibrate/photometric/presses.h"
#include "capture/calibrate/workflow/balls.h"
#include "capture/open_source.h"
#include "capture/run/input.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "palpate/sensor.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

// Largest number of pictures searched for a grid; more add no information.
constexpr uint32_t kMostScalePictures = 40;
constexpr double kFarReach = 0.7;  // of the way to the picture's corners

// NOLINTNEXTLINE(bugprone-exception-escape): moving JSON throws nothing
struct Found {
  json::Value value;
  std::string text;
};

std::array<int, 2> grid_size(const std::string& text) {
  std::array<int, 2> size{};
  const char* end = text.data() + text.size();
  const auto [cross, error] = std::from_chars(text.data(), end, size[0]);
  if (error != std::errc() || cross == end || *cross != 'x' ||
      std::from_chars(cross + 1, end, size[1]).ptr != end || size[0] < 3 || size[1] < 3 || size[0] > 200 ||
      size[1] > 200)
    throw Error(Failure::Usage, "--grid COLUMNSxROWS, 3 to 200 each", "'" + text + "'", "--grid 9x6");
  return size;
}

/// The untouched image, where one is named.
std::optional<Frame> rest_image(const ScaleRequest& options, const Sensor& reading) {
  if (reading.background.image.empty()) return std::nullopt;
  const std::unique_ptr<Source> source = open_source(options.input, reading);
  return load_background(options.input, reading, *source);
}

Found by_grid(const CalibrationRun& run, const ScaleRequest& options, const Sensor& reading, Sensor& sensor) {
  const auto [columns, rows] = grid_size(options.grid);
  if (!(options.spacing_mm > 0)) throw Error(Failure::Usage, "the grid's spacing", "none", "--spacing-mm 2");
  const std::vector<Frame> pictures = take_frames(options.input, reading, kMostScalePictures, 1,
                                                  [&run](uint64_t) { return !run.watch.stopped(); });
  const std::optional<Frame> rest = options.background.empty() ? std::nullopt : rest_image(options, reading);
  std::vector<GridView> views;
  for (const Frame& picture : pictures)
    if (auto view =
            find_grid(picture, rest ? &*rest : nullptr, options.pattern, columns, rows, options.spacing_mm))
      views.push_back(std::move(*view));
  if (views.empty())
    throw Error(
        Failure::Input, "a whole grid of " + options.grid + " points in " + options.input,
        "none in " + std::to_string(pictures.size()) + " pictures",
        options.pattern == GridPattern::Chessboard
            ? "--grid with inner corners (one less than squares), or --pattern dots"
            : "--grid COLUMNSxROWS as printed, a sharper or larger grid, --background for a pressed one");
  const uint32_t width = pictures.front().format.width, height = pictures.front().format.height;
  const GridFit fit = fit_grid(views, width, height);
  const PadFrame pad = pad_frame(fit, views.front(), width, height, options.spacing_sd);
  const double residual_mm = fit.lens.residual_px * pad.pitch_mm_per_px;
  const std::string note =
      palpate::text("grid %s of %g mm in %zu pictures, residual %.3f px", options.grid.c_str(),
                    options.spacing_mm, views.size(), fit.lens.residual_px);
  sensor.pitch_mm_per_px = pad.pitch_mm_per_px;
  sensor.pitch_sd_mm_per_px = pad.pitch_sd_mm_per_px;
  sensor.lens.reset();
  if (fit.terms > 0) {
    sensor.lens = fit.lens;
    sensor.lens->origin = origin_now(fs::path(options.input).filename().string(), note);
  }
  if (!sensor.crop_px) sensor.camera_px = {width, height};
  sensor.quad_px = pad.quad_px;
  sensor.size_px = pad.size_px;
  sensor.flat.reset();
  Found found;
  const bool few = 2 * views.size() < pictures.size();
  found.value = {{"warning", few ? "the grid was not found in most pictures" : ""},
                 {"pictures", pictures.size()},
                 {"views", views.size()},
                 {"points", views.size() * static_cast<size_t>(columns * rows)},
                 {"distortion_terms", fit.terms},
                 {"reach", fit.reach},
                 {"residual_px", fit.lens.residual_px},
                 {"residual_mm", residual_mm},
                 {"held_out_px", fit.held_out_px},
                 {"held_out_without_lens_px", fit.plain_px},
                 {"size_px", pad.size_px}};
  const std::string line = palpate::text(
      "grid found in %zu of %zu pictures; points lie %.3f px (%.4f mm) RMS from lens and plane; held out "
      "%.3f px,\nwithout distortion %.3f px; %d distortion terms\nframe: %u x %u px\n",
      views.size(), pictures.size(), fit.lens.residual_px, residual_mm, fit.held_out_px, fit.plain_px,
      fit.terms, pad.size_px[0], pad.size_px[1]);
  found.text = line;
  if (fit.reach < kFarReach)
    found.text += palpate::text(
        "the grid reaches %.0f %% of the way to the picture's corners: what the lens does beyond is not "
        "known\n",
        100 * fit.reach);
  if (few)
    found.text += palpate::text(
        "WARNING: the grid was not found in %zu of %zu pictures: is it the same grid, whole in view?\n",
        pictures.size() - views.size(), pictures.size());
  return found;
}

Found by_scale(const Scale& scale, Sensor& sensor) {
  sensor.pitch_mm_per_px = scale.pitch_mm_per_px;
  sensor.pitch_sd_mm_per_px = scale.pitch_sd_mm_per_px;
  return {{{"measured_px", scale.size_px}, {"note", scale.note}}, scale.note + "\n"};
}

Found by_ring(const ScaleRequest& options, const Sensor& reading, Sensor& sensor) {
  const std::optional<Frame> rest = rest_image(options, reading);
  if (!rest)
    throw Error(Failure::Input, "an untouched image to see the ring against", "none", "--background IMAGE");
  const std::vector<Frame> pictures =
      take_frames(options.input, reading, 1, 1, [](uint64_t) { return true; });
  if (pictures.empty()) throw Error(Failure::Input, "a picture in " + options.input, "none", "another input");
  return by_scale(scale_from_ring(pictures.front(), *rest, options.ring_mm), sensor);
}

/// Pictures in which a ball is pressed, in order: those whose contact was measured, and why others were not.
struct PressedBalls {
  std::vector<double> radii_px;
  std::vector<size_t> measured;  ///< their numbers among the pressed ones
  std::vector<std::string> refusals;
};

PressedBalls pressed_balls(const std::vector<Frame>& pictures, const Frame& rest, const Sensor& reading) {
  // The search does not depend on the scale; the ball is taken as large as any contact.
  const BallSearch search{PressedShape::ball(1e6), 1e-3, reading.threshold_gray};
  PressedBalls found;
  for (size_t i = 0; i < pictures.size(); ++i) {
    const FoundBall ball = reading.channels == 3
                               ? find_ball(pictures[i], rest, {}, search)
                               : find_gray_ball(pictures[i], rest, {}, reading.signal, search);
    if (ball.why == BallRefusal::Untouched) continue;
    if (ball.good()) {
      found.measured.push_back(found.radii_px.size() + found.refusals.size());
      found.radii_px.push_back(ball.radius_px);
    } else {
      found.refusals.push_back(palpate::text("picture %zu: ", i + 1) + ball.refusal);
    }
  }
  return found;
}

/// The travel of the measured ones: a press that is left out takes its travel with it.
std::vector<double> travel_of(const PressedBalls& found, const std::vector<double>& travel_mm) {
  const size_t pressed = found.radii_px.size() + found.refusals.size();
  if (travel_mm.size() != pressed)
    throw Error(Failure::Input, "one travel for each picture in which the ball is pressed",
                palpate::text("%zu travels for %zu pictures", travel_mm.size(), pressed) +
                    (found.refusals.empty() ? "" : " (not measured: " + found.refusals.front() + ")"),
                "--travel-mm with one number for each, in order");
  std::vector<double> travel;
  for (const size_t i : found.measured) travel.push_back(travel_mm[i]);
  return travel;
}

Found by_ball(const CalibrationRun& run, const ScaleRequest& options, const Sensor& reading, Sensor& sensor) {
  const std::optional<Frame> rest = rest_image(options, reading);
  if (!rest)
    throw Error(Failure::Input, "an untouched image to see the ball against", "none", "--background IMAGE");
  const std::vector<Frame> pictures = take_frames(options.input, reading, kMostScalePictures, 1,
                                                  [&run](uint64_t) { return !run.watch.stopped(); });
  const PressedBalls found = pressed_balls(pictures, *rest, reading);
  const std::vector<double>& radii = found.radii_px;
  if (radii.empty())
    throw Error(Failure::Input, "a pressed ball in " + options.input,
                "none in " + std::to_string(pictures.size()) + " pictures" +
                    (found.refusals.empty() ? "" : " (" + found.refusals.front() + ")"),
                "presses away from the border, and the untouched --background");
  if (options.travel_mm.empty()) {
    const double widest = *std::max_element(radii.begin(), radii.end());
    throw Error(Failure::Input,
                "something that fixes the scale: a contact's size follows the depth, and its colours the "
                "slope, at any scale",
                std::to_string(radii.size()) + " contacts up to " + std::to_string(widest) +
                    " px radius, which say only that the pitch is below " +
                    std::to_string(options.ball.radius() / widest) + " mm per px",
                "--travel-mm with the travel between the presses, --grid or --ring-mm");
  }
  const std::vector<double> travel_mm = travel_of(found, options.travel_mm);
  Found scale = by_scale(scale_from_ball(radii, travel_mm, options.ball.radius()), sensor);
  const size_t pressed = radii.size() + found.refusals.size();
  scale.value["presses"] = radii.size();
  scale.value["presses_left_out"] = found.refusals.size();
  if (found.refusals.empty()) return scale;
  scale.text += palpate::text("%zu of %zu presses used; not used: ", radii.size(), pressed);
  for (size_t i = 0; i < found.refusals.size(); ++i) scale.text += (i == 0 ? "" : "; ") + found.refusals[i];
  scale.text += "\n";
  if (radii.size() < found.refusals.size())
    scale.text += "WARNING: the scale is that of the lesser part of the presses: most were left out\n";
  return scale;
}

}  // namespace

CalibrationReport calibrate_scale(const ScaleRequest& options, const CalibrationRun& run) {
  if ((!options.grid.empty()) + (options.ring_mm > 0) + options.ball.times_given() != 1)
    throw Error(Failure::Usage, "one of --grid, --ring-mm, --ball-radius-mm and --ball-diameter-mm",
                "none or more", "--grid 9x6 --spacing-mm 2");
  const Sensor original = sensor_to_calibrate(options.input, options.sensor, ToMake::Scale);
  Sensor reading = original, sensor = original;
  if (!options.background.empty()) reading.background.image = fs::absolute(options.background).string();
  if (!options.grid.empty()) {
    // The grid determines the rectification, so it is searched in the camera's image, after the crop.
    reading.lens.reset();
    reading.quad_px.reset();
    reading.flat.reset();
    reading.size_px = {};
  }
  const Found found = !options.grid.empty() ? by_grid(run, options, reading, sensor)
                      : options.ring_mm > 0 ? by_ring(options, reading, sensor)
                                            : by_ball(run, options, reading, sensor);
  if (run.watch.stopped()) return {.stopped = true};
  const KeptSensor kept = keep_sensor(sensor, options.background, run, options.sensor.empty());
  json::Value value = {{"sensor", run.out.string()},
                       {"pitch_mm_per_px", sensor.pitch_mm_per_px},
                       {"pitch_sd_mm_per_px", sensor.pitch_sd_mm_per_px}};
  value.update(found.value);
  const std::string line =
      palpate::text("pitch: %.6f +- %.6f mm per px (%.2f %%)\n", sensor.pitch_mm_per_px,
                    sensor.pitch_sd_mm_per_px, 100 * sensor.pitch_sd_mm_per_px / sensor.pitch_mm_per_px);
  std::string all = found.text + line;
  if (original.force || original.shear || original.reading != SurfaceReading::None || original.flat)
    all +=
        "WARNING: force, shear, surface and flat field were calibrated at another scale: calibrate them "
        "again\n";
  all += kept.line;
  return {all, value, false, std::move(sensor)};
}

}  // namespace palpate
