// Samples of run time: wall time and CPU time of the whole process.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "perf/profile/profile.h"

namespace palpate::gpu {
class Context;
}

namespace palpate::perf {

/// Callbacks of every measurement while it runs.
struct Watch {
  std::function<bool()> stopped = [] { return false; };              ///< Ctrl-C: finish nothing more
  std::function<void(const std::string&)> say = [](const auto&) {};  ///< progress, for a person
  std::function<void(const gpu::Context&)> leave = [](const auto&) {
  };  ///< called with each device when done with it
};

/// Notes, and says, that something was not measured, and why.
void skip(const std::string& what, const Watch& watch, Profile& profile,
          const std::string& why = "the time budget is used up");

/// One way to do the work, and its samples: one for each run.
struct Contender {
  std::string name;
  std::function<void()> run;
  std::function<void()> before = {};  ///< each run, not timed
  std::vector<double> wall_ms = {};
  std::vector<double> cpu_ms = {};
  double spent_ms = 0;
};

/// Least and most rounds, and the wall time after which no further round starts.
struct Rounds {
  int least = 5;
  int most = 200;
  double seconds = 1;
  /// A way that used up its fraction of the time sits out the later rounds, so that slow ways do not keep
  /// fast ones from more samples; otherwise all run in every round.
  bool may_sit_out = false;
  bool warm_up = true;  ///< each runs once uncounted before
};

/// Runs all in turn (A B C A B C ...), so that a machine that drifts drifts for all. False where `watch`
/// stopped it.
bool take_turns(std::span<Contender> contenders, const Rounds& rounds, const Watch& watch);

/// Quantile by linear interpolation between the sorted samples; NaN for none.
double quantile(std::vector<double> samples, double q);
Distribution distribution_of(const std::vector<double>& samples_ms);
/// Bins that grow by a constant factor over the samples' range.
Histogram histogram_of(const std::vector<double>& samples_ms, size_t bins);

double wall_now_s();
double cpu_now_ms();  ///< of the process, all threads

}  // namespace palpate::perf
