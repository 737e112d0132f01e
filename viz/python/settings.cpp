#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>

#include "capture/run/run_settings.h"
#include "viz/python/bindings.h"
#include "viz/python/errors.h"
#include "viz/python/sensor.h"

namespace palpate::python {
namespace {

namespace py = pybind11;

/// Takes one keyword's value; None is the default where the setting may be left out.
struct Taker {
  const Setting& setting;
  const py::handle& value;
  RunSettings& settings;

  Refusal refusal() const {
    const std::string none = setting.may_be_none ? ", or None" : "";
    return bad_argument(std::string(setting.name) + " " + range_words(setting) + none,
                        py::str(py::repr(value)), setting.example);
  }
  double number(bool whole) const {
    const bool numeric = whole ? PyIndex_Check(value.ptr()) != 0 : !py::isinstance<py::str>(value);
    if (!numeric) throw refusal();
    const double given = PyFloat_AsDouble(value.ptr());
    const bool failed = PyErr_Occurred() != nullptr;
    PyErr_Clear();
    if (failed || !in_range(setting, given) || (setting.may_be_none && !std::isfinite(given)))
      throw refusal();
    return given;
  }
  /// The value as C++ has it; `kind`: for people who gave another.
  template <typename Value>
  Value as(const char* kind) const {
    try {
      return value.cast<Value>();
    } catch (const py::cast_error&) {
      throw bad_argument(std::string(setting.name) + " as " + kind,
                         std::string(py::str(py::repr(value))).substr(0, 80),
                         "help() of the function, which lists its arguments");
    }
  }
  bool left_out() const { return setting.may_be_none && value.is_none(); }

  void operator()(bool RunSettings::*member) const { settings.*member = as<bool>("True or False"); }
  void operator()(uint64_t RunSettings::*member) const {
    if (!left_out()) settings.*member = static_cast<uint64_t>(number(true));
  }
  void operator()(double RunSettings::*member) const {
    if (!left_out()) settings.*member = number(false);
  }
  void operator()(std::filesystem::path RunSettings::*member) const {
    settings.*member = as<std::filesystem::path>("a path");
  }
  void operator()(std::vector<Output> RunSettings::*member) const {
    for (const auto& name : as<std::vector<std::string>>("a list of texts"))
      (settings.*member).push_back(by_name(kOutputNames, name, "an output"));
  }
  void operator()(std::vector<std::string> RunSettings::*member) const {
    settings.*member = as<std::vector<std::string>>("a list of texts");
  }
  void operator()(std::optional<SurfaceSolver> RunSettings::*member) const {
    settings.*member = solver_of(as<std::string>("a text"));
  }
};

}  // namespace

void bind_settings(py::module_& module) {
  py::class_<RunSettings>(module, "RunSettings")
      .def(
          py::init([](std::string input, std::optional<Sensor> sensor, uint64_t seed, const py::dict& given) {
            RunSettings settings;
            settings.input = std::move(input);
            settings.given_sensor = std::move(sensor);
            settings.seed = seed;
            for (const auto& [name, value] : given) {
              const Setting& setting = run_setting(name.cast<std::string>());
              std::visit(Taker{setting, value, settings}, setting.member);
            }
            return settings;
          }),
          py::arg("input"), py::arg("sensor"), py::arg("seed"), py::arg("settings"));
  module.def("run_settings", [] {
    std::vector<std::pair<std::string, std::string>> all;
    for (const Setting& setting : run_settings()) all.emplace_back(setting.name, setting.sentence);
    return all;
  });
}

}  // namespace palpate::python
