// What charts show and how far their axes reach; declared in charts.h.
#include <algorithm>
#include <cmath>

#include "capture/files/measurements.h"
#include "engine/measure/force.h"
#include "viz/panels/charts/charts.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

const Sample* largest_of(const std::deque<Sample>& samples, const TimeSpan& shown,
                         const std::function<Estimate(const Sample&)>& value) {
  const Sample* largest = nullptr;
  double most = 0;
  for (const Sample& s : samples) {
    if (!s.contact || s.time < shown.end - shown.length || s.time > shown.end) continue;
    const Estimate e = value(s);
    if (!has_value(e) || !std::isfinite(e.value) || (largest && e.value <= most)) continue;
    largest = &s;
    most = e.value;
  }
  return largest;
}

double least_shear_axis_N(const Sensor& sensor, const std::deque<Sample>& samples) {
  double noise_N = 0;
  for (const Sample& s : samples)
    if (s.contact)
      for (const Estimate* e : {&s.shear_x_N, &s.shear_y_N})
        if (has_value(*e) && std::isfinite(e->standard_error)) noise_N = std::max(noise_N, e->standard_error);
  const double limit_N = sensor.shear->friction * calibrated_range(*sensor.force).most_N;
  return std::max({0.01, 0.05 * limit_N, 4 * noise_N});
}

ForceRange calibrated_range(const ForceCalibration& force) {
  return {force_of(force, reading_at(force, force.gray_min)).value,
          force_of(force, reading_at(force, force.gray_max)).value};
}

}  // namespace palpate::viz
