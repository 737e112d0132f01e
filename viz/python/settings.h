// Settings of a run from Python's keywords, by their table.
#pragma once

#include <pybind11/pybind11.h>

namespace palpate::python {

void bind_settings(pybind11::module_& module);

}  // namespace palpate::python
