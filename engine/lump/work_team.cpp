#include "engine/lump/work_team.h"

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
  for (uint32_t part = 1; part < members; ++part) threads_.emplace_back([this, part] { serve(part); });
}

WorkTeam::~WorkTeam() {
  over_.store(true, std::memory_order_relaxed);
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void WorkTeam::run(const std::function<void(uint32_t)>& work) {
  if (threads_.empty()) return work(0);
  work_ = &work;
  at_work_.store(static_cast<uint32_t>(threads_.size()), std::memory_order_relaxed);
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  work(0);
  for (uint32_t left = at_work_.load(std::memory_order_acquire); left != 0;
       left = at_work_.load(std::memory_order_acquire))
    wait_while(at_work_, left);
}

void WorkTeam::serve(uint32_t part) {
  for (uint32_t seen = 0;;) {
    wait_while(round_, seen);
    seen = round_.load(std::memory_order_acquire);
    if (over_.load(std::memory_order_relaxed)) return;
    (*work_)(part);
    if (at_work_.fetch_sub(1, std::memory_order_acq_rel) == 1) at_work_.notify_one();
  }
}

}  // namespace palpate
