// Cases of a study, judged by a team of threads.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "engine/base/stop.h"
#include "perf/lab/training/steps.h"

namespace palpate::lump {

/// judge(n) of each n below `count`, as in_parallel() by so many threads; in the order of n. After each one
/// progress(how many are done) is asked, where there is one, by one thread at a time: false ends the study,
/// as does Stopped from judge; those that were done by then are returned.
template <typename Judge>
auto judged_by_team(size_t count, uint32_t threads, const std::function<bool(size_t)>& progress,
                    const Judge& judge) {
  using Found = decltype(judge(size_t{0}));
  std::vector<std::optional<Found>> found(count);
  size_t done = 0;
  std::mutex guard;
  try {
    in_parallel(threads, count, [&](size_t n) {
      found[n].emplace(judge(n));
      const std::scoped_lock lock(guard);
      if (progress && !progress(++done)) throw Stopped();
    });
  } catch (const Stopped&) {
  }
  std::vector<Found> judged;
  for (std::optional<Found>& one : found)
    if (one) judged.push_back(std::move(*one));
  return judged;
}

}  // namespace palpate::lump
