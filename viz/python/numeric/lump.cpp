#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "capture/files/estimate_report.h"
#include "capture/run/palpation/compared_days.h"
#include "engine/base/text.h"
#include "engine/lump/estimator.h"
#include "engine/lump/observation/observe.h"
#include "viz/python/arrays.h"
#include "viz/python/bindings.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

PressureMap map_of(const py::handle& given, double pitch_mm) {
  Shape shape;
  PressureMap map;
  map.values = numbers_of<float>(given, "a pressure map", 2, "rows x columns", shape, Finite::Free);
  map.height = static_cast<uint32_t>(shape[0]);
  map.width = static_cast<uint32_t>(shape[1]);
  map.pitch_mm = {pitch_mm, pitch_mm};
  return map;
}

using ValueAndError = std::array<double, 2>;  ///< a standard deviation, 0: exact

/// Throws an ArgumentError where one is missing or makes no sense, also for a block of this thickness.
std::optional<lump::Skin> skin_of(const std::optional<ValueAndError>& thickness_mm,
                                  const std::optional<ValueAndError>& ratio, double block_thickness_mm) {
  if (!thickness_mm && !ratio) return std::nullopt;
  if (!thickness_mm || !ratio)
    throw bad_argument("skin_mm and skin_ratio", ratio ? "skin_ratio alone" : "skin_mm alone",
                       "skin_mm=2, skin_ratio=3");
  const auto check = [](const char* wanted, const ValueAndError& found, double least, double most) {
    const auto [value, sd] = found;
    if (!(value >= least && value <= most) || !(sd >= 0 && sd <= 0.3 * value))
      throw bad_argument(wanted, text("%g +- %g", value, sd), "2, or (2, 0.2) for 2 +- 0.2");
  };
  check("skin_mm from 0.05 to half of the thickness, and a standard deviation of at most 30 %", *thickness_mm,
        0.05, block_thickness_mm / 2);
  check("skin_ratio from 0.05 to 50, and a standard deviation of at most 30 %", *ratio, 0.05, 50);
  return lump::Skin{(*thickness_mm)[0], (*ratio)[0], (*thickness_mm)[1] / (*thickness_mm)[0],
                    (*ratio)[1] / (*ratio)[0]};
}

/// Throws an ArgumentError for both, and a friction that makes no sense.
std::optional<lump::Plate> plate_of(const std::optional<ValueAndError>& friction, bool sticks) {
  if (!friction && !sticks) return std::nullopt;
  if (friction && sticks)
    throw bad_argument("either plate_friction or plate_sticks", "both", "one of the two");
  if (sticks) return lump::Plate{true, 0, 0};
  const auto [value, sd] = *friction;
  if (!(value >= 0 && value <= 2) || !(sd >= 0 && sd <= 0.5))
    throw bad_argument("plate_friction from 0 to 2, and a standard deviation of at most 0.5",
                       text("%g +- %g", value, sd), "0.1, or (0.1, 0.03) for 0.1 +- 0.03");
  return lump::Plate{false, value, sd};
}

/// The estimate as JSON and as lines for people.
py::tuple estimate(const py::list& maps, const std::vector<double>& force_N, std::optional<double> young_Pa,
                   const std::vector<double>& press_mm, double press_sd_mm,
                   const std::array<double, 3>& block_mm, double pitch_mm,
                   const std::array<double, 2>& window_mm, std::optional<double> noise_Pa,
                   const std::optional<ValueAndError>& skin_mm,
                   const std::optional<ValueAndError>& skin_ratio,
                   const std::optional<ValueAndError>& plate_friction, bool plate_sticks,
                   const std::array<double, 3>& input_errors, double uneven_sd, double place_sd_mm,
                   const std::string& network, const std::string& method) {
  if (young_Pa && !(*young_Pa > 0))
    throw bad_argument("young_Pa above 0", std::to_string(*young_Pa), "the tissue's modulus in Pa");
  if (!young_Pa && press_mm.empty())
    throw bad_argument("young_Pa, or press_mm by which it is found", "neither",
                       "the way of the plate at each load, mm");
  if (!(uneven_sd >= 0 && uneven_sd <= 0.5))
    throw bad_argument("uneven_sd from 0 to 0.5", std::to_string(uneven_sd), "0.01, which is 1 %");
  if (!(place_sd_mm >= 0)) throw bad_argument("place_sd_mm of 0 or more", std::to_string(place_sd_mm), "0.2");
  if (!(pitch_mm > 0)) throw bad_argument("pitch_mm above 0", std::to_string(pitch_mm), "mm between nodes");
  std::vector<PressureMap> all;
  for (const py::handle& map : maps) all.push_back(map_of(map, pitch_mm));
  lump::Observation observation = lump::observe(std::move(all), force_N);
  observation.young_Pa = young_Pa.value_or(0);
  observation.press_mm = press_mm;
  observation.press_sd_mm = press_sd_mm;
  observation.block_mm = block_mm;
  observation.window_mm = window_mm;
  observation.skin = skin_of(skin_mm, skin_ratio, block_mm[2]);
  observation.plate = plate_of(plate_friction, plate_sticks);
  if (noise_Pa) observation.noise_Pa = *noise_Pa;
  observation.uneven_sd = uneven_sd;
  observation.place_sd_mm = place_sd_mm;
  const lump::ErrorSources errors{input_errors[0], input_errors[1], input_errors[2]};
  const lump::Estimate found = run_apart([=](const std::atomic<bool>& stop) {
    return lump::named_estimator(method, lump::load_network(network), errors,
                                 {.stop = watch_of(stop).stop})(observation);
  });
  const Facts facts = facts_of(found);
  return py::make_tuple(facts.json.dump(2), facts.text);
}

/// All days as JSON.
std::string compare(const std::vector<std::filesystem::path>& folders,
                    const std::array<double, 3>& input_errors, const std::filesystem::path& network) {
  const lump::ErrorSources errors{input_errors[0], input_errors[1], input_errors[2]};
  const auto days =
      run_apart([=](const std::atomic<bool>&) { return compare_days(folders, errors, network); });
  return days_json(days).dump(2, json::Utf8::Replace);
}

}  // namespace

void bind_lump(py::module_& module) {
  bind_function(module, "lump_estimate", &estimate,
                "maps force_N young_Pa press_mm press_sd_mm block_mm pitch_mm window_mm noise_Pa "
                "skin_mm skin_ratio plate_friction plate_sticks input_errors uneven_sd place_sd_mm "
                "network method");
  bind_function(module, "lump_compare", &compare, "folders input_errors network");
}

}  // namespace palpate::python
