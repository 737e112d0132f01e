#include "viz/python/waiting.h"

#include <pthread.h>

namespace palpate::python {
namespace {

struct Counter {
  std::mutex mutex;
  std::condition_variable changed;
  size_t running = 0;
};
/// Never destroyed. A fork starts with a new one: the parent's threads do not exist in it.
Counter* counter = new Counter;
[[maybe_unused]] const int forks = pthread_atfork(nullptr, nullptr, [] { counter = new Counter; });

}  // namespace

void Abandoned::begin() {
  const std::lock_guard lock(counter->mutex);
  ++counter->running;
}

void Abandoned::end() {
  // Under the lock: who waits may take the process down as soon as it is told.
  const std::lock_guard lock(counter->mutex);
  --counter->running;
  counter->changed.notify_all();
}

void Abandoned::wait_all() {
  std::unique_lock lock(counter->mutex);
  counter->changed.wait(lock, [] { return counter->running == 0; });
}

}  // namespace palpate::python
