#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <unistd.h>

#include <algorithm>

#include "viz/python/bindings.h"
#include "viz/python/device.h"
#include "viz/python/errors.h"
#include "viz/python/sensor.h"
#include "viz/python/stream.h"
#include "viz/python/touch.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

namespace py = pybind11;

/// Open streams, for the interpreter's end. Never destroyed.
struct Registry {
  std::mutex mutex;
  std::vector<std::weak_ptr<Stream>> streams;
};
Registry& registry() {
  static auto* const one = new Registry;
  return *one;
}

/// A stream that a fork leaves alone: its threads are the parent's.
std::shared_ptr<Stream> owned(std::unique_ptr<Stream> made) {
  const pid_t owner = getpid();
  std::shared_ptr<Stream> stream(made.release(), [owner](Stream* s) {
    if (getpid() == owner) delete s;
  });
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  std::erase_if(all.streams, [](const auto& weak) { return weak.expired(); });
  all.streams.push_back(stream);
  return stream;
}

class PyStream {
 public:
  PyStream(std::shared_ptr<Stream> stream, const Kept& kept)
      : stream_(std::move(stream)), kept_(kept), owner_(getpid()) {}
  ~PyStream() {
    if (getpid() != owner_) return;
    try {
      const py::gil_scoped_release release;
      stream_->close();
      stream_.reset();
    } catch (...) {  // NOLINT(bugprone-empty-catch): nobody is left to hear it
    }
  }
  PyStream(const PyStream&) = delete;
  PyStream& operator=(const PyStream&) = delete;

  Stream& stream() const { return *stream_; }
  void close() {
    if (getpid() != owner_) return;
    const py::gil_scoped_release release;
    stream_->close();
  }

  std::unique_ptr<PyTouch> next() {
    if (getpid() != owner_)
      throw Refusal{"DeviceError", "a stream that process " + std::to_string(getpid()) + " opened",
                    "one that was opened before the fork, by process " + std::to_string(owner_),
                    "palpate.open in the child, or multiprocessing.set_start_method('spawn')"};
    {
      const std::lock_guard lock(stream_->mutex());
      stream_->ask();
    }
    const std::shared_ptr<HeldFrame> held = wait_for(
        stream_->mutex(), stream_->changed(), [this] { return stream_->ready(); },
        [this] { return stream_->take(); });
    if (!held) throw py::stop_iteration();
    auto touch = std::make_unique<PyTouch>(held);
    touch->keep(kept_);
    return touch;
  }

 private:
  std::shared_ptr<Stream> stream_;
  Kept kept_;
  pid_t owner_;
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
  py::dict d;
  d["folder"] = session->folder;
  d["recorded"] = session->status.recorded;
  d["dropped"] = session->status.dropped;
  d["measured"] = session->status.measured;
  d["error"] = session->status.error;
  return d;
}

}  // namespace

void close_streams() {
  std::vector<std::weak_ptr<Stream>> all;
  {
    const std::lock_guard lock(registry().mutex);
    all = registry().streams;
  }
  for (const std::weak_ptr<Stream>& weak : all)
    if (const std::shared_ptr<Stream> stream = weak.lock()) stream->close();
}

void bind_live(py::module_& module) {
  bind_function(module, "open_stream", &open_stream, "settings drop record trace device keep");
  const auto of = [](auto get) { return [get](const PyStream& s) { return get(s.stream()); }; };
  py::class_<PyStream>(module, "Stream")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &PyStream::next)
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](PyStream& s, const py::args&) { s.close(); })
      .def("close", &PyStream::close)
      .def("log",
           [](const PyStream& s, const std::string& name, const py::kwargs& values) {
             if (values.empty())
               throw bad_argument("numbers to log, by name", "none", "log(\"robot\", z_mm=1.25)");
             py::dict row;
             row["monotonic_s"] = py::module_::import("time").attr("monotonic")();
             for (const auto& [key, value] : values) row[key] = value;
             // Arrays and numbers of NumPy are written as lists and numbers.
             const py::object plain =
                 py::cpp_function([](const py::object& other) { return other.attr("tolist")(); });
             const std::string line =
                 py::str(py::module_::import("json").attr("dumps")(row, py::arg("default") = plain));
             s.stream().log(name, line);
           })
      .def_property_readonly("closed", of([](const Stream& s) { return s.closed(); }))
      .def_property_readonly("dropped", of([](const Stream& s) { return s.dropped(); }))
      .def_property_readonly("delivered", of([](const Stream& s) { return s.delivered(); }))
      .def_property_readonly("drops", of([](const Stream& s) { return s.drops(); }))
      .def_property_readonly("input", of([](const Stream& s) { return s.input().input; }))
      .def_property_readonly("sensor", of([](const Stream& s) { return s.input().sensor; }))
      .def_property_readonly("width", of([](const Stream& s) { return s.format().width; }))
      .def_property_readonly("height", of([](const Stream& s) { return s.format().height; }))
      .def_property_readonly("frame_count", of([](const Stream& s) { return s.frame_count(); }))
      .def_property_readonly("rate_Hz", of([](const Stream& s) {
                               return s.rate_Hz() > 0 ? std::optional(s.rate_Hz()) : std::nullopt;
                             }))
      .def_property_readonly("live", of([](const Stream& s) { return s.live(); }))
      .def_property_readonly("clock", of([](const Stream& s) {
                               return std::string(s.live() ? "CLOCK_MONOTONIC" : "recording");
                             }))
      .def_property_readonly("warning", of([](const Stream& s) { return s.warning(); }))
      .def_property_readonly("damaged", of([](const Stream& s) { return s.damaged(); }))
      .def_property_readonly("state", of([](const Stream& s) { return s.state(); }))
      .def_property_readonly("details", of([](const Stream& s) { return s.details(); }))
      .def_property_readonly("device", of([](const Stream& s) { return s.device_name(); }))
      .def_property_readonly("device_losses", of([](const Stream& s) { return s.device_losses(); }))
      .def_property_readonly("recorded", of([](const Stream& s) { return recorded_of(s); }))
      .def("__repr__", [](const PyStream& s) {
        return "<palpate.Stream '" + s.stream().input().input + "', " +
               (s.stream().closed() ? "closed" : "open") + ", " + std::to_string(s.stream().delivered()) +
               " frames>";
      });
}

}  // namespace palpate::python
