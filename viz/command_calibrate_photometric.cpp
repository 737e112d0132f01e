// palpate calibrate photometric: presses of a known ball in, a sensor file with its colour calibration out.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>

#include "capture/source.h"
#include "engine/error.h"
#include "engine/sensor.h"
#include "engine/solve/photometric_fit.h"
#include "viz/command.h"
#include "viz/command_calibrate.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeader = "image,center_x_px,center_y_px,contact_radius_px,ball_radius_mm";

struct Options {
  fs::path input;
  fs::path sensor;
  fs::path balls;
  fs::path background;
  double rest_weight = 1;
};

/// One row of balls.csv: a frame and the ball pressed in it.
struct Ball {
  std::string image;  // as written
  fs::path file;
  uint64_t frame = 0;
  std::array<double, 4> numbers{};  // center x, y, contact radius (px), ball radius (mm)
};

bool parse(std::string_view text, auto& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == ',')
      cells.emplace_back();
    else if (c != '\r')
      cells.back() += c;
  }
  return cells;
}

/// "name.png" or "name.avi#12" below a folder, "12" of a single file.
void locate(Ball& ball, const fs::path& input, const std::string& where) {
  const bool folder = fs::is_directory(input);
  const size_t hash = ball.image.rfind('#');
  const std::string number =
      hash == std::string::npos ? (folder ? "" : ball.image) : ball.image.substr(hash + 1);
  const std::string name = hash == std::string::npos ? ball.image : ball.image.substr(0, hash);
  ball.file = folder ? input / name : input;
  if (!number.empty() || !folder) {
    if (!parse(number, ball.frame))
      throw Error(
          Failure::Input, "a frame number in " + where, "'" + ball.image + "'",
          folder ? "FILE or FILE#FRAME, frames counted from 0" : "the frame's number, counted from 0");
  }
}

std::vector<Ball> read_balls(const fs::path& file, const fs::path& input) {
  std::ifstream stream(file);
  if (!stream)
    throw Error(Failure::Input, "a table of pressed balls", "no readable file " + file.string(),
                std::string("a CSV file with the columns ") + kHeader);
  std::vector<Ball> balls;
  std::string line;
  for (size_t row = 1; std::getline(stream, line); ++row) {
    const std::string where = file.string() + " line " + std::to_string(row);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (row == 1) {
      if (line != kHeader)
        throw Error(Failure::Input, std::string("the header ") + kHeader, "'" + line + "'",
                    "naming the columns of " + file.string() + " so");
      continue;
    }
    if (line.empty() || line.front() == '#') continue;
    const std::vector<std::string> cells = split(line);
    Ball ball;
    bool good = cells.size() == 5 && !cells[0].empty();
    for (size_t i = 0; good && i < 4; ++i)
      good = parse(cells[i + 1], ball.numbers[i]) && std::isfinite(ball.numbers[i]);
    if (!good)
      throw Error(Failure::Input, "an image and four numbers in " + where, "'" + line + "'",
                  std::string("columns ") + kHeader);
    ball.image = cells[0];
    locate(ball, input, where);
    balls.push_back(std::move(ball));
  }
  if (balls.empty())
    throw Error(Failure::Input, "pressed balls in " + file.string(), "no rows",
                std::string("rows of ") + kHeader);
  return balls;
}

/// Fills the fit from the balls' frames; each file is opened once and read to the last frame that it is
/// wanted for.
void add_balls(std::vector<Ball> balls, const Sensor& sensor, std::optional<PhotometricFit>& fit) {
  std::stable_sort(balls.begin(), balls.end(), [](const Ball& a, const Ball& b) {
    return std::tie(a.file, a.frame) < std::tie(b.file, b.frame);
  });
  for (size_t i = 0; i < balls.size();) {
    const fs::path file = balls[i].file;
    const std::unique_ptr<Source> source = open_source(file.string(), sensor);
    if (sensor.background.image.empty() && source->frame_count() == 1)
      throw Error(Failure::Input, "an untouched image to compare " + file.string() + " with", "none",
                  "--background IMAGE, or \"background\": {\"image\": ...} in the sensor file");
    const Frame background = load_background(file.string(), sensor, *source);
    if (!fit) fit.emplace(source->format(), sensor.pitch_mm_per_px);
    Frame frame;
    uint64_t next = 0;
    for (; i < balls.size() && balls[i].file == file; ++i) {
      const Ball& ball = balls[i];
      bool found = next > ball.frame;
      while (next <= ball.frame && (found = source->next(frame))) ++next;
      if (!found || next != ball.frame + 1)
        throw Error(Failure::Input, "frame " + std::to_string(ball.frame) + " of " + file.string(),
                    std::to_string(next) + " frames", "frame numbers counted from 0");
      fit->add_ball(frame, background, ball.numbers[0], ball.numbers[1], ball.numbers[2], ball.numbers[3],
                    ball.image);
    }
  }
}

std::string fixed(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

Report photometric(const Common& common, const Options& options) {
  const Sensor original = load_sensor(options.sensor);
  if (original.channels != 3)
    throw Error(Failure::Sensor, "a colour sensor (\"channels\": 3) in " + options.sensor.string(),
                std::to_string(original.channels) + " channel", "another sensor file");
  if (original.background.kind == BackgroundKind::None)
    throw Error(Failure::Sensor, "a sensor with an untouched image in " + options.sensor.string(),
                "background.source 'none'", "frames as the camera sees them: slopes need a change's sign");
  Sensor reading = original;
  if (!options.background.empty()) reading.background.image = fs::absolute(options.background).string();
  std::optional<PhotometricFit> fit;
  add_balls(read_balls(options.balls, options.input), reading, fit);
  const PhotometricFitResult result = fit->solve(options.rest_weight);

  Sensor calibrated = original;
  calibrated.reading = Reading::Photometric;
  calibrated.photometric = result.calibration;
  save_sensor(calibrated, common.out);

  nlohmann::ordered_json presses = nlohmann::ordered_json::array();
  std::string text =
      "press                      contact_px  normal_rms  depth_rmse_mm  depth_gain   (fitted without it)\n";
  for (const HeldOutPress& p : result.presses) {
    presses.push_back({{"press", p.label},
                       {"contact_px", p.contact_px},
                       {"normal_rms", p.normal_rms},
                       {"depth_rmse_mm", p.depth_rmse_mm},
                       {"depth_gain", p.depth_gain}});
    char row[256];
    std::snprintf(row, sizeof row, "%-26.80s %10llu %11.4f %14.4f %11.3f\n", p.label.c_str(),
                  static_cast<unsigned long long>(p.contact_px), p.normal_rms, p.depth_rmse_mm, p.depth_gain);
    text += row;
  }
  const nlohmann::ordered_json value = {{"sensor", common.out.string()},
                                        {"presses", presses},
                                        {"contact_px", result.contact_px},
                                        {"rest_weight", options.rest_weight},
                                        {"condition", result.condition},
                                        {"ridge", result.ridge},
                                        {"explained_x", result.explained_x},
                                        {"explained_y", result.explained_y},
                                        {"normal_rms_fitted", result.normal_rms_fitted},
                                        {"normal_rms_held_out", result.normal_rms_held_out},
                                        {"depth_rmse_held_out_mm", result.depth_rmse_mm},
                                        {"depth_gain_held_out", result.depth_gain}};
  text += "all: normals " + fixed(result.normal_rms_held_out, 4) + " (fitted " +
          fixed(result.normal_rms_fitted, 4) + "), depth " + fixed(result.depth_rmse_mm, 4) +
          " mm RMS on presses held out, depth gain " + fixed(result.depth_gain, 3) + ", " +
          fixed(100 * result.explained_x, 1) + " / " + fixed(100 * result.explained_y, 1) +
          " % of n_x / n_y explained, condition " + fixed(result.condition, 1) +
          (result.ridge > 0 ? ", regularised" : "") + "\nwritten: " + common.out.string();
  return {text, value.dump(2), 0};
}

}  // namespace

void add_calibrate_photometric(CLI::App& group, Common& common, Command& chosen) {
  CLI::App* command =
      group.add_subcommand("photometric", "Colour to slope of a gel sensor, from presses of a known ball");
  auto options = std::make_shared<Options>();
  command
      ->add_option("INPUT", options->input, "Folder of the images or videos that --balls names, or one video")
      ->required()
      ->check(CLI::ExistingPath);
  command->add_option("--sensor", options->sensor, "Sensor file to start from: pitch, crop, quad, channels")
      ->required();
  command
      ->add_option("--balls", options->balls,
                   std::string("Table of presses, px of the rectified frame: ") + kHeader)
      ->required();
  command
      ->add_option("--background", options->background,
                   "Untouched image (default: the sensor file's, or a video's first frames)")
      ->check(CLI::ExistingFile);
  command
      ->add_option("--rest-weight", options->rest_weight,
                   "Weight of the untouched parts: more where the light drifts, less where it is noisy")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command->add_option("--out", common.out, "Sensor file to write")->required();
  add_common(*command, common,
             "  palpate calibrate photometric presses/ --sensor gel.json --balls balls.csv \\\n"
             "      --background presses/untouched.png --out gel_calibrated.json\n"
             "In balls.csv `image` is a file below INPUT, FILE#FRAME for a frame of a video (from 0), or the "
             "frame's\n"
             "number where INPUT is one video. Errors are of presses that the fit did not use, left out one "
             "at a time;\n"
             "depth_gain is measured over true depth within the contact, 1 is right.\n");
  command->callback(
      [&common, &chosen, options] { chosen = [&common, options] { return photometric(common, *options); }; });
}

}  // namespace palpate
