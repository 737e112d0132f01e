// Workflows on recordings other than measuring: sessions, wrench, strain between frames; simulated scenes;
// what the machine has and how fast it is.
#pragma once

#include <pybind11/pybind11.h>

namespace palpate::python {

void bind_workflows(pybind11::module_& module);
void bind_machine(pybind11::module_& module);
void bind_mechanics(pybind11::module_& module);
void bind_profile(pybind11::module_& module);

}  // namespace palpate::python
