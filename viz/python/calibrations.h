// Calibrations from recordings: each gives a sensor, and a report on its quality.
#pragma once

#include <pybind11/pybind11.h>

namespace palpate::python {

void bind_calibrations(pybind11::module_& module);

}  // namespace palpate::python
