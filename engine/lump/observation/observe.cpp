#include "engine/lump/observation/observe.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "engine/lump/observation/saturated_loads.h"
#include "palpate/error.h"

namespace palpate::lump {

Observation observe(std::vector<PressureMap> pressure_Pa, const std::vector<double>& force_N) {
  if (force_N.size() != pressure_Pa.size() || force_N.empty())
    throw Error(Failure::Usage, "a force for each of " + std::to_string(pressure_Pa.size()) + " maps",
                std::to_string(force_N.size()), "one force a map, in the same order");
  std::vector<size_t> order(force_N.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return force_N[a] < force_N[b]; });
  Observation observation;
  for (const size_t k : order) {
    observation.pressure_Pa.push_back(std::move(pressure_Pa[k]));
    observation.force_N.push_back(force_N[k]);
  }
  observation.noise_Pa = roughness(observation.pressure_Pa.back());
  observation.saturated_fraction = saturated_fraction(observation.pressure_Pa);
  return observation;
}

}  // namespace palpate::lump
