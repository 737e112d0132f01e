#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>

#include "viz/python/bindings.h"
#include "viz/python/device.h"
#include "viz/python/errors.h"
#include "viz/python/reader.h"
#include "viz/python/sensor.h"
#include "viz/python/stream.h"
#include "viz/python/touch.h"

namespace palpate::python {
namespace {

namespace py = pybind11;

/// Open streams, for the interpreter's end. Never destroyed.
struct Registry {
  std::mutex mutex;
  std::vector<std::weak_ptr<Closable>> streams;
};
Registry& registry() {
  static auto* const one = new Registry;
  return *one;
}

class PyStream : public Reader<Stream> {
 public:
  PyStream(std::shared_ptr<Stream> stream, const Kept& kept) : Reader(std::move(stream)), kept_(kept) {}

  std::unique_ptr<PyTouch> next() {
    auto touch = std::make_unique<PyTouch>(take());
    touch->keep(kept_);
    return touch;
  }

 private:
  Kept kept_;
};

std::unique_ptr<PyStream> open_stream(RunSettings settings, bool drop, std::filesystem::path record,
                                      std::filesystem::path trace, std::string device,
                                      const std::vector<std::string>& keep) {
  const Kept kept = kept_of(keep);
  StreamRequest request;
  static_cast<RunSettings&>(request) = std::move(settings);
  request.drop = drop;
  request.record = std::move(record);
  request.trace = std::move(trace);
  request.device = std::move(device);
  std::shared_ptr<Stream> stream = run_apart([request](const std::atomic<bool>& stop) mutable {
    request.found = find_input(request);
    return owned(std::make_unique<Stream>(request, stop));
  });
  return std::make_unique<PyStream>(std::move(stream), kept);
}

/// The session that is written meanwhile; none where none was asked for.
std::optional<py::dict> recorded_of(const Stream& stream) {
  const std::optional<Recording::Written> session = stream.recorded();
  if (!session) return std::nullopt;
  return session_dict(session->folder, session->status);
}

}  // namespace

void enlist(const std::shared_ptr<Closable>& stream) {
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  std::erase_if(all.streams, [](const auto& weak) { return weak.expired(); });
  all.streams.push_back(stream);
}

std::string log_line(const py::kwargs& values) {
  if (values.empty()) throw bad_argument("numbers to log, by name", "none", "log(\"robot\", z_mm=1.25)");
  py::dict row;
  row["monotonic_s"] = py::module_::import("time").attr("monotonic")();
  for (const auto& [key, value] : values) row[key] = value;
  // Arrays and numbers of NumPy are written as lists and numbers.
  const py::object plain = py::cpp_function([](const py::object& other) { return other.attr("tolist")(); });
  return py::str(py::module_::import("json").attr("dumps")(row, py::arg("default") = plain));
}

void close_streams() {
  std::vector<std::weak_ptr<Closable>> all;
  {
    const std::lock_guard lock(registry().mutex);
    all = registry().streams;
  }
  for (const std::weak_ptr<Closable>& weak : all)
    if (const std::shared_ptr<Closable> stream = weak.lock()) stream->close();
}

void bind_live(py::module_& module) {
  bind_function(module, "open_stream", &open_stream, "settings drop record trace device keep");
  const auto of = [](auto get) { return [get](const PyStream& s) { return get(s.stream()); }; };
  py::class_<PyStream> bound(module, "Stream");
  bind_reader(bound);
  bound.def_property_readonly("input", of([](const Stream& s) { return s.input().input; }))
      .def_property_readonly("sensor", of([](const Stream& s) { return s.input().sensor; }))
      .def_property_readonly("width", of([](const Stream& s) { return s.format().width; }))
      .def_property_readonly("height", of([](const Stream& s) { return s.format().height; }))
      .def_property_readonly("frame_count", of([](const Stream& s) { return s.frame_count(); }))
      .def_property_readonly("rate_Hz", of([](const Stream& s) {
                               return s.rate_Hz() > 0 ? std::optional(s.rate_Hz()) : std::nullopt;
                             }))
      .def_property_readonly("clock", of([](const Stream& s) {
                               return std::string(s.live() ? "CLOCK_MONOTONIC" : "recording");
                             }))
      .def_property_readonly("damaged", of([](const Stream& s) { return s.damaged(); }))
      .def_property_readonly("details", of([](const Stream& s) { return s.details(); }))
      .def_property_readonly("recorded", of([](const Stream& s) { return recorded_of(s); }))
      .def("__repr__", [](const PyStream& s) {
        return "<palpate.Stream '" + s.stream().input().input + "', " +
               (s.stream().closed() ? "closed" : "open") + ", " + std::to_string(s.stream().delivered()) +
               " frames>";
      });
}

}  // namespace palpate::python
