// Zeroing in the window: the numbers shown are differences from a moment that the user chose. Recorded and
// written measurements stay as they were measured; the zero is written as an event.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "palpate/touch.h"

namespace palpate::viz {

struct Tare {
  bool on = false;
  Estimate force_N, shear_x_N, shear_y_N;  ///< at the moment of zeroing
  /// Tare of each contact that was there, where contacts are separated. One that comes later is shown as
  /// measured: before it came its force was none.
  struct OfContact {
    uint32_t id = 0;
    Estimate force_N, shear_x_N, shear_y_N;
  };
  std::vector<OfContact> contacts;

  /// False, and nothing changes, where there is no force to be zeroed: not calibrated, or nothing
  /// touches.
  bool set(const Touch& touch);
  /// For events.csv: "force_N=0.123 shear_x_N=..."; quantities that have no zero are left out. Of several
  /// contacts theirs follow: "contact_2_force_N=..."
  std::string words() const;
};

/// `measured` less `zero`, its variance the sum of both; as measured where one of them has no number.
Estimate tared(const Estimate& measured, const Estimate& zero);

/// The touch as it is shown: force and shear less the zero, those of each contact less its own.
Touch tared(const Touch& touch, const Tare& tare);

}  // namespace palpate::viz
