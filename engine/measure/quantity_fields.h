// Values of quantities that are fields: found by a path of members, with the kind that the field's type says.
#pragma once

#include <type_traits>
#include <utility>

#include "engine/measure/quantities.h"

namespace palpate {

namespace detail {
template <typename T>
QuantityValue value_of(const T& value) {
  if constexpr (requires { value.has_value(); }) {
    return value ? value_of(*value) : QuantityValue{};
  } else if constexpr (std::is_enum_v<T>) {
    return std::string_view(to_string(value));
  } else if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
    return uint64_t{value};
  } else {
    return value;
  }
}

template <typename T>
constexpr QuantityKind kind_of() {
  if constexpr (requires(T value) { value.has_value(); }) return kind_of<typename T::value_type>();
  if constexpr (std::is_enum_v<T>) return QuantityKind::Word;
  if constexpr (std::is_same_v<T, bool>) return QuantityKind::Flag;
  if constexpr (std::is_integral_v<T>) return QuantityKind::Whole;
  return std::is_same_v<T, Estimate> ? QuantityKind::Estimated : QuantityKind::Number;
}
template <typename T, auto Step, auto... More>
constexpr QuantityKind kind_at() {
  if constexpr (requires(T value) { value.has_value(); }) {
    return kind_at<typename T::value_type, Step, More...>();
  } else {
    using Next = std::remove_cvref_t<decltype(std::declval<T>().*Step)>;
    if constexpr (sizeof...(More) == 0) return kind_of<Next>();
    if constexpr (sizeof...(More) > 0) return kind_at<Next, More...>();
  }
}

template <auto Step, auto... More, typename T>
QuantityValue follow(const T& from) {
  const auto& next = from.*Step;
  if constexpr (sizeof...(More) == 0) {
    return value_of(next);
  } else if constexpr (requires { next.has_value(); }) {
    return next ? follow<More...>(*next) : QuantityValue{};
  } else {
    return follow<More...>(next);
  }
}
}  // namespace detail

/// The field that a path of members leads to, value_at<Touch, &Touch::skin, &SkinMotion::points>; nothing
/// where a part on the way is empty.
template <typename Of, auto... Path>
QuantityValue value_at(const Of& of) {
  return detail::follow<Path...>(of);
}

}  // namespace palpate
