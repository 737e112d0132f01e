// Division of whole numbers, rounded up.
#pragma once

#include <concepts>
#include <type_traits>

namespace palpate {

/// How many parts of size `by` (> 0) hold `value`.
template <std::unsigned_integral T>
constexpr T divide_up(T value, std::type_identity_t<T> by) {
  return (value + by - 1) / by;
}

}  // namespace palpate
