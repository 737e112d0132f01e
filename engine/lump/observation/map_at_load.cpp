#include "engine/lump/observation/map_at_load.h"

#include <algorithm>

namespace palpate::lump {

PressureMap map_at_load(const Observation& observation, double force_N) {
  const std::vector<double>& own = observation.force_N;
  const size_t count = std::min<size_t>(4, own.size());
  const auto above = static_cast<size_t>(std::lower_bound(own.begin(), own.end(), force_N) - own.begin());
  const size_t first = std::min(above > count / 2 ? above - count / 2 : 0, own.size() - count);
  PressureMap map = observation.pressure_Pa.back();
  std::fill(map.values.begin(), map.values.end(), 0.0f);
  for (size_t k = first; k < first + count; ++k) {
    double weight = force_N / own[k];
    for (size_t l = first; l < first + count; ++l)
      if (l != k) weight *= (force_N - own[l]) / (own[k] - own[l]);
    for (size_t i = 0; i < map.values.size(); ++i)
      map.values[i] += static_cast<float>(weight * static_cast<double>(observation.pressure_Pa[k].values[i]));
  }
  return map;
}

}  // namespace palpate::lump
