#include "viz/python/sensor.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>

#include "engine/base/text.h"
#include "viz/python/bindings.h"

namespace palpate::python {
namespace {

namespace py = pybind11;

std::string described(const Sensor& sensor) {
  std::string line = "<palpate.Sensor '" + sensor.name + "'";
  if (has_scale(sensor)) line += text(", %.5g mm per px", sensor.pitch_mm_per_px);
  if (sensor.reading != SurfaceReading::None) line += std::string(", reading ") + to_string(sensor.reading);
  if (sensor.force) line += ", force";
  if (sensor.shear) line += ", shear";
  return line + ">";
}

std::optional<std::string> reading(const Sensor& sensor) {
  if (sensor.reading == SurfaceReading::None) return std::nullopt;
  return to_string(sensor.reading);
}

}  // namespace

SurfaceSolver solver_of(const std::string& name) {
  return by_name(kSolverNames, name, "a solver");
}

void bind_sensor(py::module_& module) {
  py::class_<Sensor>(module, "Sensor")
      .def(py::init([](const std::filesystem::path& file) { return load_sensor(file); }), py::arg("file"))
      .def_static(
          "load", [](const std::filesystem::path& file) { return load_sensor(file); }, py::arg("file"))
      .def_static(
          "from_text", [](const std::string& text) { return sensor_from_text(text, "the text"); },
          py::arg("text"))
      .def(
          "save", [](const Sensor& sensor, const std::filesystem::path& file) { save_sensor(sensor, file); },
          py::arg("file"))
      .def_property_readonly("text", &sensor_text)
      .def_readonly("name", &Sensor::name)
      .def_readonly("pitch_mm_per_px", &Sensor::pitch_mm_per_px)
      .def_readonly("pitch_sd_mm_per_px", &Sensor::pitch_sd_mm_per_px)
      .def_property_readonly("has_scale", &has_scale)
      .def_property_readonly("has_force", [](const Sensor& s) { return s.force.has_value(); })
      .def_property_readonly("has_shear", [](const Sensor& s) { return s.shear.has_value(); })
      .def_property_readonly("has_layer", [](const Sensor& s) { return layer_of(s).has_value(); })
      .def_property_readonly("reading", &reading)
      .def_property_readonly("surface", &reading)
      .def("__repr__", &described)
      .def(py::pickle([](const Sensor& s) { return sensor_text(s); },
                      [](const std::string& text) { return sensor_from_text(text, "the text"); }));
}

}  // namespace palpate::python
