// The parts of the compiled module, and how its functions are bound.
#pragma once

#include <pybind11/pybind11.h>

#include <array>
#include <sstream>
#include <string>
#include <utility>

namespace palpate::python {

void bind_calibrations(pybind11::module_& module);
void bind_errors(pybind11::module_& module);
void bind_estimate(pybind11::module_& module);
void bind_integrate(pybind11::module_& module);
void bind_live(pybind11::module_& module);
void bind_lump(pybind11::module_& module);
void bind_machine(pybind11::module_& module);
void bind_match(pybind11::module_& module);
void bind_mechanics(pybind11::module_& module);
void bind_object_map(pybind11::module_& module);
void bind_optics(pybind11::module_& module);
void bind_pair_live(pybind11::module_& module);
void bind_profile(pybind11::module_& module);
void bind_recordings(pybind11::module_& module);
void bind_sensor(pybind11::module_& module);
void bind_settings(pybind11::module_& module);
void bind_thin_plate(pybind11::module_& module);
void bind_touch(pybind11::module_& module);
void bind_waveguide(pybind11::module_& module);
void bind_workflows(pybind11::module_& module);

/// Ends the threads of every stream that is open.
void close_streams();

/// Binds a function with the names of its arguments, in their order and a blank apart: errors name them.
template <typename Function>
void bind_function(pybind11::module_& module, const char* name, Function function, const std::string& names) {
  const auto with_names = [&]<typename Result, typename... Arguments>(Result (*)(Arguments...)) {
    std::istringstream words(names);
    std::array<std::string, sizeof...(Arguments)> each;
    for (std::string& one : each) words >> one;
    if (!words || !words.eof()) pybind11::pybind11_fail(std::string("a name for each argument of ") + name);
    [&]<size_t... i>(std::index_sequence<i...>) {
      module.def(name, function, pybind11::arg(each[i].c_str())...);
    }
    (std::index_sequence_for<Arguments...>{});
  };
  with_names(static_cast<pybind11::detail::function_signature_t<Function>*>(nullptr));
}

}  // namespace palpate::python
