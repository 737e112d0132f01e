#include "perf/lab/dataset/case_team.h"

#include <chrono>
#include <utility>

namespace palpate::lump {

CaseTeam::CaseTeam(uint32_t threads, const Sweep& sweep, Presser presser, std::function<bool()> stop)
    : sweep_(sweep), presser_(std::move(presser)), stop_(std::move(stop)) {
  for (uint32_t i = 0; i < threads; ++i) threads_.emplace_back([this] { serve(); });
}

CaseTeam::~CaseTeam() {
  {
    const std::lock_guard lock(guard_);
    over_ = true;
  }
  wanted_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void CaseTeam::give(uint32_t number) {
  {
    const std::lock_guard lock(guard_);
    numbers_.push_back(number);
  }
  wanted_.notify_one();
}

uint32_t CaseTeam::idle() const {
  const std::lock_guard lock(guard_);
  const size_t taken = busy_ + numbers_.size();
  return taken < threads_.size() ? static_cast<uint32_t>(threads_.size() - taken) : 0;
}

std::optional<CaseTeam::Done> CaseTeam::take(double most_s) {
  std::unique_lock lock(guard_);
  done_.wait_for(lock, std::chrono::duration<double>(most_s),
                 [this] { return !results_.empty() || failure_; });
  if (results_.empty()) {
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    return std::nullopt;
  }
  Done done = std::move(results_.front());
  results_.pop_front();
  return done;
}

void CaseTeam::serve() {
  std::unique_lock lock(guard_);
  while (true) {
    wanted_.wait(lock, [this] { return over_ || !numbers_.empty(); });
    if (over_) return;
    const uint32_t number = numbers_.front();
    numbers_.pop_front();
    ++busy_;
    lock.unlock();
    std::optional<Done> done;
    std::exception_ptr failure;
    try {
      const auto start = std::chrono::steady_clock::now();
      const auto sample =
          press_case(sweep_, number, presser_, [this] { return over_ || (stop_ && stop_()); });
      if (sample)
        done = Done{pack(sweep_, *sample),
                    std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    --busy_;
    if (done) results_.push_back(std::move(*done));
    if (failure && !failure_) failure_ = failure;
    done_.notify_one();
  }
}

}  // namespace palpate::lump
