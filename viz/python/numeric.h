// Numerics on arrays: heights from slopes, matching of point sets, thin-plate splines, optics, lumps.
#pragma once

#include <pybind11/pybind11.h>

namespace palpate::python {

void bind_integrate(pybind11::module_& module);
void bind_match(pybind11::module_& module);
void bind_thin_plate(pybind11::module_& module);
void bind_optics(pybind11::module_& module);
void bind_waveguide(pybind11::module_& module);
void bind_lump(pybind11::module_& module);

}  // namespace palpate::python
