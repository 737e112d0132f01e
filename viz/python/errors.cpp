#include "viz/python/errors.h"

#include <algorithm>
#include <regex>
#include <string_view>

#include "palpate/error.h"
#include "viz/python/bindings.h"

namespace palpate::python {
namespace {

namespace py = pybind11;

const char* type_of(Failure failure) {
  switch (failure) {
    case Failure::Usage:
      return "ArgumentError";
    case Failure::Input:
      return "InputError";
    case Failure::Sensor:
      return "SensorError";
    case Failure::Device:
    case Failure::Display:
      return "DeviceError";
    case Failure::Output:
      return "OutputError";
  }
  return "Error";
}

void raise(const char* type, const std::string& wanted, const std::string& found, const std::string& remedy) {
  const py::object cls = py::module_::import("palpate._errors").attr(type);
  const py::object error = cls(wanted, found, remedy);
  PyErr_SetObject(cls.ptr(), error.ptr());
}

/// Options of the command line as arguments: "--pad-kPa 200" becomes "pad_kPa=200".
std::string as_arguments(std::string_view words) {
  static const std::regex option("--([a-z][A-Za-z-]*)( (?=[A-Z0-9]))?");
  const std::string text(words);
  std::string out;
  auto at = text.begin();
  for (std::sregex_iterator match(text.begin(), text.end(), option), end; match != end; ++match) {
    out.append(at, (*match)[0].first);
    std::string name = (*match)[1].str();
    std::replace(name.begin(), name.end(), '-', '_');
    out += name + ((*match)[2].matched ? "=" : "");
    at = (*match)[0].second;
  }
  return out.append(at, text.end());
}

void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const Refusal& r) {
    raise(r.type, r.wanted, r.found, r.remedy);
  } catch (const Error& error) {
    raise(type_of(error.failure()), as_arguments(error.wanted()), as_arguments(error.found()),
          as_arguments(error.remedy()));
  }
}

}  // namespace

void bind_errors(py::module_& module) {
  module.def("as_arguments", &as_arguments);
  py::register_exception_translator(&translate);
}

}  // namespace palpate::python
