// Random numbers of fuzz cases.
#pragma once

#include <cstdint>
#include <iterator>
#include <random>

namespace palpate::fuzz {

/// Numbers that are the same on every machine, unlike the standard's distributions.
class Dice {
 public:
  explicit Dice(uint64_t seed) : random_(seed) {}
  uint32_t below(uint32_t n) { return static_cast<uint32_t>(random_() % n); }
  uint32_t between(uint32_t low, uint32_t high) { return low + below(high - low + 1); }
  bool one_in(uint32_t n) { return below(n) == 0; }
  double unit() { return static_cast<double>(random_() >> 11) / 9007199254740992.0; }
  template <typename List>
  auto pick(const List& list) {
    return list[below(static_cast<uint32_t>(std::size(list)))];
  }

 private:
  std::mt19937_64 random_;
};

}  // namespace palpate::fuzz
