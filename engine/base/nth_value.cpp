#include "engine/base/nth_value.h"

#include <algorithm>
#include <bit>
#include <cstdint>

namespace palpate {
namespace {

constexpr uint32_t kBits = 11, kBins = 1u << kBits;
constexpr uint32_t kBlock = 64;  // bins whose counts are added at once
constexpr size_t kFew = 64;      // sorted as they are

/// Bits in the order of the values; a branch on the sign would be guessed wrong every other time.
uint32_t ordered(float value) {
  const auto bits = std::bit_cast<int32_t>(value);
  return static_cast<uint32_t>(bits ^ ((bits >> 31) & 0x7FFFFFFF)) ^ 0x80000000u;
}

/// Keeps the values in the bin that the `n`-th is in, which is then its `n`-th.
std::span<float> bin_of_nth(std::span<float> values, uint32_t shift, size_t& n) {
  uint32_t counts[kBins] = {};
  const auto bin_of = [shift](float value) { return (ordered(value) >> shift) % kBins; };
  for (const float value : values) ++counts[bin_of(value)];
  uint32_t bin = 0;
  for (;; bin += kBlock) {
    uint32_t sum = 0;
    for (uint32_t i = 0; i < kBlock; ++i) sum += counts[bin + i];
    if (n < sum) break;
    n -= sum;
  }
  for (; n >= counts[bin]; ++bin) n -= counts[bin];
  size_t kept = 0;
  for (const float value : values) {
    values[kept] = value;
    kept += bin_of(value) == bin;
  }
  return values.first(kept);
}

}  // namespace

float nth_value(std::span<float> values, size_t n) {
  for (const uint32_t shift : {32 - kBits, 32 - 2 * kBits})
    if (values.size() > kFew) values = bin_of_nth(values, shift, n);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(n);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace palpate
