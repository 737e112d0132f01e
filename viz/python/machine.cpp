// Vulkan devices and cameras of this machine.
#include <pybind11/stl.h>

#include "capture/v4l2/device.h"
#include "engine/gpu/physical_device.h"
#include "viz/python/bindings.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

namespace py = pybind11;

py::list devices() {
  const auto reports = run_apart([](const std::atomic<bool>&) { return gpu::list_devices(); });
  py::list all;
  for (const gpu::DeviceReport& r : reports) {
    py::dict d;
    d["index"] = r.index;
    d["name"] = r.name;
    d["type"] = r.type;
    d["driver"] = r.driver;
    d["api_version"] = r.api_version;
    d["memory_bytes"] = r.memory_bytes;
    d["refusals"] = py::tuple(py::cast(r.refusals));
    all.append(d);
  }
  return all;
}

py::list cameras() {
  const auto nodes = run_apart([](const std::atomic<bool>&) { return v4l2::list_nodes(); });
  py::list all;
  for (const v4l2::NodeReport& node : nodes) {
    if (!node.capture && node.trouble.empty()) continue;
    py::dict d;
    d["source"] = "camera:" + node.path;
    d["name"] = node.identity.card;
    d["driver"] = node.identity.driver;
    d["bus"] = node.identity.bus;
    d["trouble"] = node.trouble;
    all.append(d);
  }
  return all;
}

}  // namespace

void bind_machine(py::module_& module) {
  module.def("devices", &devices);
  module.def("cameras", &cameras);
}

}  // namespace palpate::python
