// Streams as Python sees them: iterators of touches.
#pragma once

#include <pybind11/pybind11.h>

namespace palpate::python {

/// Ends the threads of every stream that is open.
void close_streams();

void bind_live(pybind11::module_& module);

}  // namespace palpate::python
