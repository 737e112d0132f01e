// A stream as Python sees it: an iterator that Ctrl-C ends and a fork leaves alone.
#pragma once

#include <pybind11/pybind11.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "capture/live/recorder.h"
#include "viz/python/handover.h"
#include "viz/python/waiting.h"

namespace palpate::python {

/// Closes it at the interpreter's end.
void enlist(const std::shared_ptr<Closable>& stream);

/// A stream that a fork leaves alone: its threads are the parent's.
template <typename Stream>
std::shared_ptr<Stream> owned(std::unique_ptr<Stream> made) {
  const pid_t owner = getpid();
  std::shared_ptr<Stream> stream(made.release(), [owner](Stream* s) {
    if (getpid() == owner) delete s;
  });
  enlist(stream);
  return stream;
}

template <typename Stream>
class Reader {
 public:
  explicit Reader(std::shared_ptr<Stream> stream) : stream_(std::move(stream)), owner_(getpid()) {}
  ~Reader() {
    if (getpid() != owner_) return;
    try {
      const pybind11::gil_scoped_release release;
      stream_->close();
      stream_.reset();
    } catch (...) {  // NOLINT(bugprone-empty-catch): nobody is left to hear it
    }
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  Stream& stream() const { return *stream_; }
  void close() {
    if (getpid() != owner_) return;
    const pybind11::gil_scoped_release release;
    stream_->close();
  }

 protected:
  /// The next item; what was taken before expires. Throws stop_iteration after the last.
  auto take() {
    if (getpid() != owner_)
      throw Refusal{"DeviceError", "a stream that process " + std::to_string(getpid()) + " opened",
                    "one that was opened before the fork, by process " + std::to_string(owner_),
                    "palpate.open in the child, or multiprocessing.set_start_method('spawn')"};
    {
      const std::lock_guard lock(stream_->mutex());
      stream_->ask();
    }
    auto item = wait_for(
        stream_->mutex(), stream_->changed(), [this] { return stream_->ready(); },
        [this] { return stream_->take(); });
    if (!item) throw pybind11::stop_iteration();
    return item;
  }

 private:
  std::shared_ptr<Stream> stream_;
  pid_t owner_;
};

/// A row of a log as a line of JSON, with the time of now where it has none.
std::string log_line(const pybind11::kwargs& values);

/// What every stream has.
template <typename Class>
void bind_reader(Class& bound) {
  namespace py = pybind11;
  using Bound = typename Class::type;
  const auto of = [](auto get) { return [get](const Bound& s) { return get(s.stream()); }; };
  bound.def("__iter__", [](py::object self) { return self; })
      .def("__next__", &Bound::next)
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](Bound& s, const py::args&) { s.close(); })
      .def("close", &Bound::close)
      .def("log", [](const Bound& s, const std::string& name,
                     const py::kwargs& values) { s.stream().log(name, log_line(values)); })
      .def_property_readonly("closed", of([](const auto& s) { return s.closed(); }))
      .def_property_readonly("dropped", of([](const auto& s) { return s.dropped(); }))
      .def_property_readonly("delivered", of([](const auto& s) { return s.delivered(); }))
      .def_property_readonly("drops", of([](const auto& s) { return s.drops(); }))
      .def_property_readonly("live", of([](const auto& s) { return s.live(); }))
      .def_property_readonly("warning", of([](const auto& s) { return s.warning(); }))
      .def_property_readonly("state", of([](const auto& s) { return s.state(); }))
      .def_property_readonly("device", of([](const auto& s) { return s.device_name(); }))
      .def_property_readonly("device_losses", of([](const auto& s) { return s.device_losses(); }));
}

/// A session that is written meanwhile.
inline pybind11::dict session_dict(const std::filesystem::path& folder, const SessionStatus& status) {
  pybind11::dict d;
  d["folder"] = folder;
  d["recorded"] = status.recorded;
  d["dropped"] = status.dropped;
  d["measured"] = status.measured;
  d["error"] = status.error;
  return d;
}

}  // namespace palpate::python
