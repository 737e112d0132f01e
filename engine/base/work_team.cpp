#include "engine/base/work_team.h"

#include <algorithm>

namespace palpate {
namespace {

/// Looks this often before it sleeps: rounds follow each other within microseconds.
constexpr int kLooks = 4000;

inline void breathe() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#endif
}

/// Returns once `value` is no longer `old`.
void wait_while(const std::atomic<uint32_t>& value, uint32_t old) {
  for (int i = 0; i < kLooks; ++i) {
    if (value.load(std::memory_order_acquire) != old) return;
    breathe();
  }
  value.wait(old, std::memory_order_acquire);
}

}  // namespace

WorkTeam::WorkTeam(uint32_t members) {
  if (members == 0) members = std::max(1u, std::thread::hardware_concurrency());
  for (uint32_t i = 1; i < members; ++i) threads_.emplace_back([this] { serve(); });
}

WorkTeam::~WorkTeam() {
  over_.store(true, std::memory_order_relaxed);
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void WorkTeam::run(const std::function<void(uint32_t)>& work) {
  if (threads_.empty()) return work(0);
  const uint32_t round = round_.load(std::memory_order_relaxed) + 1;
  work_ = &work;
  left_.store(members(), std::memory_order_relaxed);
  next_.store(uint64_t{round} << 32, std::memory_order_release);
  round_.store(round, std::memory_order_release);
  round_.notify_all();
  take_parts(round);
  for (uint32_t left = left_.load(std::memory_order_acquire); left != 0;
       left = left_.load(std::memory_order_acquire))
    wait_while(left_, left);
}

// While a part is taken its round does not end, so `work_` is the round's.
void WorkTeam::take_parts(uint32_t round) {
  for (uint64_t next = next_.load(std::memory_order_acquire);;) {
    const auto part = static_cast<uint32_t>(next);
    if (next >> 32 != round || part >= members()) return;
    if (!next_.compare_exchange_weak(next, next + 1, std::memory_order_acq_rel)) continue;
    (*work_)(part);
    if (left_.fetch_sub(1, std::memory_order_acq_rel) == 1) left_.notify_one();
    next = next_.load(std::memory_order_acquire);
  }
}

void WorkTeam::serve() {
  for (uint32_t seen = 0;;) {
    wait_while(round_, seen);
    seen = round_.load(std::memory_order_acquire);
    if (over_.load(std::memory_order_relaxed)) return;
    take_parts(seen);
  }
}

}  // namespace palpate
