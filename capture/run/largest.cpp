#include "capture/run/largest.h"

#include <cmath>

namespace palpate {

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
