#include "capture/run/largest.h"

#include <algorithm>
#include <cmath>

#include "engine/measure/quantities.h"

namespace palpate {

LargestNames largest_names(std::string_view quantity) {
  const auto all = touch_quantities();
  const auto found = std::ranges::find_if(all, [&](const auto& one) { return one.name == quantity; });
  std::string value = found->name;
  if (const size_t most = value.find("_max"); most != std::string::npos) value.erase(most, 4);
  return {value, error_name(*found), found->state};
}

const Estimate& force_of_touch(const Touch& touch) {
  const bool by_layer = touch.traction && touch.force_N.validity == Validity::NotCalibrated;
  return by_layer ? touch.traction->fz_N : touch.force_N;
}

void Largest::add(const Estimate& value) {
  if (value.validity == Validity::NotCalibrated || !std::isfinite(value.value)) return;
  const bool touches = value.validity != Validity::NoContact;
  const bool touched = any_ && any_->validity != Validity::NoContact;
  if (!any_ || (touches && !touched) || (touches == touched && value.value > any_->value)) any_ = value;
  if (value.validity == Validity::Valid && (!valid_ || value.value > valid_->value)) valid_ = value;
}

std::optional<Estimate> Largest::valid() const {
  return any_ && any_->validity == Validity::Valid ? std::nullopt : valid_;
}

}  // namespace palpate
