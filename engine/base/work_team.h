// A few threads that do the parts of one piece of work, again and again, with little to wait for between.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

namespace palpate {

class WorkTeam {
 public:
  /// `members` threads, the caller's among them; 0: one per core.
  explicit WorkTeam(uint32_t members);
  ~WorkTeam();
  WorkTeam(const WorkTeam&) = delete;
  WorkTeam& operator=(const WorkTeam&) = delete;

  uint32_t members() const { return static_cast<uint32_t>(threads_.size()) + 1; }

  /// Calls work(part) for each part in [0, members()) and returns when all are done. Threads take parts as
  /// they come: on a busy machine nobody waits for one that has not woken up. `work` throws nothing. Only one
  /// thread calls run.
  void run(const std::function<void(uint32_t)>& work);

  /// The range [first, second) of `count` things that `part` works on.
  std::pair<uint32_t, uint32_t> share(uint32_t count, uint32_t part) const {
    const uint64_t n = members();
    return {static_cast<uint32_t>(count * uint64_t{part} / n),
            static_cast<uint32_t>(count * (uint64_t{part} + 1) / n)};
  }

 private:
  void take_parts(uint32_t round);
  void serve();

  std::vector<std::thread> threads_;
  const std::function<void(uint32_t)>* work_ = nullptr;
  std::atomic<uint64_t> next_ = 0;   // part to take, below the round's number
  std::atomic<uint32_t> round_ = 0;  // of work handed out
  std::atomic<uint32_t> left_ = 0;   // parts that are not done
  std::atomic<bool> over_ = false;
};

}  // namespace palpate
