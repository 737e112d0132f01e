// Whether a picture's three colours are those of another picture in another order.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace palpate {

/// Every order of three channels; the first is as they are.
inline constexpr std::array<std::array<size_t, 3>, 6> kChannelOrders = {
    {{0, 1, 2}, {2, 1, 0}, {1, 0, 2}, {0, 2, 1}, {1, 2, 0}, {2, 0, 1}}};

/// By all places together, each with its brightness taken off: the colours of `now` follow those of
/// `untouched` in another order, and not in theirs. A touch that changes most places by more than their
/// colours differ does not hide that. Gray levels of 8 bits; three planes of places one after the other, as
/// many in both. False where `untouched` is gray (RMS colour below 1).
bool follows_another_order(std::span<const float> now, std::span<const float> untouched);

}  // namespace palpate
