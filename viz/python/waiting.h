// Work without the interpreter's lock, and waiting that Ctrl-C ends.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "capture/run/run_watch.h"

namespace palpate::python {

/// How long a wait goes on before it looks for Ctrl-C.
inline constexpr std::chrono::milliseconds kSlice{20};

/// Waits until `ready` and gives what `take` then does, both asked under `mutex` and without the
/// interpreter's lock: whoever held `mutex` and waited for the interpreter would never get it from a thread
/// that has it and waits for `mutex`. Throws what a signal's handler raises, such as KeyboardInterrupt, and
/// what `take` throws. Call with the interpreter's lock held and `mutex` not.
template <typename Ready, typename Take>
auto wait_for(std::mutex& mutex, std::condition_variable& changed, Ready ready, Take take) {
  while (true) {
    {
      const pybind11::gil_scoped_release release;
      std::unique_lock lock(mutex);  // ends before `release` does
      if (changed.wait_for(lock, kSlice, ready)) return take();
    }
    if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
  }
}

/// A run that ends when `stop` is true, and whose progress nobody follows.
inline RunWatch watch_of(const std::atomic<bool>& stop) {
  return {.stop = [&stop] { return stop.load(); }, .progress = {}};
}

/// Work that was given up by Ctrl-C and goes on until it notices.
class Abandoned {
 public:
  static void begin();
  static void end();
  /// Waits for all of it.
  static void wait_all();
};

/// Runs `work(stop)` on a thread of its own while this one waits. `work` owns all that it uses, and holds no
/// Python object. After Ctrl-C `stop` is true, and the work's end is not waited for.
template <typename Work>
auto run_apart(Work work) {
  using Value = std::invoke_result_t<Work&, const std::atomic<bool>&>;
  struct State {
    explicit State(Work w) : work(std::move(w)) {}
    std::mutex mutex;
    std::condition_variable changed;
    std::atomic<bool> stop = false;
    bool done = false;
    std::exception_ptr failure;
    std::optional<Value> value;
    std::optional<Work> work;
  };
  const auto state = std::make_shared<State>(std::move(work));
  Abandoned::begin();
  std::thread([state] {
    try {
      state->value = (*state->work)(state->stop);
    } catch (...) {
      state->failure = std::current_exception();
    }
    state->work.reset();
    {
      const std::lock_guard lock(state->mutex);
      state->done = true;
    }
    state->changed.notify_all();
    Abandoned::end();
  }).detach();
  try {
    wait_for(
        state->mutex, state->changed, [&] { return state->done; }, [] {});
  } catch (...) {
    state->stop = true;
    throw;
  }
  if (state->failure) std::rethrow_exception(state->failure);
  return std::move(*state->value);
}

}  // namespace palpate::python
