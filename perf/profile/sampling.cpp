#include "perf/profile/sampling.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>

namespace palpate::perf {

double wall_now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double cpu_now_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

void skip(const std::string& what, const Watch& watch, Profile& profile, const std::string& why) {
  profile.skipped.push_back({what, why});
  watch.say(what + ": skipped, " + why);
}

bool take_turns(std::span<Contender> contenders, const Rounds& rounds, const Watch& watch) {
  for (Contender& contender : contenders) {
    if (watch.stopped()) return false;
    if (!rounds.warm_up) continue;
    if (contender.before) contender.before();
    contender.run();
  }
  const double start_s = wall_now_s();
  const double share_ms = rounds.seconds * 1e3 / static_cast<double>(contenders.size());
  for (int round = 0; round < rounds.most; ++round) {
    if (round >= rounds.least && wall_now_s() - start_s > rounds.seconds) break;
    for (Contender& contender : contenders) {
      if (watch.stopped()) return false;
      if (rounds.may_sit_out && round >= rounds.least && contender.spent_ms > share_ms) continue;
      if (contender.before) contender.before();
      const double cpu_ms = cpu_now_ms(), wall_s = wall_now_s();
      contender.run();
      contender.wall_ms.push_back((wall_now_s() - wall_s) * 1e3);
      contender.spent_ms += contender.wall_ms.back();
      contender.cpu_ms.push_back(cpu_now_ms() - cpu_ms);
    }
  }
  return true;
}

double quantile(std::vector<double> samples, double q) {
  if (samples.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(samples.begin(), samples.end());
  const double place = q * static_cast<double>(samples.size() - 1);
  const auto below = static_cast<size_t>(place);
  const size_t above = std::min(below + 1, samples.size() - 1);
  return std::lerp(samples[below], samples[above], place - static_cast<double>(below));
}

Distribution distribution_of(const std::vector<double>& samples_ms) {
  if (samples_ms.empty()) return {};
  std::vector<double> sorted = samples_ms;
  std::sort(sorted.begin(), sorted.end());
  return {sorted.size(),          sorted.front(),         quantile(sorted, 0.25), quantile(sorted, 0.5),
          quantile(sorted, 0.75), quantile(sorted, 0.95), quantile(sorted, 0.99), sorted.back()};
}

Histogram histogram_of(const std::vector<double>& samples_ms, size_t bins) {
  Histogram histogram;
  if (samples_ms.empty() || bins == 0) return histogram;
  const auto [low, high] = std::minmax_element(samples_ms.begin(), samples_ms.end());
  // A range even where all samples are equal, and the largest sample inside the last bin.
  const double first = std::max(*low, 1e-6), last = std::max(*high * 1.001, first * 1.01);
  const double step = std::log(last / first) / static_cast<double>(bins);
  for (size_t i = 0; i <= bins; ++i)
    histogram.edges_ms.push_back(first * std::exp(step * static_cast<double>(i)));
  histogram.counts.assign(bins, 0);
  for (const double sample : samples_ms) {
    const double place = std::log(std::max(sample, first) / first) / step;
    ++histogram.counts[std::min(static_cast<size_t>(place), bins - 1)];
  }
  return histogram;
}

}  // namespace palpate::perf
