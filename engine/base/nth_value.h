// N-th value: selection without branches on the values, several times as fast as std::nth_element where they
// come in no order.
#pragma once

#include <cstddef>
#include <span>

namespace palpate {

/// The value that would stand at `n` if they were sorted, 0 <= n < their number. Values are finite, and
/// overwritten.
float nth_value(std::span<float> values, size_t n);

}  // namespace palpate
