#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "capture/files/lump_maps.h"
#include "engine/lump/input_errors.h"
#include "engine/lump/observation/observe.h"
#include "viz/python/arrays.h"
#include "viz/python/numeric.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

fem::Map map_of(const py::handle& given, double pitch_mm) {
  Shape shape;
  fem::Map map;
  map.values = numbers_of<float>(given, "a pressure map", 2, "rows x columns", shape, Finite::Free);
  map.height = static_cast<uint32_t>(shape[0]);
  map.width = static_cast<uint32_t>(shape[1]);
  map.pitch_mm = {pitch_mm, pitch_mm};
  return map;
}

/// The estimate as JSON and as lines for people.
py::tuple estimate(const py::list& maps, const std::vector<double>& force_N, double young_Pa,
                   const std::array<double, 3>& block_mm, double pitch_mm,
                   const std::array<double, 2>& window_mm, std::optional<double> noise_Pa,
                   const std::array<double, 3>& input_errors, const std::string& network,
                   const std::string& method) {
  if (!(young_Pa > 0))
    throw bad_argument("young_Pa above 0", std::to_string(young_Pa), "the tissue's modulus in Pa");
  if (!(pitch_mm > 0)) throw bad_argument("pitch_mm above 0", std::to_string(pitch_mm), "mm between nodes");
  std::vector<fem::Map> all;
  for (const py::handle& map : maps) all.push_back(map_of(map, pitch_mm));
  lump::Observation observation = lump::observe(std::move(all), force_N);
  observation.young_Pa = young_Pa;
  observation.block_mm = block_mm;
  observation.window_mm = window_mm;
  if (noise_Pa) observation.noise_Pa = *noise_Pa;
  const lump::InputErrors errors{input_errors[0], input_errors[1], input_errors[2]};
  const lump::Estimate found = run_apart([=](const std::atomic<bool>&) {
    const auto loaded = lump::load_network(network);
    lump::Estimate answer = lump::named_estimator(method, loaded)(observation);
    // The network moves as any estimator does, in milliseconds.
    widen_for_input_errors(lump::named_estimator("network", loaded), observation, errors, answer);
    return answer;
  });
  return py::make_tuple(estimate_json(found), estimate_text(found));
}

}  // namespace

void bind_lump(py::module_& module) {
  module.def("lump_estimate", &estimate, py::arg("maps"), py::arg("force_N"), py::arg("young_Pa"),
             py::arg("block_mm"), py::arg("pitch_mm"), py::arg("window_mm"), py::arg("noise_Pa"),
             py::arg("input_errors"), py::arg("network"), py::arg("method"));
}

}  // namespace palpate::python
