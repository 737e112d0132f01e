// The largest value of a recording, with what it is worth.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "palpate/touch.h"

namespace palpate {

/// Names of a quantity's largest value in tables, each behind "largest_" in summary.json, from its entry in
/// the list of quantities: "depth_mm", "depth_sd_mm" and "depth_state" of "depth_max_mm".
struct LargestNames {
  std::string value, error, state;
};
LargestNames largest_names(std::string_view quantity);

/// The force that stands for a touch: by its calibration, without one by the elastic layer.
const Estimate& force_of_touch(const Touch& touch);

/// Follows one quantity over the frames of a recording. A headline that names the largest value names its
/// state as well, since doubtful values are often the largest.
class Largest {
 public:
  /// Values without a meaning (not calibrated) are left out. One where nothing touches counts only as long as
  /// nothing ever did.
  void add(const Estimate& value);

  /// None: no frame had a value.
  const std::optional<Estimate>& any() const { return any_; }
  /// The largest of the valid ones, where the largest of all is not; none: no frame had such a value.
  std::optional<Estimate> valid() const;

 private:
  std::optional<Estimate> any_, valid_;
};

}  // namespace palpate
