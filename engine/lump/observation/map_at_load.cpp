#include "engine/lump/observation/map_at_load.h"

#include <algorithm>
#include <span>

#include "engine/numeric/through_origin.h"

namespace palpate::lump {

PressureMap map_at_load(const Observation& observation, double force_N) {
  const std::vector<double>& own = observation.force_N;
  const size_t count = std::min<size_t>(4, own.size());
  const auto above = static_cast<size_t>(std::lower_bound(own.begin(), own.end(), force_N) - own.begin());
  const size_t first = std::min(above > count / 2 ? above - count / 2 : 0, own.size() - count);
  PressureMap map = observation.pressure_Pa.back();
  std::fill(map.values.begin(), map.values.end(), 0.0f);
  const std::vector<double> weights = weights_through_origin(std::span(own).subspan(first, count), force_N);
  for (size_t k = 0; k < count; ++k)
    for (size_t i = 0; i < map.values.size(); ++i)
      map.values[i] +=
          static_cast<float>(weights[k] * static_cast<double>(observation.pressure_Pa[first + k].values[i]));
  return map;
}

}  // namespace palpate::lump
