// Form for making a sensor file: the picture with the pad's corners, which are dragged, and the steps.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "palpate/frame.h"
#include "viz/panels/form_window.h"
#include "viz/panels/settings.h"
#include "viz/render/render_target.h"

namespace palpate::viz {

/// Inputs that the person has filled in. Empty or 0: nothing.
struct SetupForm {
  using Path = std::array<char, 512>;
  Path recording{}, sensor_file{}, background{}, grid_pictures{}, balls{}, gauge{};
  std::array<char, 16> grid{};  ///< columns x rows
  double pitch_mm_per_px = 0, spacing_mm = 0, ball_radius_mm = 0;
  bool cut = false;  ///< the pad is cut out by `corners`
  /// Px of the camera's picture: top left, top right, bottom right, bottom left.
  std::array<std::array<double, 2>, 4> corners{};
};

/// A press of a ball as the calibration found it: a circle in the camera's picture, px.
struct SetupBall {
  double x_px = 0, y_px = 0, radius_px = 0;
  std::string label;  ///< short, in the circle
  std::string words;  ///< said where the mouse is
  bool used = true;
  bool doubtful = false;  ///< read worse than the others
};

/// Where further presses would serve best: its corners in the camera's picture, px, in turn.
struct SetupPlace {
  std::array<std::array<double, 2>, 4> corners{};
  std::string reason;
};

/// One step as the form shows it.
struct SetupLine {
  std::string name;
  bool done = false;
  std::string known;    ///< or what went wrong
  std::string missing;  ///< what would make it known
};

/// Next request of the person.
struct SetupWish {
  enum class What {
    Open,     ///< the recording that is named now
    Propose,  ///< corners by the light
    MakeAll,  ///< every step, the file begun anew
    Again,    ///< one step
    Look,     ///< the recording, measured by the sensor file
    Leave,
  } what = What::Leave;
  size_t step = 0;  ///< of Again
};

/// All keys of the form, in the order of its help.
const std::vector<KeyHelp>& setup_key_help();

/// A length as a person types it: above 0, with a decimal point or comma; 0 where the text is empty, and
/// none where it is no such number.
std::optional<double> typed_length(const std::string& text);

/// Main thread. One at a time, and none while a Scene draws into the same window.
class SetupView {
 public:
  static constexpr size_t kSteps = 6;

  SetupView(gpu::Context& context, Window& window, Settings& settings, SetupForm& form);

  /// Frame in which the corners are dragged; they become those of its borders where they lie outside it.
  void show(const Frame& frame);
  void set_lines(const std::array<SetupLine, kSteps>& lines) { lines_ = lines; }
  /// Drawn over the picture.
  void set_balls(std::vector<SetupBall> balls, std::optional<SetupPlace> next) {
    balls_ = std::move(balls);
    next_ = std::move(next);
  }
  /// Shown with the step of the untouched image; none: it is not known.
  void show_untouched(const std::optional<Frame>& frame);
  /// The step whose fields are shown.
  void go_to(size_t step) { at_ = step; }
  /// One line; `trouble`: about something that went wrong.
  void set_message(const std::string& message, bool trouble);
  /// Until the person asks for something; none where the window was closed or `interrupted` says so.
  std::optional<SetupWish> next(const std::function<bool()>& interrupted);
  /// Shows the words until `done`.
  void wait(const std::string& words, const std::function<bool()>& done);

 private:
  void describe();
  void describe_picture(float scale);
  void describe_steps(float scale);
  void describe_path(float scale);
  void describe_fields();
  void describe_refused();
  void set_pictures();
  void drag_corners(std::array<float, 2> low, double px_per_px, float scale);
  void handle_keys();
  void corner_key(const KeyPress& press);
  void begin_field();
  void end_field();
  void take_drops();
  bool path(const char* label, const char* hint, SetupForm::Path& value);
  void number(const char* label, const char* hint, double& value);
  void draw_balls(std::array<float, 2> low, double px_per_px, float scale) const;
  void draw_place(std::array<float, 2> low, double px_per_px, float scale) const;
  void wish(SetupWish::What what, size_t step = 0) { wish_ = SetupWish{what, step}; }

  Window& window_;
  SetupForm& form_;
  FormWindow page_;
  std::array<SetupLine, kSteps> lines_;
  size_t at_ = 0;                        ///< step whose fields are shown
  std::array<uint32_t, 2> camera_px_{};  ///< of the frame; 0: none is shown
  RgbImage picture_;                     ///< that frame as it is drawn
  std::optional<RgbImage> untouched_;
  std::vector<SetupBall> balls_;
  std::optional<SetupPlace> next_;
  /// Numbers as they are typed, by their labels.
  struct Typed {
    std::array<char, 32> text{};
    double value = 0;  ///< that the text says
  };
  std::map<std::string, Typed> typed_;
  bool help_ = false;
  std::optional<size_t> dragged_;
  size_t corner_ = 0;  ///< that the arrows move
  size_t fields_ = 0;  ///< of text, in this picture
  std::optional<size_t> typed_in_, wanted_field_;
  std::string message_;
  bool trouble_ = false;
  std::optional<SetupWish> wish_;
};

}  // namespace palpate::viz
