#include "viz/commands/workflow/setup_window.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <future>
#include <string>
#include <utility>
#include <vector>

#include "capture/calibrate/frame/pad_corners.h"
#include "capture/calibrate/photometric/next_presses.h"
#include "capture/open_source.h"
#include "capture/rectify.h"
#include "capture/run/input.h"
#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "palpate/error.h"
#include "palpate/sensor.h"
#include "viz/commands/support/progress.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using viz::SetupForm;
using viz::SetupView;
using viz::SetupWish;

void put(const std::string& text, SetupForm::Path& field) {
  std::snprintf(field.data(), field.size(), "%s", text.c_str());
}

/// Runs `work` while the window stays alive; throws what it throws.
template <typename Work>
auto behind(SetupView& view, const std::string& words, Work work) {
  auto result = std::async(std::launch::async, std::move(work));
  view.wait(words, [&] { return result.wait_for(std::chrono::seconds(0)) == std::future_status::ready; });
  return result.get();
}

/// A name that no file has, for the sensor of this recording.
fs::path free_name(const fs::path& folder, const std::string& recording) {
  fs::path path(recording.substr(0, recording.find('?')));
  if (path.filename().empty()) path = path.parent_path();
  std::string stem = is_recording(recording) ? path.stem().string() : "camera";
  if (stem.empty()) stem = "sensor";
  std::error_code code;
  fs::path name = folder / (stem + ".json");
  for (int i = 2; fs::exists(name, code); ++i) name = folder / (stem + text("-%d.json", i));
  return name;
}

/// Where the sensor file of a recording is looked for: next to the recording where that can be written to.
/// `other`: of cameras, and else; may be empty.
fs::path folder_of(const std::string& recording, const fs::path& other) {
  if (!is_recording(recording)) return other;
  std::error_code code;
  fs::path path = fs::absolute(recording, code).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();
  const fs::path folder = path.parent_path();
  return !code && ::access(folder.c_str(), W_OK) == 0 ? folder : other;
}

/// From the rectified frame to the camera's picture.
std::vector<viz::SetupBall> balls_of(const std::vector<FoundPress>& presses, const Sensor& sensor) {
  constexpr double kDoubtful = 1.5;  // times the usual error
  std::vector<double> errors_mm;
  for (const FoundPress& press : presses)
    if (press.refusal.empty()) errors_mm.push_back(press.depth_error_mm);
  const double usual_mm = errors_mm.empty() ? 0 : median(errors_mm);
  std::vector<viz::SetupBall> balls;
  for (const FoundPress& press : presses) {
    const auto [x, y] = camera_place(sensor, press.x_px, press.y_px);
    const auto [side_x, side_y] = camera_place(sensor, press.x_px + press.radius_px, press.y_px);
    viz::SetupBall ball{
        x, y, std::hypot(side_x - x, side_y - y), "", press.label + "\n", press.refusal.empty(), false};
    if (ball.used) {
      ball.doubtful = press.depth_error_mm > kDoubtful * usual_mm;
      ball.label = text("%.0f", 1e3 * press.depth_error_mm);
      ball.words += text("depth to %.4f mm RMS by the other presses", press.depth_error_mm);
    } else {
      ball.words += "not used: " + press.refusal;
    }
    balls.push_back(std::move(ball));
  }
  return balls;
}

std::optional<viz::SetupPlace> next_place(const std::vector<FoundPress>& presses, const Sensor& sensor,
                                          const Frame& rectified) {
  const auto place = place_for_presses(presses, rectified.format.width, rectified.format.height);
  if (!place) return std::nullopt;
  return viz::SetupPlace{{camera_place(sensor, place->left_px, place->top_px),
                          camera_place(sensor, place->right_px, place->top_px),
                          camera_place(sensor, place->right_px, place->bottom_px),
                          camera_place(sensor, place->left_px, place->bottom_px)},
                         place->reason};
}

}  // namespace

SetupWindow::SetupWindow(const SetupInputs& known, const fs::path& sensor_file, fs::path folder)
    : known_(known), folder_(std::move(folder)) {
  put(known.recording, form_.recording);
  put(sensor_file.string(), form_.sensor_file);
  put(known.background.string(), form_.background);
  put(known.grid_pictures.string(), form_.grid_pictures);
  put(known.balls.string(), form_.balls);
  put(known.gauge.string(), form_.gauge);
  std::snprintf(form_.grid.data(), form_.grid.size(), "%s", known.grid.c_str());
  form_.pitch_mm_per_px = known.pitch_mm_per_px;
  form_.spacing_mm = known.spacing_mm;
  form_.ball_radius_mm = known.ball_radius_mm > 0     ? known.ball_radius_mm
                         : known.ball_diameter_mm > 0 ? known.ball_diameter_mm / 2
                                                      : known.ball_mm;
  if (known.corners) {
    form_.cut = true;
    form_.corners = *known.corners;
  }
}

void SetupWindow::take_recording(const std::string& typed) {
  if (typed.empty() || typed == form_.recording.data()) return;
  put(typed, form_.recording);
  form_.sensor_file = {};
  picture_.reset();
  made_.reset();
}

/// Inputs of the form, over those known from elsewhere.
SetupInputs SetupWindow::inputs() const {
  SetupInputs inputs = known_;
  inputs.recording = form_.recording.data();
  inputs.background = form_.background.data();
  inputs.grid_pictures = form_.grid_pictures.data();
  inputs.grid = inputs.grid_pictures.empty() ? "" : form_.grid.data();
  inputs.balls = form_.balls.data();
  inputs.gauge = form_.gauge.data();
  inputs.pitch_mm_per_px = form_.pitch_mm_per_px;
  inputs.spacing_mm = form_.spacing_mm;
  inputs.ball_radius_mm = form_.ball_radius_mm;
  inputs.ball_diameter_mm = inputs.ball_mm = 0;
  inputs.cut_to_light = false;
  inputs.corners = form_.cut ? std::optional(form_.corners) : std::nullopt;
  return inputs;
}

void SetupWindow::show_steps(SetupView& view) const {
  std::array<viz::SetupLine, SetupView::kSteps> lines;
  std::vector<viz::SetupBall> balls;
  std::optional<viz::SetupPlace> next;
  std::optional<Frame> untouched;
  if (made_) {
    for (size_t i = 0; i < lines.size(); ++i) {
      const SetupStep& step = made_->steps()[i];
      lines[i] = {step.name, step.done, step.known, step.missing};
    }
    if (made_->steps()[static_cast<size_t>(SensorSetup::Part::Untouched)].done) {
      const Sensor sensor = load_sensor(made_->out());
      untouched = background_image(sensor);
      const std::vector<FoundPress>& presses =
          made_->steps()[static_cast<size_t>(SensorSetup::Part::Surface)].presses;
      balls = balls_of(presses, sensor);
      if (untouched) next = next_place(presses, sensor, *untouched);
    }
  }
  view.set_lines(lines);
  view.set_balls(std::move(balls), std::move(next));
  view.show_untouched(untouched);
}

void SetupWindow::open(SetupView& view) {
  const std::string input = form_.recording.data();
  picture_ = behind(view, "opening " + input, [input] {
    Frame frame;
    if (!open_source(input, bare_sensor(input))->next(frame))
      throw Error(Failure::Input, "a recording with frames", "none in " + input, "another recording");
    Frame own;  // with pixels of its own: the source goes
    own.format = frame.format;
    own.bytes.assign(frame.pixels(), frame.pixels() + frame.format.frame_bytes());
    return own;
  });
  view.show(*picture_);
  made_.reset();
  show_steps(view);
  const fs::path folder = folder_of(input, folder_);
  if (form_.sensor_file[0] == '\0' && !folder.empty())
    put(free_name(folder, input).string(), form_.sensor_file);
  view.set_message("fill in what is known, then 'Make the sensor file'", false);
}

void SetupWindow::propose(SetupView& view) {
  if (!picture_) open(view);
  const std::optional<PadCorners> found = propose_corners(*picture_);
  if (!found) {
    view.set_message(
        "no corners found: the light fills the whole picture, or nothing of it; tick 'cut the pad out' to "
        "drag them by hand",
        false);
    return;
  }
  form_.cut = true;
  form_.corners = found->quad_px;
  view.set_message(text("the lit part is %.0f %% of the picture; drag the corners where that is not the pad",
                        100 * found->share),
                   false);
}

/// False where it could not be done, which the window says.
bool SetupWindow::run(SetupView& view, SensorSetup::Part part) {
  try {
    behind(view, text("%s ...", SensorSetup::name_of(part)),
           [this, part, in = inputs()] { made_->run(part, in); });
  } catch (const std::exception& e) {
    view.set_message(e.what(), true);
    return false;
  }
  show_steps(view);
  return true;
}

void SetupWindow::make(SetupView& view) {
  if (!picture_) open(view);
  const fs::path out = form_.sensor_file.data();
  if (out.empty()) throw Error(Failure::Usage, "the sensor file's name", "none", "a name that ends in .json");
  std::error_code code;
  if (fs::exists(out, code) && !(made_ && made_->out() == out))
    throw Error(Failure::Output, "a new sensor file", out.string() + ", which exists", "another name");
  made_.emplace(out);
  for (size_t part = 0; part < SensorSetup::kParts; ++part)
    if (!run(view, static_cast<SensorSetup::Part>(part))) {
      if (part == 0) made_.reset();
      return;
    }
  const auto& steps = made_->steps();
  const auto missing = std::ranges::find(steps, false, &SetupStep::done);
  view.go_to(static_cast<size_t>((missing == steps.end() ? steps.end() - 2 : missing) - steps.begin()));
  view.set_message(
      "written: " + out.string() + "; what is missing can be filled in, and each step done again", false);
}

std::optional<viz::Choice> SetupWindow::fill_in(gpu::Context& context, viz::Window& window,
                                                viz::Settings& settings) {
  SetupView view(context, window, settings, form_);
  if (picture_) view.show(*picture_);
  show_steps(view);
  std::optional<SetupWish> wish;
  if (!picture_ && form_.recording[0] != '\0') wish = SetupWish{SetupWish::What::Open};
  for (;; wish.reset()) {
    if (!wish) wish = view.next(interrupted);
    if (!wish || wish->what == SetupWish::What::Leave) return std::nullopt;
    view.set_message("", false);
    try {
      switch (wish->what) {
        case SetupWish::What::Open:
          open(view);
          break;
        case SetupWish::What::Propose:
          propose(view);
          break;
        case SetupWish::What::MakeAll:
          make(view);
          break;
        case SetupWish::What::Again:
          if (made_) run(view, static_cast<SensorSetup::Part>(wish->step));
          break;
        case SetupWish::What::Look:
          if (made_) return viz::Choice{form_.recording.data(), made_->out().string(), {}};
          break;
        case SetupWish::What::Leave:
          break;
      }
    } catch (const std::exception& e) {
      view.set_message(e.what(), true);
    }
  }
}

}  // namespace palpate
