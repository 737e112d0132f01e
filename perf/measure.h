// Paired timing of two implementations of the same work: A B A B ... in one process, so that a drift of the
// machine affects both.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace palpate::perf {

struct Summary {
  double median = 0;
  double p95 = 0;
};

/// Half of all repetitions lie between low and high.
struct Quartiles {
  double low = 0;
  double median = 0;
  double high = 0;
  double spread() const { return high - low; }
};
Quartiles quartiles(const std::vector<double>& values);

/// One run, or the mean of a few on end.
struct Sample {
  double wall_ms = 0;
  double cpu_ms = 0;  ///< of the whole process, all threads
};
Sample time_runs(const std::function<void()>& run, int runs);

/// One way of doing the work, over all repetitions.
struct Side {
  std::string name;
  Summary wall_ms;
  Summary cpu_ms;  ///< of the whole process, all threads
};

struct Pair {
  std::string work;
  std::string size;
  Side ours;
  Side rival;
  double wall_ratio = 0;  ///< median over repetitions of ours / rival
  double cpu_ratio = 0;
  Quartiles wall_ratios;  ///< the same with their spread
  Quartiles cpu_ratios;
};

struct Work {
  std::string name;
  std::function<void()> run;
};

/// Runs both once uncounted, then `repetitions` times in turn. Each sample is the mean of `inner` runs.
Pair compare(const std::string& work, const std::string& size, const Work& ours, const Work& rival,
             int repetitions, int inner);

/// One header line and one line for each pair.
std::string csv_header();
std::string csv_row(const Pair& pair);

}  // namespace palpate::perf
