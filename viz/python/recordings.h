// Whole recordings: measured, calibrated, and what they say of a sample.
#pragma once

#include <pybind11/pybind11.h>

namespace palpate::python {

void bind_recordings(pybind11::module_& module);

}  // namespace palpate::python
