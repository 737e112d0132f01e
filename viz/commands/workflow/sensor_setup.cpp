#include "viz/commands/workflow/sensor_setup.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>
#include <vector>

#include "capture/calibrate/frame/pad_corners.h"
#include "capture/calibrate/photometric/pad_match.h"
#include "capture/calibrate/photometric/shape_text.h"
#include "capture/calibrate/untouched_recording.h"
#include "capture/camera/camera_options.h"
#include "capture/open_source.h"
#include "capture/run/input.h"
#include "capture/sensors/nominal_sensors.h"
#include "engine/base/json.h"
#include "engine/base/shell_word.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "palpate/sensor.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"
#include "viz/commands/support/progress.h"

namespace palpate {

namespace fs = std::filesystem;

namespace {

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

/// One more thing on a line of its own.
void add_missing(SetupStep& step, const std::string& what) {
  step.missing += (step.missing.empty() ? "" : "\n") + what;
}

void rectify(Sensor& sensor, const SetupInputs::Quad& quad, const FrameFormat& camera) {
  sensor.quad_px = quad;
  sensor.size_px = size_of(quad);
  sensor.camera_px = {camera.width, camera.height};
}

/// What is stated of the kind of sensor; the step says what that leaves open.
void start_like(SetupStep& step, const NominalSensor& kind, const FrameFormat& camera, Sensor& sensor) {
  apply_nominal(kind, camera, sensor);
  step.known += "; nominal values of a " + kind.name;
  if (sensor.quad_px)
    step.known += text(", straightened to %u x %u square px", sensor.size_px[0], sensor.size_px[1]);
  for (const std::string& one : kind.not_known)
    step.missing += (step.missing.empty() ? "of this unit not known: " : ", ") + one;
}

/// Corners as they are given, or proposed from the lit part of the picture.
void cut_out(SetupStep& step, const SetupInputs& inputs, Sensor& sensor, Source& source) {
  if (inputs.corners) {
    rectify(sensor, *inputs.corners, source.format());
    step.known +=
        text("; straightened to %u x %u px by the corners given", sensor.size_px[0], sensor.size_px[1]);
    return;
  }
  Frame first;
  if (!inputs.background.empty()) {
    const std::unique_ptr<Source> rest = open_source(inputs.background.string(), sensor);
    if (!rest->next(first)) return;
  } else if (is_camera(inputs.recording) || !source.next(first)) {
    return;
  }
  const std::optional<PadCorners> found = propose_corners(first);
  if (!found) return;
  const std::string corners = to_text(found->quad_px);
  if (inputs.cut_to_light) {
    rectify(sensor, found->quad_px, source.format());
    step.known += "; straightened by corners found in the light: " + corners;
  } else {
    add_missing(step,
                text("the light fills %.0f %% of the picture; if that is the pad: --corners %s (or auto)",
                     100 * found->share, corners.c_str()));
  }
}

/// Printed markers, and how much of the pad the presses saw.
void add_extent(SetupStep& step, const json::Value& found) {
  if (const json::Value* markers = found.find("markers"))
    step.known += text(
        "; printed markers, %.1f px wide and %.1f px (%.2f mm) apart: left out of the fit, and the "
        "surface is filled under them",
        markers->at("size_px").number(), markers->at("spacing_px").number(),
        markers->at("spacing_mm").number());
  else if (found.at("markers_masked").boolean())
    step.known +=
        "; dark spots, too uneven for printed markers: left out of the fit, not filled in the surface";
  step.known += "; " + found.at("seen_text").text();
  if (found.at("seen_little").boolean()) add_missing(step, "presses in the rest of the pad");
}

/// Refuses an untouched image of another camera mode than the recording's, `wanted`.
void refuse_other_mode(const SetupInputs& inputs, const FrameFormat& wanted) {
  if (inputs.background.empty() || is_camera(inputs.recording)) return;
  const std::string background = inputs.background.string();
  const FrameFormat found = open_source(background, bare_sensor(background))->format();
  const auto described = [](const FrameFormat& f) {
    return text("%u x %u px, %u bits", f.width, f.height, f.bit_depth);
  };
  if (found.width == wanted.width && found.height == wanted.height && found.bit_depth == wanted.bit_depth)
    return;
  throw Error(Failure::Input, "a --background of " + described(wanted) + ", as " + inputs.recording,
              described(found) + " in " + background,
              "an untouched picture by the same camera mode, neither scaled nor cropped since");
}

/// The circles in a calibration's report, those that are not used among them.
std::vector<FoundPress> presses_of(const json::Value& report) {
  std::vector<FoundPress> presses;
  for (const char* list : {"presses", "refused"}) {
    const json::Value* listed = report.is_object() ? report.find(list) : nullptr;
    if (!listed || !listed->is_array()) continue;
    for (const json::Value& press : *listed) {
      if (!press.contains("center_x_px")) continue;
      const json::Value *error = press.find("depth_rmse_mm"), *reason = press.find("reason");
      presses.push_back({press.at("press").text(), press.at("center_x_px").number(),
                         press.at("center_y_px").number(), press.at("contact_radius_px").number(),
                         error ? error->number() : 0, reason ? reason->text() : ""});
    }
  }
  return presses;
}

}  // namespace

SetupInputs::Quad parse_corners(const std::string& typed) {
  std::vector<double> numbers;
  std::string rest = typed + ",";
  for (size_t end; (end = rest.find(',')) != std::string::npos; rest.erase(0, end + 1)) {
    char* stop = nullptr;
    const std::string number = rest.substr(0, end);
    numbers.push_back(std::strtod(number.c_str(), &stop));
    if (number.empty() || *stop != '\0') numbers.clear();
  }
  if (numbers.size() != 8)
    throw Error(Failure::Usage, "four corners, x and y in px: top left, top right, bottom right, bottom left",
                "--corners " + typed, "--corners 83,97,457,132,466,368,89,413, or auto");
  SetupInputs::Quad quad{};
  for (size_t i = 0; i < 8; ++i) quad[i / 2][i % 2] = numbers[i];
  return quad;
}

std::string to_text(const SetupInputs::Quad& corners) {
  std::string words;
  for (const auto& corner : corners)
    for (const double value : corner) words += (words.empty() ? "" : ",") + text("%.0f", value);
  return words;
}

const char* SensorSetup::name_of(Part part) {
  constexpr std::array<const char*, kParts> kNames{"frame", "untouched image", "touch",
                                                   "scale", "surface",         "force"};
  return kNames[static_cast<size_t>(part)];
}

void SensorSetup::run(Part part, const SetupInputs& inputs) {
  constexpr std::array<SetupStep (SensorSetup::*)(const SetupInputs&), kParts> kSteps{
      &SensorSetup::frame, &SensorSetup::untouched, &SensorSetup::touch,
      &SensorSetup::scale, &SensorSetup::surface,   &SensorSetup::force};
  const auto at = static_cast<size_t>(part);
  SetupStep done = (this->*kSteps[at])(inputs);
  done.name = name_of(part);
  if (part == Part::Frame) steps_ = {};  // the file is begun anew
  steps_[at] = std::move(done);
}

void SensorSetup::run_all(const SetupInputs& inputs) {
  for (size_t part = 0; part < kParts; ++part) run(static_cast<Part>(part), inputs);
}

Facts SensorSetup::calibrate(SetupStep& step, std::vector<std::string> words) {
  words.insert(words.end(), {"--sensor", out_.string(), "--out", out_.string()});
  step.command = "palpate calibrate";
  for (const std::string& word : words) step.command += " " + in_quotes(word);
  words.emplace_back("--quiet");
  try {
    Report done = run_calibrate(words);
    interrupted_ = interrupted_ || done.exit_code == kInterrupted;
    step.done = done.exit_code == 0;
    return done;
  } catch (const Error& error) {
    step.known.append("wanted ").append(error.wanted()).append("; found ").append(error.found());
    // The remedy is this step's own, in options of setup; that of another sensor's command misleads.
    if (!error.remedy().starts_with("palpate ")) step.known.append("; try ").append(error.remedy());
    return {};
  }
}

SetupStep SensorSetup::frame(const SetupInputs& inputs) {
  SetupStep step;
  step.done = true;
  Sensor sensor = bare_sensor(inputs.recording);
  sensor.name = inputs.name.empty() ? out_.stem().string() : inputs.name;
  const std::unique_ptr<Source> source = open_source(inputs.recording, sensor);
  const FrameFormat f = source->format();
  refuse_other_mode(inputs, f);
  step.known =
      text("%u x %u px, %s, %u bits", f.width, f.height, f.channels == 3 ? "colour" : "gray", f.bit_depth);
  if (source->rate_Hz() > 0) step.known += text(", %.4g frames/s", source->rate_Hz());
  if (!inputs.like.empty()) start_like(step, load_nominal(inputs.like), f, sensor);
  if (inputs.pitch_mm_per_px > 0)
    sensor.pitch_mm_per_px = inputs.pitch_mm_per_px, sensor.pitch_sd_mm_per_px = 0;
  cut_out(step, inputs, sensor, *source);
  save_sensor(sensor, out_);
  return step;
}

SetupStep SensorSetup::untouched(const SetupInputs& inputs) {
  SetupStep step;
  const std::string input = inputs.background.empty() ? inputs.recording : inputs.background.string();
  const json::Value found = calibrate(step, {"background", input, "--set-threshold"}).json;
  if (!step.done) {
    step.missing = "a picture of the pad at rest: --background FILE";
    return step;
  }
  const auto used = found.at("frames_used").number();
  step.known =
      used > 1 ? text("mean of %.0f frames, noise %.2f gray a pixel", used, found.at("noise_gray").number())
               : "one picture";
  if (found.contains("doubt") && !found.at("doubt").text().empty()) step.missing = found.at("doubt").text();
  return step;
}

/// Signal, threshold and kind of gel, by what the recording's touches change.
SetupStep SensorSetup::touch(const SetupInputs& inputs) {
  SetupStep step;
  if (is_camera(inputs.recording)) {
    step.missing = "a recording of a touch: palpate record, then palpate setup with it";
    return step;
  }
  if (!this->step(Part::Untouched).done) {
    step.missing = "the untouched image";
    return step;
  }
  Sensor sensor = load_sensor(out_);
  const auto goes_on = [](uint64_t) { return !palpate::interrupted(); };
  if (!inputs.background.empty() && sensor.channels == 3) {
    colour_ = false;
    const std::string foreign = foreign_pictures(inputs.recording, sensor, goes_on);
    if (!foreign.empty()) {
      step.missing = foreign +
                     ": a --background of this pad, taken as the recording was: exposure, white "
                     "balance and camera mode fixed";
      return step;
    }
  }
  const auto judge = [&](const std::string& input) { return judge_touches(input, sensor, goes_on); };
  UntouchedRecording found = judge(inputs.recording);
  if (found.touched_frames == 0 && !inputs.balls.empty() && inputs.ball_table.empty())
    found = judge(inputs.balls.string());
  if (found.touched_frames == 0) {
    colour_ = false;
    sensor.threshold_gray = std::max(sensor.threshold_gray, found.threshold_gray);
    save_sensor(sensor, out_);
    step.missing = "a recording in which something touches the pad";
    return step;
  }
  step.done = true;
  colour_ = sensor.channels == 3 && shows_slopes_by_colour(found);
  sensor.signal = signal_of(found);
  if (!colour_ && sensor.channels == 3) sensor.channels = 1;
  sensor.threshold_gray = found.threshold_gray;
  save_sensor(sensor, out_);
  step.known = touch_text(sensor);
  return step;
}

std::string SensorSetup::touch_text(const Sensor& sensor) const {
  return text("%s: touch changes the picture %s; threshold %.1f gray",
              colour_                             ? "a gel that shows slopes by colour"
              : sensor.signal == Signal::Brighter ? "a pad that lights up"
                                                  : "a gray gel",
              sensor.signal == Signal::Either ? "both ways" : to_string(sensor.signal),
              sensor.threshold_gray);
}

SetupStep SensorSetup::scale(const SetupInputs& inputs) {
  SetupStep step;
  if (!inputs.grid.empty()) {
    std::vector<std::string> words = {
        "scale",        inputs.grid_pictures.string(), "--grid", inputs.grid, "--pattern", inputs.pattern,
        "--spacing-mm", text("%g", inputs.spacing_mm)};
    if (!inputs.grid_rest.empty()) words.insert(words.end(), {"--background", inputs.grid_rest.string()});
    const json::Value found = calibrate(step, words).json;
    if (step.done)
      step.known = text("%.5f +- %.5f mm per px, from the grid", found.at("pitch_mm_per_px").number(),
                        found.at("pitch_sd_mm_per_px").number());
  } else if (inputs.pitch_mm_per_px > 0) {
    Sensor sensor = load_sensor(out_);
    sensor.pitch_mm_per_px = inputs.pitch_mm_per_px;
    save_sensor(sensor, out_);
    step.done = true;
    step.known = text("%.5g mm per px, as given", inputs.pitch_mm_per_px);
  }
  const Sensor scaled = load_sensor(out_);
  if (!step.done && !inputs.like.empty() && has_scale(scaled)) {
    step.done = true;
    step.known = text("%.5g +- %.2g mm per px, nominal: not of this unit", scaled.pitch_mm_per_px,
                      scaled.pitch_sd_mm_per_px);
    step.missing = "--pitch MM_PER_PX, or a picture of a grid, for this unit's own";
  }
  if (!step.done)
    step.missing =
        "--pitch MM_PER_PX, or a picture of a grid: --grid-pictures FILE --grid 9x7 --spacing-mm 2.5; until "
        "then lengths are in px";
  return step;
}

SetupStep SensorSetup::surface(const SetupInputs& inputs) {
  SetupStep step;
  const bool scaled = has_scale(load_sensor(out_));
  const std::array<std::pair<const char*, double>, 3> sizes{{{"--ball-radius-mm", inputs.ball_radius_mm},
                                                             {"--ball-diameter-mm", inputs.ball_diameter_mm},
                                                             {"--ball-mm", inputs.ball_mm}}};
  const auto* const size = std::ranges::find_if(sizes, [](const auto& s) { return s.second > 0; });
  const bool own_shape = std::ranges::any_of(
      inputs.shapes, [](const std::string& typed) { return !parse_shaped_recording(typed).recording; });
  const bool ball = size != sizes.end() || own_shape || !inputs.ball_table.empty();
  const bool kind_known =
      this->step(Part::Touch).done || inputs.surface != "auto" || !inputs.ball_table.empty();
  if (ball && scaled && kind_known) {
    const bool by_colour = inputs.surface == "photometric" || !inputs.ball_table.empty() ||
                           (inputs.surface == "auto" && colour_);
    if (!by_colour && !inputs.shapes.empty())
      throw Error(Failure::Input, "presses of a ball, by which a gray gel is read",
                  "--shape " + inputs.shapes.front(), "--ball-radius-mm, or --surface photometric");
    const std::string presses = inputs.balls.empty() ? inputs.recording : inputs.balls.string();
    std::vector<std::string> words = {by_colour ? "photometric" : "lookup", presses};
    if (size != sizes.end() && inputs.ball_table.empty())
      words.insert(words.end(), {size->first, text("%g", size->second)});
    else if (!inputs.ball_table.empty())
      words.insert(words.end(), {"--balls", inputs.ball_table.string()});
    for (const std::string& other : inputs.other_balls) words.insert(words.end(), {"--balls", other});
    for (const std::string& shape : inputs.shapes) words.insert(words.end(), {"--shape", shape});
    const json::Value found = calibrate(step, words).json;
    step.presses = presses_of(found);
    if (step.done)
      step.known = (by_colour ? "slopes by colour: " : "by brightness: ") + found.at("verdict").text() +
                   "; " + found.at("selection_text").text();
    if (step.done && !found.at("doubt").text().empty()) step.missing = found.at("doubt").text();
    if (step.done && by_colour) add_extent(step, found);
    if (step.done) refresh_touch();
  }
  if (!step.done && step.known.empty()) step.known = "not calibrated: no depth of this unit";
  if (!step.done)
    step.missing = !ball         ? "presses of a ball: --ball-radius-mm RADIUS [--balls FOLDER]"
                   : !scaled     ? "the scale, before presses of a ball give depth"
                   : !kind_known ? "what a touch changes, before presses of a ball give depth"
                                 : "presses of one ball of known size that are seen whole, see above";
  return step;
}

/// Presses of a ball set signal and threshold anew: the sentence of that step is made from the file again.
void SensorSetup::refresh_touch() {
  SetupStep& touch = steps_[static_cast<size_t>(Part::Touch)];
  if (touch.done) touch.known = touch_text(load_sensor(out_));
}

SetupStep SensorSetup::force(const SetupInputs& inputs) {
  SetupStep step;
  if (inputs.gauge.empty()) {
    step.missing = "a force gauge's table of the recording: --gauge FILE";
    return step;
  }
  std::vector<std::string> command = {"force", inputs.recording, "--gauge", inputs.gauge.string()};
  if (inputs.one_sequence) command.push_back("--sequence");
  const std::string said = calibrate(step, command).text;
  // The first line is the verdict; a calibration that is not fit for use is in the file and says so.
  if (!said.empty()) step.known = said.substr(0, said.find('\n'));
  if (!step.done) step.missing = "a gauge's table that fits the recording, see above";
  return step;
}

}  // namespace palpate
