// An input together with its sensor and the outputs that can be computed from it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/session/session.h"
#include "palpate/pipeline.h"
#include "palpate/sensor.h"

namespace palpate {

struct MeasuredInput {
  std::string input;  ///< as open_source takes it; a synthetic one with every key and the seed
  Sensor sensor;
  std::optional<SessionInfo> session;  ///< of a recorded session
  Outputs outputs = {};                ///< force, and the surface where the sensor has a reading of it
};

/// Note that a rate given for images is not used, since these frames have times of their own; empty where it
/// is.
std::string unused_rate(const Source& source, double rate_Hz);

/// Loads `sensor_file`; synthetic inputs without one get what is known of them by construction, and `seed`
/// where they name none. Sessions bring their sensor; any other input without one is
/// uncalibrated. `background` is the untouched image to use instead of the sensor
/// file's; empty: as the sensor file says.
MeasuredInput find_input(uint64_t seed, const std::string& input, const std::filesystem::path& sensor_file,
                         const std::filesystem::path& background = {});
/// The same with a sensor that is there already, or none.
MeasuredInput find_input(uint64_t seed, const std::string& input, const std::optional<Sensor>& sensor,
                         const std::filesystem::path& background);

/// A sensor of which only the format of its frames is known, taken from the recording `input`: colour, gray,
/// or gray of 16 bits; colour frames without any colour are gray. Throws Error(Failure::Input) where the
/// recording cannot be opened.
Sensor bare_sensor(const std::string& input);

/// The sensor that a calibration starts from. The section that the calibration makes may be missing in the
/// file and is not read; without a file, bare_sensor(input). `pitch_mm_per_px` replaces the file's; 0: it
/// stays. ToMake::Reading needs a known scale: otherwise Error(Failure::Usage) says how to state it.
Sensor sensor_to_calibrate(const std::string& input, const std::filesystem::path& file, ToMake to_make,
                           double pitch_mm_per_px = 0);

/// The solvers as the command line spells them.
inline const std::map<std::string, SurfaceSolver> kSolverNames = {{"live", SurfaceSolver::Live},
                                                                  {"best", SurfaceSolver::Best}};
const char* to_string(SurfaceSolver solver);

/// Outputs that can be requested, as spelled on the command line.
inline const std::map<std::string, Output> kOutputNames = {
    {"force", Output::Force},       {"surface", Output::Surface},   {"confidence", Output::Confidence},
    {"contacts", Output::Contacts}, {"gradient", Output::Gradient}, {"skin", Output::Skin},
    {"traction", Output::Traction}, {"motion", Output::Motion}};
/// Requested outputs, with those that they need: contacts and skin bring the force.
Outputs outputs_of(std::span<const Output> asked);

}  // namespace palpate
