#include "viz/python/estimate.h"

#include <pybind11/operators.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/files/measurements.h"
#include "engine/base/text.h"
#include "viz/python/bindings.h"

namespace palpate::python {
namespace {

namespace py = pybind11;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string html_escaped(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

}  // namespace

double Measured::number() const {
  return valid() ? value : kNone;
}

std::string Measured::text() const {
  if (!std::isfinite(value)) return state;
  std::string line;
  if (sd > 0 && std::isfinite(sd)) {
    // One digit of the standard error: 0.0096 has the digit 0.01.
    const int places = std::clamp(-static_cast<int>(std::floor(std::log10(sd / 0.95))), 0, 9);
    line = with_places(value, places) + " \u00b1 " + with_places(sd, places);
  } else {
    line = palpate::text("%.4g", value);
  }
  if (!unit.empty()) line += " " + unit;
  return valid() ? line : line + " (" + state + ")";
}

Measured measured(double value, double sd, Validity validity, const char* unit) {
  const bool there = has_value({value, sd, validity});
  return {there ? value : kNone, there ? sd : kNone, to_string(validity), unit};
}

Measured measured(const Estimate& estimate, const char* unit) {
  return measured(estimate.value, estimate.standard_error, estimate.validity, unit);
}

void bind_estimate(py::module_& module) {
  using M = Measured;
  py::class_<M> bound(module, "Estimate");
  bound
      .def(py::init([](double value, double sd, std::string unit, std::string state) {
             return M{value, sd, std::move(state), std::move(unit)};
           }),
           py::arg("value"), py::arg("sd") = kNone, py::arg("unit") = "", py::arg("state") = "valid")
      .def_readonly("value", &M::value)
      .def_readonly("sd", &M::sd)
      .def_readonly("state", &M::state)
      .def_readonly("unit", &M::unit)
      .def_property_readonly("valid", &M::valid)
      .def("__float__", &M::number)
      .def("__bool__", [](const M& m) { return m.valid() && m.value != 0; })
      .def("__str__", &M::text)
      .def("__format__",
           [](const M& m, const std::string& spec) -> std::string {
             if (spec.empty()) return m.text();
             return py::str(py::float_(m.number()).attr("__format__")(spec));
           })
      .def("__repr__",
           [](const M& m) {
             return palpate::text("Estimate(%.6g, sd=%.3g, unit='%s', state='%s')", m.value, m.sd,
                                  m.unit.c_str(), m.state.c_str());
           })
      .def("_repr_html_",
           [](const M& m) {
             return m.valid() ? html_escaped(m.text()) : "<i>" + html_escaped(m.text()) + "</i>";
           })
      .def("__hash__", [](const M& m) { return py::hash(py::make_tuple(m.value, m.sd, m.state, m.unit)); })
      .def("__array__",
           [](const M& m, const py::args& args) {
             return py::module_::import("numpy").attr("asarray")(py::float_(m.number()), *args);
           })
      .def(py::pickle([](const M& m) { return py::make_tuple(m.value, m.sd, m.state, m.unit); },
                      [](const py::tuple& t) {
                        return M{t[0].cast<double>(), t[1].cast<double>(), t[2].cast<std::string>(),
                                 t[3].cast<std::string>()};
                      }));
  // An estimate compared with a number or another estimate: what is not valid compares as NaN does.
  const auto compare = [&bound](const char* name, auto holds) {
    bound
        .def(
            name, [holds](const M& a, const M& b) { return holds(a.number(), b.number()); },
            py::is_operator())
        .def(
            name, [holds](const M& a, double b) { return holds(a.number(), b); }, py::is_operator());
  };
  compare("__lt__", [](double a, double b) { return a < b; });
  compare("__le__", [](double a, double b) { return a <= b; });
  compare("__gt__", [](double a, double b) { return a > b; });
  compare("__ge__", [](double a, double b) { return a >= b; });
  compare("__eq__", [](double a, double b) { return a == b; });
  compare("__ne__", [](double a, double b) { return a != b; });
}

}  // namespace palpate::python
