#include "engine/measure/quantities.h"

#include <algorithm>

namespace palpate {

std::string words_of(std::string_view name, std::string_view unit) {
  std::string words(name.substr(0, unit.empty() ? name.size() : name.rfind('_')));
  std::ranges::replace(words, '_', ' ');
  return unit.empty() ? words : words + ", " + std::string(unit);
}

std::string error_name(std::string_view name, std::string_view unit) {
  const size_t end = unit.empty() ? name.size() : name.rfind('_');
  return std::string(name.substr(0, end)) + "_sd" + std::string(name.substr(end));
}

bool has_value(const Estimate& estimate) {
  return estimate.validity != Validity::NotCalibrated && estimate.validity != Validity::NoContact &&
         estimate.validity != Validity::PictureDamaged && estimate.validity != Validity::NotFollowed &&
         estimate.validity != Validity::Undetermined;
}

}  // namespace palpate
