// Workgroups of kernels whose invocations lie in one row.
#pragma once

#include <array>
#include <cstdint>

#include "engine/base/divide_up.h"

namespace palpate {

inline constexpr uint32_t kWorkgroup = 64;

/// As many as hold so many invocations.
constexpr std::array<uint32_t, 3> workgroups(uint32_t invocations) {
  return {divide_up(invocations, kWorkgroup), 1, 1};
}

}  // namespace palpate
