// palpate calibrate scale: from an object of known size to mm per pixel and the lens's distortion.
#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>

#include "capture/calibrate/background.h"
#include "capture/calibrate/origin.h"
#include "capture/calibrate/presses.h"
#include "capture/calibrate/scale.h"
#include "capture/open_source.h"
#include "capture/run/input.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "palpate/sensor.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/command.h"
#include "viz/commands/options.h"
#include "viz/commands/progress.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string input;
  fs::path sensor;
  fs::path background;
  std::string grid;
  GridPattern pattern = GridPattern::Chessboard;
  double spacing_mm = 0;
  double spacing_sd = 0.002;
  double ring_mm = 0;
  double ball_mm = 0;
  std::vector<double> travel_mm;
};

// Largest number of pictures searched for a grid; more add no information.
constexpr uint32_t kMostPictures = 40;

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
std::optional<Frame> rest_image(const Options& options, const Sensor& reading) {
  if (reading.background.image.empty()) return std::nullopt;
  const std::unique_ptr<Source> source = open_source(options.input, reading);
  return load_background(options.input, reading, *source);
}

Found by_grid(const Options& options, const Sensor& reading, Sensor& sensor) {
  const auto [columns, rows] = grid_size(options.grid);
  if (!(options.spacing_mm > 0)) throw Error(Failure::Usage, "the grid's spacing", "none", "--spacing-mm 2");
  const std::vector<Frame> pictures =
      take_frames(options.input, reading, kMostPictures, 1, [](uint64_t) { return !interrupted(); });
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
  found.value = {{"pictures", pictures.size()},
                 {"views", views.size()},
                 {"points", views.size() * static_cast<size_t>(columns * rows)},
                 {"distortion_terms", fit.terms},
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
  return found;
}

Found by_scale(const Scale& scale, Sensor& sensor) {
  sensor.pitch_mm_per_px = scale.pitch_mm_per_px;
  sensor.pitch_sd_mm_per_px = scale.pitch_sd_mm_per_px;
  return {{{"measured_px", scale.size_px}, {"note", scale.note}}, scale.note + "\n"};
}

Found by_ring(const Options& options, const Sensor& reading, Sensor& sensor) {
  const std::optional<Frame> rest = rest_image(options, reading);
  if (!rest)
    throw Error(Failure::Input, "an untouched image to see the ring against", "none", "--background IMAGE");
  const std::vector<Frame> pictures =
      take_frames(options.input, reading, 1, 1, [](uint64_t) { return true; });
  if (pictures.empty()) throw Error(Failure::Input, "a picture in " + options.input, "none", "another input");
  return by_scale(scale_from_ring(pictures.front(), *rest, options.ring_mm), sensor);
}

Found by_ball(const Options& options, const Sensor& reading, Sensor& sensor) {
  const std::optional<Frame> rest = rest_image(options, reading);
  if (!rest)
    throw Error(Failure::Input, "an untouched image to see the ball against", "none", "--background IMAGE");
  const std::vector<Frame> pictures =
      take_frames(options.input, reading, kMostPictures, 1, [](uint64_t) { return !interrupted(); });
  // The search does not depend on the scale; the ball is taken as large as any contact.
  const BallSearch search{1e6, 1e-3, reading.threshold_gray};
  std::vector<double> radii;
  for (const Frame& picture : pictures) {
    const FoundBall ball = reading.channels == 3 ? find_ball(picture, *rest, {}, search)
                                                 : find_gray_ball(picture, *rest, {}, reading.signal, search);
    if (ball.good()) radii.push_back(ball.radius_px);
  }
  if (radii.empty())
    throw Error(Failure::Input, "a pressed ball in " + options.input,
                "none in " + std::to_string(pictures.size()) + " pictures",
                "presses away from the border, and the untouched --background");
  if (options.travel_mm.empty()) {
    const double widest = *std::max_element(radii.begin(), radii.end());
    throw Error(
        Failure::Input,
        "what tells the scale: a contact's size goes with depth, and its colours with slope, at any scale",
        std::to_string(radii.size()) + " contacts up to " + std::to_string(widest) +
            " px radius, which say only that the pitch is below " + std::to_string(options.ball_mm / widest) +
            " mm per px",
        "--travel-mm with the travel between the presses, --grid or --ring-mm");
  }
  return by_scale(scale_from_ball(radii, options.travel_mm, options.ball_mm), sensor);
}

Report scale(const Common& common, const Options& options) {
  if ((!options.grid.empty()) + (options.ring_mm > 0) + (options.ball_mm > 0) != 1)
    throw Error(Failure::Usage, "one of --grid, --ring-mm and --ball-mm", "none or more",
                "--grid 9x6 --spacing-mm 2");
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
  catch_interrupts();
  const Found found = !options.grid.empty() ? by_grid(options, reading, sensor)
                      : options.ring_mm > 0 ? by_ring(options, reading, sensor)
                                            : by_ball(options, reading, sensor);
  if (interrupted()) return {"", "", kInterrupted};
  if (options.sensor.empty()) sensor.name = common.out.stem().string();
  const fs::path background = keep_background(options.background, common.out, sensor);
  save_sensor(sensor, common.out);
  json::Value value = {{"sensor", common.out.string()},
                       {"pitch_mm_per_px", sensor.pitch_mm_per_px},
                       {"pitch_sd_mm_per_px", sensor.pitch_sd_mm_per_px}};
  value.update(found.value);
  const std::string line =
      palpate::text("pitch: %.6f +- %.6f mm per px (%.2f %%)\n", sensor.pitch_mm_per_px,
                    sensor.pitch_sd_mm_per_px, 100 * sensor.pitch_sd_mm_per_px / sensor.pitch_mm_per_px);
  std::string all = found.text + line;
  if (original.force || original.shear || original.reconstruction != Reconstruction::None || original.flat)
    all +=
        "WARNING: force, shear, surface and flat field were calibrated at another scale: calibrate them "
        "again\n";
  all += "written: " + common.out.string();
  if (!background.empty()) all += " and " + background.string();
  return {all, value.dump(2), 0};
}

}  // namespace

void add_calibrate_scale(CommandLine& group, Common& common, Command& chosen) {
  CommandLine* command =
      group.add_subcommand("scale", "mm per pixel and lens distortion, from a grid, a ring or a ball");
  auto options = std::make_shared<Options>();
  command->add_option("INPUT", options->input, "Pictures: an image, a folder of images, a video")
      ->required()
      ->check(input_exists);
  command->add_option("--sensor", options->sensor,
                      "Sensor file to start from (default: only what the pictures say)");
  command->add_option("--grid", options->grid, "COLUMNSxROWS of a printed grid: inner corners, or dots");
  command->add_option("--pattern", options->pattern, "What the grid is made of: chessboard or dots")
      ->transform(one_of(std::map<std::string, GridPattern>{{"chessboard", GridPattern::Chessboard},
                                                            {"dots", GridPattern::Dots}}));
  command->add_option("--spacing-mm", options->spacing_mm, "From one point of the grid to the next")
      ->check(Check::range(1e-3, 1000.0));
  command
      ->add_option("--spacing-sd", options->spacing_sd,
                   "Relative standard error of that, as printers have it")
      ->check(Check::range(0.0, 0.5))
      ->capture_default_str();
  command->add_option("--ring-mm", options->ring_mm, "Outer diameter of a ring or disc pressed into the pad")
      ->check(Check::range(1e-3, 1000.0));
  command->add_option("--ball-mm", options->ball_mm, "Radius of a ball pressed several times")
      ->check(Check::range(1e-3, 1000.0));
  command
      ->add_option("--travel-mm", options->travel_mm,
                   "How deep each press of the ball went, in order, any zero")
      ->delimiter(',');
  command
      ->add_option("--background", options->background,
                   "Untouched image; a grid is then looked for in the change")
      ->check(Check::existing_file());
  command->add_option("--out", common.out, "Sensor file to write")
      ->required()
      ->option_text("FILE (required)");
  add_common(
      *command, common,
      "  palpate calibrate scale grid/ --grid 9x6 --spacing-mm 2 --sensor pad.json --out pad.json\n"
      "  palpate calibrate scale pegs.png --background rest.png --grid 9x7 --pattern dots \\\n"
      "      --spacing-mm 2.5 --sensor pad.json --out pad.json\n"
      "  palpate calibrate scale presses/ --ball-mm 3 --travel-mm 0.25,0.5,0.75,1 --background rest.png \\\n"
      "      --sensor gel.json --out gel.json\n"
      "A grid also sets lens, quad_px and size_px: the frame becomes what the first picture shows whole. A "
      "ball alone\n"
      "does not tell the scale; with its travel it does to about 13 %, for how a pad gives way beside it is "
      "not known.\n");
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return scale(common, *options); }; });
}

}  // namespace palpate
