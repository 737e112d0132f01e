// Part of a long sweep that runs: all of it only in a thorough run (`tests/run --thorough`), by default a
// part that still meets each kind of case.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <vector>

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

/// `all` in a thorough run, otherwise the first of them and every `step`-th after it.
template <typename T>
std::vector<T> part_of(std::vector<T> all, size_t step) {
  if (thorough()) return all;
  std::vector<T> some;
  for (size_t i = 0; i < all.size(); i += step) some.push_back(all[i]);
  return some;
}

}  // namespace palpate
