// Threads of one process that solve cases, one case a thread.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "perf/lab/dataset/sample.h"

namespace palpate::lump {

class CaseTeam {
 public:
  struct Done {
    std::string packed;
    double wall_s = 0;
  };

  /// `stop` is asked by all threads.
  CaseTeam(uint32_t threads, const Sweep& sweep, Presser presser, std::function<bool()> stop);
  /// Abandons what is not done.
  ~CaseTeam();
  CaseTeam(const CaseTeam&) = delete;
  CaseTeam& operator=(const CaseTeam&) = delete;

  void give(uint32_t number);
  /// Threads without a case.
  uint32_t idle() const;
  /// A case that is done; none where none is within `most_s`. Throws what a press threw, once
  /// those that are done were taken.
  std::optional<Done> take(double most_s);

 private:
  void serve();

  Sweep sweep_;
  Presser presser_;
  std::function<bool()> stop_;
  std::atomic<bool> over_ = false;
  mutable std::mutex guard_;
  std::condition_variable wanted_, done_;
  std::deque<uint32_t> numbers_;
  std::deque<Done> results_;
  std::exception_ptr failure_;
  uint32_t busy_ = 0;
  std::vector<std::thread> threads_;
};

}  // namespace palpate::lump
