// The n-th value: that of a sorted copy, of values of every kind.
#include "engine/base/nth_value.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace palpate {
namespace {

TEST(NthValue, IsThatOfASortedCopy) {
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, 1);
  const auto draw = [&](int kind) -> float {
    const float value = noise(random);
    if (kind == 0) return value;
    if (kind == 1) return std::round(value * 2);          // many alike, both zeros
    if (kind == 2) return std::abs(value) * 1e-3f + 100;  // all in one bin
    if (kind == 3) return std::ldexp(value, static_cast<int>(40 * value));
    return 7;
  };
  for (int kind = 0; kind < 5; ++kind)
    for (const size_t count : {1u, 2u, 64u, 65u, 66u, 500u, 4033u}) {
      std::vector<float> values(count);
      for (float& value : values) value = draw(kind);
      std::vector<float> sorted = values;
      std::ranges::sort(sorted);
      for (const size_t n : {size_t{0}, count / 4, count / 2, count - 1}) {
        std::vector<float> used = values;
        ASSERT_EQ(nth_value(used, n), sorted[n]) << kind << ", " << n << " of " << count;
      }
    }
}

}  // namespace
}  // namespace palpate
