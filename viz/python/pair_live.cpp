#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <limits>

#include "capture/v4l2/camera_name.h"
#include "palpate/error.h"
#include "viz/python/bind_quantities.h"
#include "viz/python/bindings.h"
#include "viz/python/device.h"
#include "viz/python/pair_stream.h"
#include "viz/python/reader.h"
#include "viz/python/touch.h"

namespace palpate::python {
namespace {

namespace py = pybind11;

struct PyPair {
  GripFrame row;
  std::array<py::object, 2> touches;
};

class PyPairStream : public Reader<PairStream> {
 public:
  PyPairStream(std::shared_ptr<PairStream> stream, const Kept& kept)
      : Reader(std::move(stream)), kept_(kept) {}

  std::unique_ptr<PyPair> next() {
    const std::shared_ptr<HeldPair> held = take();
    auto pair = std::make_unique<PyPair>(PyPair{held->row, {py::none(), py::none()}});
    for (const Side side : kSides) {
      if (!held->of[index(side)]) continue;
      auto touch = std::make_unique<PyTouch>(held->of[index(side)]);
      touch->keep(kept_);
      pair->touches[index(side)] = py::cast(std::move(touch));
    }
    return pair;
  }

 private:
  Kept kept_;
};

using Fingers = std::array<RunSettings, 2>;

/// Their cameras, which are named by port or serial number, by the nodes that these have today.
Fingers found(Fingers fingers) {
  constexpr std::string_view kCamera = "camera:";
  for (RunSettings& finger : fingers) {
    if (!finger.input.starts_with(kCamera)) continue;
    const size_t end = std::min(finger.input.find('?'), finger.input.size());
    const std::string name = finger.input.substr(kCamera.size(), end - kCamera.size());
    finger.input.replace(kCamera.size(), name.size(), v4l2::find_camera(name, v4l2::named_cameras()));
  }
  return fingers;
}

std::unique_ptr<PyPairStream> open_pair_stream(const std::optional<Fingers>& fingers,
                                               const std::filesystem::path& recorded,
                                               const std::filesystem::path& grip, bool drop,
                                               const std::filesystem::path& record,
                                               const std::filesystem::path& trace, const std::string& device,
                                               const std::vector<std::string>& keep) {
  const Kept kept = kept_of(keep);
  PairStreamRequest request;
  if (fingers) request.fingers = found(*fingers);
  request.recorded = recorded;
  request.grip = grip;
  request.out = record;
  request.drop = drop;
  request.trace = trace;
  request.device = device;
  return std::make_unique<PyPairStream>(run_apart([request](const std::atomic<bool>& stop) {
                                          return owned(std::make_unique<PairStream>(request, stop));
                                        }),
                                        kept);
}

/// Rows and each finger's session.
py::dict pair_dict(const std::filesystem::path& folder, const std::array<Recording::Written, 2>& sessions,
                   uint64_t rows) {
  py::dict d;
  d["folder"] = folder;
  d["rows"] = rows;
  for (const Side side : kSides) {
    const Recording::Written& session = sessions[index(side)];
    d[to_string(side)] = session_dict(session.folder, session.status);
  }
  return d;
}

py::dict record_pair_to(const Fingers& fingers, const std::filesystem::path& grip,
                        const std::filesystem::path& folder, const std::string& device) {
  const PairOutcome outcome = run_apart([=](const std::atomic<bool>& stop) {
    PairRequest request;
    request.fingers = found(fingers);
    request.grip = grip;
    request.out = folder;
    std::shared_ptr<gpu::Context> context;
    PairOutcome ended = record_pair([&]() -> gpu::Context& { return *(context = shared_device(device)); },
                                    request, watch_of(stop));
    if (const std::string error = ended.error(); !error.empty())
      throw Error(Failure::Output, "a pair in '" + folder.string() + "'", error, "another folder");
    return ended;
  });
  py::dict d = pair_dict(folder, outcome.recordings.at(0).sessions, outcome.rows);
  d["pairs"] = outcome.run.skew.pairs();
  d["skew_mean_ms"] = outcome.run.skew.mean_ms();
  d["skew_sd_ms"] = outcome.run.skew.sd_ms();
  return d;
}

std::optional<py::dict> recorded_of(const PairStream& stream) {
  const std::optional<PairRecording::Written> written = stream.recorded();
  if (!written) return std::nullopt;
  return pair_dict(written->folder, written->sessions, written->rows);
}

}  // namespace

void bind_pair_live(py::module_& module) {
  bind_function(module, "open_pair_stream", &open_pair_stream,
                "fingers recorded grip drop record trace device keep");
  bind_function(module, "record_pair", &record_pair_to, "fingers grip folder device");
  py::class_<GripFrame> grip(module, "Grip");
  bind_quantities(grip, grip_quantities(), [](const GripFrame& row) -> const GripFrame& { return row; });
  grip.def("__repr__", [](const GripFrame& row) {
    return "<palpate.Grip " + measured(row.grip ? row.grip->force_N : Estimate{}, "N").text() + ">";
  });
  py::class_<PyPair>(module, "Pair")
      .def_property_readonly("left", [](const PyPair& p) { return p.touches[0]; })
      .def_property_readonly("right", [](const PyPair& p) { return p.touches[1]; })
      .def_property_readonly("grip", [](const PyPair& p) { return p.row; })
      .def_property_readonly("time_s",
                             [](const PyPair& p) { return 1e-9 * static_cast<double>(p.row.time_ns); })
      .def_property_readonly(
          "skew_ms",
          [](const PyPair& p) { return p.row.skew_ms.value_or(std::numeric_limits<double>::quiet_NaN()); })
      .def("__repr__", [](const PyPair& p) {
        const auto number = [](const std::optional<uint64_t>& frame) {
          return frame ? std::to_string(*frame) : "none";
        };
        return "<palpate.Pair of frames " + number(p.row.left) + " and " + number(p.row.right) + ": " +
               measured(p.row.grip ? p.row.grip->force_N : Estimate{}, "N").text() + ">";
      });
  py::class_<PyPairStream> bound(module, "PairStream");
  bind_reader(bound);
  const auto of_both = [](auto get) {
    return [get](const PyPairStream& s) {
      return py::make_tuple(get(s.stream().input(Side::Left)), get(s.stream().input(Side::Right)));
    };
  };
  bound.def_property_readonly("inputs", of_both([](const MeasuredInput& input) { return input.input; }))
      .def_property_readonly("sensors", of_both([](const MeasuredInput& input) { return input.sensor; }))
      .def_property_readonly("recorded", [](const PyPairStream& s) { return recorded_of(s.stream()); })
      .def("__repr__", [](const PyPairStream& s) {
        return std::string("<palpate.PairStream, ") + (s.stream().closed() ? "closed" : "open") + ", " +
               std::to_string(s.stream().delivered()) + " rows>";
      });
}

}  // namespace palpate::python
