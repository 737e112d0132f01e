// Check of a sensor's calibration against its gel today: today's picture against the calibrated one, and
// presses of a known ball, or on a scale, against what the calibration reads of them.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "capture/calibrate/photometric/ball_size.h"
#include "capture/run/run_watch.h"
#include "engine/base/json.h"

namespace palpate {

namespace gpu {
class Context;
}

struct CheckRequest {
  std::filesystem::path sensor;
  std::string input;                   ///< a recording of today
  std::filesystem::path background{};  ///< the pad at rest today; empty: found in `input`
  BallSize ball{};                     ///< pressed in `input`; not given: none is looked for
  std::vector<double> weight_g{};      ///< that a scale showed at each press of `input`, in order
  std::filesystem::path out{};         ///< the sensor file mended by those weights; empty: none is written
};

/// One thing that a calibration rests on.
struct CheckRow {
  enum class State { AsCalibrated, Changed, NotJudged };

  std::string name;
  double value = 0;  ///< NaN: not known
  std::string unit;
  double least = 0, most = 0;  ///< the calibration is true between them; infinite: no limit
  State state = State::NotJudged;
  std::string what;  ///< for people: what was compared, or what would let it be judged
};
const char* to_string(CheckRow::State state);

/// A calibration to make again, in the order in which they build on each other.
struct CheckRemedy {
  std::string step;     ///< "the untouched image", "the scale", "the surface", "the force"
  std::string command;  ///< for a shell
};

struct SensorCheck {
  bool stopped = false;  ///< the watch ended it
  bool holds = false;    ///< something was judged and nothing has changed
  std::string sentence{};
  std::vector<CheckRow> rows{};
  std::vector<CheckRemedy> again{};
  std::string text{};
  json::Value json{};
};

/// `device` is asked for only where a ball is read or presses are weighed. Throws Error(Failure::Input) where
/// the recording does not fit the sensor, or where all is as calibrated but the ball that was named is not
/// found.
SensorCheck check_sensor(const CheckRequest& request, const std::function<gpu::Context&()>& device,
                         const RunWatch& watch);

}  // namespace palpate
