// Stop: long work that ends soon after it is asked to.
#pragma once

#include <functional>

namespace palpate {

/// Asked now and then by long work, many times a second; true: it ends. Null: it goes on to its end.
using StopAsked = std::function<bool()>;

/// Thrown in place of an answer by work that was stopped; no error, as its caller asked for it.
struct Stopped {};

inline void check_stop(const StopAsked& stop) {
  if (stop && stop()) throw Stopped();
}

}  // namespace palpate
