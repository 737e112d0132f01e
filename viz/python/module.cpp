// palpate._palpate: the compiled part of the Python module.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "engine/base/module.h"
#include "palpate/version.h"
#include "viz/python/bindings.h"
#include "viz/python/device.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

/// Before the interpreter ends: no thread of ours may outlive it.
void at_exit() {
  if (forked()) return;
  const pybind11::gil_scoped_release release;
  close_streams();
  Abandoned::wait_all();
  close_devices();
}

}  // namespace

PYBIND11_MODULE(_palpate, module) {
  module.attr("version") = PALPATE_VERSION_TEXT;
  // Given by the Python files, which know where they are.
  module.def("add_module_folder", &add_module_folder);
  bind_errors(module);
  bind_estimate(module);
  bind_sensor(module);
  bind_settings(module);
  bind_touch(module);
  bind_live(module);
  bind_pair_live(module);
  bind_recordings(module);
  bind_calibrations(module);
  bind_integrate(module);
  bind_match(module);
  bind_thin_plate(module);
  bind_optics(module);
  bind_waveguide(module);
  bind_lump(module);
  bind_workflows(module);
  bind_object_map(module);
  bind_machine(module);
  bind_mechanics(module);
  bind_profile(module);
  pybind11::module_::import("atexit").attr("register")(pybind11::cpp_function(&at_exit));
}

}  // namespace palpate::python
