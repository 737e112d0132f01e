// Stops: how often a thread gives work to the device, and waits for it.
#pragma once

#include <cstdint>

namespace palpate::gpu {

/// Counted always: two additions.
struct Stops {
  uint64_t submits = 0;
  uint64_t waits = 0;  ///< for a fence, whether or not it was signalled already

  Stops operator-(const Stops& before) const { return {submits - before.submits, waits - before.waits}; }
};

/// Stops of the calling thread, since it began.
Stops stops();

}  // namespace palpate::gpu
