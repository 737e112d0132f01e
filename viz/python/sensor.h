// Sensor files, and the input that a caller names.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/run/input.h"

namespace palpate::python {

/// A source by its name, with its sensor.
struct InputRequest {
  std::string input;
  std::optional<Sensor> sensor;
  std::filesystem::path background;
  std::vector<std::string> outputs;  ///< empty: what the sensor can
  uint64_t seed = 1;
};

/// Opens recordings to see what they hold: without the interpreter's lock.
MeasuredInput find(const InputRequest& request);
SurfaceSolver solver_of(const std::string& name);

void bind_sensor(pybind11::module_& module);

}  // namespace palpate::python
