// palpate setup: from recordings of a sensor of one's own to its sensor file, step by step. Each step is a
// command of its own and can be done again alone.
#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/calibrate/pad_corners.h"
#include "capture/calibrate/untouched_recording.h"
#include "capture/files/images/images.h"
#include "capture/open_source.h"
#include "capture/run/input.h"
#include "capture/v4l2/camera_options.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "viz/commands/calibrate/calibrate.h"
#include "viz/commands/command.h"
#include "viz/commands/options.h"
#include "viz/commands/progress.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string input;
  fs::path background, balls, gauge, grid_pictures, grid_rest;
  std::string corners = "none", grid, pattern = "dots", name, surface = "auto";
  double pitch_mm_per_px = 0, ball_mm = 0, spacing_mm = 0;
};

struct Step {
  std::string name;
  bool done = false;
  std::string known;    ///< or what went wrong
  std::string missing;  ///< what would make it known
  std::string command;  ///< that does it again, alone
};

std::string quoted(const std::string& word) {
  const bool plain = !word.empty() && word.find_first_of(" '\"?&*;()$<>|\\") == std::string::npos;
  return plain ? word : "'" + word + "'";
}

/// Runs one `palpate calibrate` command in this program; its report.
Report run_calibrate(const std::vector<std::string>& words) {
  CommandLine program("", "palpate");
  Common common;
  Command chosen;
  add_calibrate(program, common, chosen);
  std::vector<std::string> all = {"calibrate"};
  all.insert(all.end(), words.begin(), words.end());
  const Parsed parsed = program.parse(all);
  if (!parsed.done) throw Error(Failure::Usage, "a calibration", parsed.text, "palpate help calibrate");
  return chosen();
}

class Setup {
 public:
  Setup(const Common& common, const Options& options) : common_(common), options_(options) {}

  Report run() {
    catch_interrupts();
    frame();
    untouched();
    scale();
    surface();
    force();
    return report();
  }

 private:
  /// Runs a calibration as a step: what it says is in the report, a refusal is what is missing.
  json::Value calibrate(Step& step, std::vector<std::string> words) {
    words.insert(words.end(), {"--sensor", common_.out.string(), "--out", common_.out.string()});
    said_.clear();
    step.command = "palpate calibrate";
    for (const std::string& word : words) step.command += " " + quoted(word);
    words.emplace_back("--quiet");
    try {
      const Report done = run_calibrate(words);
      interrupted_ = interrupted_ || done.exit_code == kInterrupted;
      step.done = done.exit_code == 0;
      said_ = done.text;
      return done.json.empty() ? json::Value() : json::parse(done.json);
    } catch (const Error& error) {
      step.known = error.what();
      return {};
    }
  }

  void frame() {
    Step step{"frame", true, "", "", ""};
    Sensor sensor = bare_sensor(options_.input);
    sensor.name = options_.name.empty() ? common_.out.stem().string() : options_.name;
    if (options_.pitch_mm_per_px > 0) sensor.pitch_mm_per_px = options_.pitch_mm_per_px;
    const std::unique_ptr<Source> source = open_source(options_.input, sensor);
    const FrameFormat f = source->format();
    step.known =
        text("%u x %u px, %s, %u bits", f.width, f.height, f.channels == 3 ? "colour" : "gray", f.bit_depth);
    if (source->rate_Hz() > 0) step.known += text(", %.4g frames/s", source->rate_Hz());
    cut(step, sensor, *source);
    save_sensor(sensor, common_.out);
    steps_.push_back(step);
  }

  /// Corners as they are given, or proposed from the lit part of the picture.
  void cut(Step& step, Sensor& sensor, Source& source) {
    if (options_.corners != "none" && options_.corners != "auto") {
      std::array<std::array<double, 2>, 4> quad{};
      const std::vector<double> numbers = parsed_corners();
      for (size_t i = 0; i < 8; ++i) quad[i / 2][i % 2] = numbers[i];
      rectify(sensor, quad, source.format());
      step.known +=
          text("; straightened to %u x %u px by the corners given", sensor.size_px[0], sensor.size_px[1]);
      return;
    }
    Frame first;
    if (!options_.background.empty()) {
      const std::unique_ptr<Source> rest = open_source(options_.background.string(), sensor);
      if (!rest->next(first)) return;
    } else if (is_camera(options_.input) || !source.next(first)) {
      return;
    }
    const std::optional<PadCorners> found = propose_corners(first);
    if (!found) return;
    std::string corners;
    for (const auto& corner : found->quad_px)
      for (const double value : corner) corners += (corners.empty() ? "" : ",") + text("%.0f", value);
    if (options_.corners == "auto") {
      rectify(sensor, found->quad_px, source.format());
      step.known += "; straightened by corners found in the light: " + corners;
    } else {
      step.missing =
          text("the light fills %.0f %% of the picture; if that is the pad: --corners %s (or auto)",
               100 * found->share, corners.c_str());
    }
  }

  std::vector<double> parsed_corners() const {
    std::vector<double> numbers;
    std::string rest = options_.corners + ",";
    for (size_t end; (end = rest.find(',')) != std::string::npos; rest.erase(0, end + 1)) {
      char* stop = nullptr;
      const std::string number = rest.substr(0, end);
      numbers.push_back(std::strtod(number.c_str(), &stop));
      if (number.empty() || *stop != '\0') numbers.clear();
    }
    if (numbers.size() != 8)
      throw Error(Failure::Usage,
                  "four corners, x and y in px: top left, top right, bottom right, bottom left",
                  "--corners " + options_.corners, "--corners 83,97,457,132,466,368,89,413, or auto");
    return numbers;
  }

  static void rectify(Sensor& sensor, const std::array<std::array<double, 2>, 4>& quad,
                      const FrameFormat& camera) {
    sensor.quad_px = quad;
    sensor.size_px = size_of(quad);
    sensor.camera_px = {camera.width, camera.height};
  }

  void untouched() {
    Step step{"untouched image", false, "", "", ""};
    const std::string input = options_.background.empty() ? options_.input : options_.background.string();
    const json::Value found = calibrate(step, {"background", input, "--set-threshold"});
    if (step.done) {
      const auto used = found.at("frames_used").number();
      step.known = used > 1 ? text("mean of %.0f frames, noise %.2f gray a pixel", used,
                                   found.at("noise_gray").number())
                            : "one picture";
      if (found.contains("doubt") && !found.at("doubt").text().empty())
        step.missing = found.at("doubt").text();
    } else {
      step.missing = "a picture of the pad at rest: --background FILE";
    }
    steps_.push_back(step);
    touch();
  }

  /// Signal, threshold and kind of gel, by what the recording's touches change.
  void touch() {
    Step step{"touch", false, "", "", ""};
    if (!steps_.back().done || is_camera(options_.input)) {
      step.missing = is_camera(options_.input)
                         ? "a recording of a touch: palpate record, then palpate setup with it"
                         : "the untouched image";
      steps_.push_back(step);
      return;
    }
    Sensor sensor = load_sensor(common_.out);
    const UntouchedRecording found =
        judge_touches(options_.input, sensor, [](uint64_t) { return !interrupted(); });
    if (found.touched_frames == 0) {
      step.missing = "a recording in which something touches the pad";
      steps_.push_back(step);
      return;
    }
    step.done = true;
    colour_ = sensor.channels == 3 && shows_slopes_by_colour(found);
    sensor.signal = signal_of(found);
    if (!colour_ && sensor.channels == 3) sensor.channels = 1;
    sensor.threshold_gray = found.threshold_gray;
    save_sensor(sensor, common_.out);
    step.known = text("%s: touch changes the picture %s; threshold %.1f gray",
                      colour_                             ? "a gel that shows slopes by colour"
                      : sensor.signal == Signal::Brighter ? "a pad that lights up"
                                                          : "a gray gel",
                      to_string(sensor.signal), sensor.threshold_gray);
    steps_.push_back(step);
  }

  void scale() {
    Step step{"scale", false, "", "", ""};
    if (!options_.grid.empty()) {
      std::vector<std::string> words = {"scale",        options_.grid_pictures.string(),
                                        "--grid",       options_.grid,
                                        "--pattern",    options_.pattern,
                                        "--spacing-mm", text("%g", options_.spacing_mm)};
      if (!options_.grid_rest.empty())
        words.insert(words.end(), {"--background", options_.grid_rest.string()});
      const json::Value found = calibrate(step, words);
      if (step.done)
        step.known = text("%.5f +- %.5f mm per px, from the grid", found.at("pitch_mm_per_px").number(),
                          found.at("pitch_sd_mm_per_px").number());
    } else if (options_.pitch_mm_per_px > 0) {
      step.done = true;
      step.known = text("%.5g mm per px, as given", options_.pitch_mm_per_px);
    }
    if (!step.done)
      step.missing =
          "--pitch MM_PER_PX, or a picture of a grid: --grid-pictures FILE --grid 9x7 --spacing-mm 2.5; "
          "until "
          "then lengths are in px";
    steps_.push_back(step);
  }

  void surface() {
    Step step{"surface", false, "", "", ""};
    const Sensor sensor = load_sensor(common_.out);
    const bool wanted = options_.ball_mm > 0;
    if (wanted && has_scale(sensor)) {
      const bool by_colour = options_.surface == "photometric" || (options_.surface == "auto" && colour_);
      const std::string presses = options_.balls.empty() ? options_.input : options_.balls.string();
      std::vector<std::string> words = {by_colour ? "photometric" : "lookup", presses, "--ball-mm",
                                        text("%g", options_.ball_mm)};
      const json::Value found = calibrate(step, words);
      if (step.done)
        step.known = text("%s, depth %.3f mm RMS on presses held out",
                          by_colour ? "slopes by colour" : "depth by brightness",
                          found.at("depth_rmse_held_out_mm").number());
    }
    if (!step.done)
      step.missing = !wanted             ? "presses of a ball: --ball-mm RADIUS [--balls FOLDER]"
                     : has_scale(sensor) ? "presses in which the ball is seen whole, away from the border"
                                         : "the scale, before presses of a ball tell depth";
    steps_.push_back(step);
  }

  void force() {
    Step step{"force", false, "", "", ""};
    if (!options_.gauge.empty()) {
      calibrate(step, {"force", options_.input, "--gauge", options_.gauge.string()});
      // The first line is the verdict; a calibration that is not fit for use is in the file and says so.
      if (!said_.empty()) step.known = said_.substr(0, said_.find('\n'));
    }
    if (!step.done)
      step.missing = options_.gauge.empty() ? "a force gauge's table of the recording: --gauge FILE"
                                            : "a gauge's table that fits the recording, see above";
    steps_.push_back(step);
  }

  Report report() const {
    Report report;
    json::Value list = json::Value::array();
    std::string missing;
    for (const Step& step : steps_) {
      const std::string mark = step.done ? "known  " : "MISSING";
      report.text += text("%s  %-16s %s\n", mark.c_str(), step.name.c_str(), step.known.c_str());
      if (!step.missing.empty()) report.text += text("         %-16s -> %s\n", "", step.missing.c_str());
      if (!step.command.empty())
        report.text += text("         %-16s    again: %s\n", "", step.command.c_str());
      list.push_back({{"step", step.name},
                      {"known", step.done},
                      {"what", step.known},
                      {"missing", step.missing},
                      {"again", step.command}});
    }
    report.text += "written: " + common_.out.string() + "\ntry it: palpate live " + quoted(options_.input) +
                   " --sensor " + quoted(common_.out.string());
    report.json = json::Value{{"sensor", common_.out.string()}, {"steps", list}}.dump(2, json::Utf8::Replace);
    const bool stopped = interrupted() || interrupted_;
    report.exit_code = stopped ? kInterrupted : 0;
    return report;
  }

  const Common& common_;
  const Options& options_;
  std::vector<Step> steps_;
  std::string said_;  ///< by the last calibration
  bool colour_ = false, interrupted_ = false;
};

}  // namespace

void add_setup(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command = program.add_subcommand(
      "setup", "A sensor of your own: from recordings to its sensor file, step by step");
  auto o = std::make_shared<Options>();
  command
      ->add_option("INPUT", o->input,
                   "Recording of touches: video, folder of images, session; or camera:NODE")
      ->required()
      ->check(input_exists);
  command->add_option("--background", o->background, "Picture of the pad at rest (default: found in INPUT)")
      ->check(Check::existing_file());
  command->add_option(
      "--corners", o->corners,
      "Corners of the pad in the picture, px: top left, top right, bottom right, bottom left as "
      "x,y,x,y,x,y,x,y; auto: those of the light");
  command->add_option("--pitch", o->pitch_mm_per_px, "Scale, mm per px, where it is known")
      ->check(Check::range(1e-6, 100.0));
  command->add_option("--grid-pictures", o->grid_pictures,
                      "Pictures of a grid with known spacing, for the scale");
  command
      ->add_option("--grid-background", o->grid_rest,
                   "Picture of the pad at rest beside a grid that is pressed")
      ->check(Check::existing_file());
  command->add_option("--grid", o->grid, "COLUMNSxROWS of that grid");
  command->add_option("--pattern", o->pattern, "What the grid is made of: chessboard or dots")
      ->check(Check::one_of({"chessboard", "dots"}))
      ->capture_default_str();
  command->add_option("--spacing-mm", o->spacing_mm, "From one point of the grid to the next")
      ->check(Check::range(1e-3, 1000.0));
  command->add_option("--ball-mm", o->ball_mm, "Radius of a ball that is pressed, for depth")
      ->check(Check::range(0.01, 1000.0));
  command->add_option("--balls", o->balls, "Recording of its presses (default: INPUT)");
  command
      ->add_option("--surface", o->surface,
                   "How depth is read: auto (by what a touch changes), photometric, lookup")
      ->check(Check::one_of({"auto", "photometric", "lookup"}))
      ->capture_default_str();
  command
      ->add_option("--gauge", o->gauge,
                   "A force gauge's table of INPUT: CSV with frame or time_s, and force_N")
      ->check(Check::existing_file());
  command->add_option("--name", o->name, "Name of the sensor (default: the file's)");
  command->add_option("--out", common.out, "Sensor file to write; it is begun anew")
      ->required()
      ->option_text("FILE (required)");
  add_common(
      *command, common,
      "  palpate setup press.avi --out pad.json\n"
      "  palpate setup presses/ --background rest.png --ball-mm 3 --pitch 0.0593 --out gel.json\n"
      "  palpate setup press.avi --gauge press.csv --corners auto --out pad.json\n"
      "Tells of each step what is known, what is missing and how to get it, and which command does that "
      "step again alone.\n");
  command->callback([&common, &chosen, o] { chosen = [&common, o] { return Setup(common, *o).run(); }; });
}

}  // namespace palpate
