// Part of a long sweep that runs: all of it only in a thorough run (`tests/run --thorough`), by default a
// part that still meets each kind of case.
#pragma once

#include <cstddef>
#include <cstdlib>

namespace palpate {

/// PALPATE_THOROUGH in the environment, neither empty nor 0.
inline bool thorough() {
  const char* set = std::getenv("PALPATE_THOROUGH");
  return set && *set && !(*set == '0' && !set[1]);
}

/// `all` in a thorough run, `some` otherwise.
template <typename T>
T of_sweep(T all, T some) {
  return thorough() ? all : some;
}

}  // namespace palpate
