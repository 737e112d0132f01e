// An input together with its sensor and the outputs that can be computed from it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "capture/session/session.h"
#include "palpate/pipeline.h"
#include "palpate/sensor.h"

namespace palpate {

struct MeasuredInput {
  std::string input;  ///< as open_source takes it; a synthetic one with every key and the seed
  Sensor sensor;
  std::optional<SessionInfo> session;  ///< of a recorded session
  uint32_t outputs = 0;                ///< force, and the surface where the sensor has a reading of it
};

/// Loads `sensor_file`; synthetic inputs without one get what is known of them by construction, and `seed`
/// where they name none. Sessions bring their sensor; a camera or session without one is
/// uncalibrated. `background` is the untouched image to use instead of the sensor
/// file's; empty: as the sensor file says. Throws Error(Failure::Usage) where another input has no sensor
/// file.
MeasuredInput find_input(uint64_t seed, const std::string& input, const std::filesystem::path& sensor_file,
                         const std::filesystem::path& background = {});

/// The solvers as the command line spells them.
inline const std::map<std::string, SurfaceSolver> kSolverNames = {{"live", SurfaceSolver::Live},
                                                                  {"fine", SurfaceSolver::Fine},
                                                                  {"converged", SurfaceSolver::Converged},
                                                                  {"exact", SurfaceSolver::Exact}};
const char* to_string(SurfaceSolver solver);

/// Outputs that can be requested, as spelled on the command line.
inline const std::map<std::string, Output> kOutputNames = {
    {"force", Output::Force},       {"surface", Output::Surface},   {"confidence", Output::Confidence},
    {"contacts", Output::Contacts}, {"gradient", Output::Gradient}, {"skin", Output::Skin}};

}  // namespace palpate
