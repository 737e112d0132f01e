// Trail: where the object that touches the pad has gone since its track began (Output::Motion).
#pragma once

#include <array>
#include <cstdint>
#include <deque>

#include "palpate/touch.h"

namespace palpate::viz {

class Trail {
 public:
  static constexpr size_t kMost = 2000;  ///< places; the oldest go first

  /// Once a result, in order.
  void add(const Touch& touch);
  void clear() { *this = {}; }

  /// Places of the object's point that was in the contact's middle at first, from the picture's middle: x to
  /// the right, y down, mm. The last is where it is now; none without a track.
  const std::deque<std::array<double, 2>>& places_mm() const { return places_; }
  /// Directions of the object's own x, y and z axes now, their x and y; known is false where its turns are
  /// not determined.
  const std::array<std::array<double, 2>, 3>& axes() const { return axes_; }
  bool turns_known() const { return turns_known_; }

 private:
  uint32_t track_ = 0;
  std::array<double, 3> first_mm_{};
  std::deque<std::array<double, 2>> places_;
  std::array<std::array<double, 2>, 3> axes_{};
  bool turns_known_ = false;
};

}  // namespace palpate::viz
