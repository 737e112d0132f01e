#include "capture/source.h"

#include <algorithm>
#include <cmath>

namespace palpate {

std::vector<double> uneven_times(const std::vector<int64_t>& times_ns, double rate_Hz) {
  constexpr double kEven = 0.25;  // of a period
  std::vector<double> times_s;
  double farthest_s = 0;
  for (const int64_t time_ns : times_ns) {
    const double time_s = 1e-9 * static_cast<double>(time_ns - times_ns.front());
    if (!times_s.empty() && time_s <= times_s.back()) return {};
    farthest_s = std::max(farthest_s, std::abs(time_s - static_cast<double>(times_s.size()) / rate_Hz));
    times_s.push_back(time_s);
  }
  return rate_Hz > 0 && farthest_s * rate_Hz >= kEven ? times_s : std::vector<double>{};
}

}  // namespace palpate
