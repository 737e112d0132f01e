// Calibrations from their input to the sensor file, each with a report on its quality.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/calibrate/frame/scale.h"
#include "capture/calibrate/photometric/ball_size.h"
#include "capture/run/run_watch.h"
#include "engine/base/json.h"
#include "engine/calibrate/photometric/fit.h"
#include "palpate/sensor.h"

namespace palpate {

/// Where a calibration goes, and who watches it. Images that belong to a sensor file lie next to it.
/// Calibrations that make no image (scale, photometric, lookup) take an empty `out`: they write nothing then,
/// and the sensor names the untouched image where it lies.
struct CalibrationRun {
  std::filesystem::path out;
  const RunWatch& watch;
};

/// The report for people, and as JSON. `stopped`: the watch ended it, and nothing was written.
struct CalibrationReport {
  std::string text{};
  json::Value json{};
  bool stopped = false;
  Sensor sensor{};  ///< of scale, photometric and lookup: as calibrated
};

/// The untouched image, its noise, and a contact threshold that fits it.
struct BackgroundRequest {
  std::string input;
  std::filesystem::path sensor{};  ///< to start from; empty: what the frames say
  uint32_t frames = 30;
  uint32_t every = 0;              ///< look at every n-th; 0: at 400
  std::optional<uint64_t> like{};  ///< number of a frame in which nothing touches
  bool set_threshold = false;
};
CalibrationReport calibrate_background(const BackgroundRequest& options, const CalibrationRun& run);

/// Correct uneven light by a field that every frame is multiplied by.
struct FlatRequest {
  std::string input;
  std::filesystem::path sensor{};
  uint32_t frames = 30;
  uint32_t every = 1;
  bool change = false;  ///< of the change from the untouched image
};
CalibrationReport calibrate_flat(const FlatRequest& options, const CalibrationRun& run);

/// mm per pixel and lens distortion, from a grid, a ring or a ball.
struct ScaleRequest {
  std::string input;
  std::filesystem::path sensor{}, background{};
  std::string grid{};  ///< COLUMNSxROWS
  GridPattern pattern = GridPattern::Chessboard;
  double spacing_mm = 0;
  double spacing_sd = 0.002;  ///< relative
  double ring_mm = 0;         ///< outer diameter
  BallSize ball{};
  /// Travel of each picture in which the ball is pressed, in order.
  std::vector<double> travel_mm{};
};
CalibrationReport calibrate_scale(const ScaleRequest& options, const CalibrationRun& run);

/// Presses of a ball, or of other known shapes.
struct BallRequest {
  std::string input;
  std::filesystem::path sensor{}, balls{}, background{};
  BallSize ball{};             ///< not given: as the table `balls` says
  double pitch_mm_per_px = 0;  ///< 0: the sensor file's
  uint64_t every = 0;
  /// Further recordings, each of presses of another ball: DIR=RADIUS_MM.
  std::vector<std::string> other_balls{};
  /// Shapes other than balls (shape_text.h): SHAPE of `input`, or RECORDING=SHAPE of a further one.
  std::vector<std::string> shapes{};
};
/// Depth of a gray gel by a table over its change. As of calibrate_photometric, nothing is written where the
/// presses contradict the ball's size or the scale.
CalibrationReport calibrate_lookup(const BallRequest& options, const CalibrationRun& run);

/// The models as the command line spells them.
inline const std::map<std::string, NormalModel> kNormalModelNames = [] {
  std::map<std::string, NormalModel> names = {{"best", NormalModel::Best}};
  for (const NormalOrder& order : kNormalOrders) names.emplace(order.name, order.model);
  return names;
}();

struct PhotometricRequest : BallRequest {
  double rest_weight = 1;
  NormalModel model = NormalModel::Best;
  bool keep_markers = false, keep_contact = false;
};
/// Colours of a gel to normals. The report begins with the verdict: the error on presses left out in mm and
/// as a share of what the ball's caps are, how it scatters, and what was left out. Throws
/// Error(Failure::Input) and writes nothing where the presses contradict the ball's size or the scale.
CalibrationReport calibrate_photometric(const PhotometricRequest& options, const CalibrationRun& run);

/// Weights of three lights or more, one gray image each, from a known shape.
struct LightsRequest {
  std::vector<std::filesystem::path> images;
  std::filesystem::path height{};
  double pitch_mm_per_px = 0;
  std::optional<int> order{};  ///< none: 0, 1 or 2, as held-out bands say
};
CalibrationReport calibrate_lights(const LightsRequest& options, const CalibrationRun& run);

}  // namespace palpate
