// Making of a sensor file from recordings of the sensor: six steps in order, each of which can be done again.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/calibrate/photometric/next_presses.h"
#include "engine/base/facts.h"

namespace palpate {

struct Sensor;

/// Inputs known from outside the recordings. Empty or 0: nothing.
struct SetupInputs {
  using Quad = std::array<std::array<double, 2>, 4>;

  std::string recording;             ///< of touches: a recording or camera:NODE
  std::string like;                  ///< kind of sensor to start from (nominal_sensors.h)
  std::filesystem::path background;  ///< picture of the pad at rest; empty: found in the recording
  bool cut_to_light = false;         ///< where `corners` says nothing
  std::optional<Quad> corners;       ///< of the pad, px: top left, top right, bottom right, bottom left
  double pitch_mm_per_px = 0;
  std::filesystem::path grid_pictures, grid_rest;
  std::string grid, pattern = "dots";
  double spacing_mm = 0;  ///< of the grid
  double ball_mm = 0;     ///< radius, by the older option; refused where it is the diameter
  double ball_radius_mm = 0, ball_diameter_mm = 0;
  std::filesystem::path balls;           ///< recording of its presses; empty: `recording`
  std::vector<std::string> other_balls;  ///< RECORDING=RADIUS_MM: presses of further balls
  std::vector<std::string> shapes;       ///< SHAPE of `balls`, RECORDING=SHAPE of further ones (shape_text.h)
  std::filesystem::path ball_table;      ///< presses in `balls` by place, where a ball is not seen whole
  std::string surface = "auto";
  std::filesystem::path gauge;  ///< a force gauge's table of the recording
  std::string name;             ///< of the sensor; empty: the file's
  bool one_sequence = false;    ///< images without a rate follow each other
};

struct SetupStep {
  std::string name;
  bool done = false;
  std::string known;                ///< or what went wrong
  std::string missing;              ///< what would make it known, in options of palpate setup, a line each
  std::string command;              ///< that does it again, alone; may be empty
  std::vector<FoundPress> presses;  ///< of the step Surface
};

class SensorSetup {
 public:
  enum class Part { Frame, Untouched, Touch, Scale, Surface, Force };
  static constexpr size_t kParts = 6;

  /// `out`: the sensor file, which the first step begins anew.
  explicit SensorSetup(std::filesystem::path out) : out_(std::move(out)) {}

  /// One step with what is known; steps after the first forget what they found where it is done again. Any
  /// thread, one at a time. Throws Error where the recording cannot be opened.
  void run(Part part, const SetupInputs& inputs);
  void run_all(const SetupInputs& inputs);

  const std::array<SetupStep, kParts>& steps() const { return steps_; }
  const std::filesystem::path& out() const { return out_; }
  /// Ctrl-C ended a step.
  bool interrupted() const { return interrupted_; }

  static const char* name_of(Part part);

 private:
  SetupStep frame(const SetupInputs& inputs);
  SetupStep untouched(const SetupInputs& inputs);
  SetupStep touch(const SetupInputs& inputs);
  SetupStep scale(const SetupInputs& inputs);
  SetupStep surface(const SetupInputs& inputs);
  SetupStep force(const SetupInputs& inputs);
  /// Runs a calibration as a step; a refusal is what is missing.
  Facts calibrate(SetupStep& step, std::vector<std::string> words);
  std::string touch_text(const Sensor& sensor) const;
  void refresh_touch();
  const SetupStep& step(Part part) const { return steps_[static_cast<size_t>(part)]; }

  std::filesystem::path out_;
  std::array<SetupStep, kParts> steps_;
  bool colour_ = false, interrupted_ = false;
};

/// Four corners as they are typed: x,y,x,y,x,y,x,y. Throws Error(Failure::Usage).
SetupInputs::Quad parse_corners(const std::string& typed);
std::string to_text(const SetupInputs::Quad& corners);

}  // namespace palpate
