// Words of a measured quantity's value in the panel, as its row in the list has it.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "engine/base/text.h"
#include "engine/measure/quantities.h"

namespace palpate::viz {

/// Behind a number, with a blank; "" where there is none.
template <typename Of>
std::string unit_text(const MeasuredQuantity<Of>& q) {
  const std::string unit = *q.row.unit ? q.row.unit : q.unit;
  if (unit.empty()) return "";
  if (unit == "mm2") return " mm\xc2\xb2";
  if (unit == "mm3") return " mm\xc2\xb3";
  return " " + unit;
}

/// Without its unit; "-" where there is none.
template <typename Of>
std::string number_text(const MeasuredQuantity<Of>& q, const QuantityValue& value, bool with_error) {
  if (const auto* word = std::get_if<std::string_view>(&value)) return std::string(*word);
  if (const auto* count = std::get_if<uint64_t>(&value))
    return text("%llu", static_cast<unsigned long long>(*count));
  if (const bool* flag = std::get_if<bool>(&value)) return *flag ? "yes" : "no";
  const Estimate* estimate = shown_estimate(q, value);
  const double* plain = std::get_if<double>(&value);
  if (!estimate && !(plain && std::isfinite(*plain))) return "-";
  const double number = q.row.per_unit * (estimate ? estimate->value : *plain);
  std::string shown = text(q.row.sign ? "%+.*f" : "%.*f", q.row.places, number);
  if (estimate && with_error)
    shown += text(" \xc2\xb1 %.*f", q.row.places, q.row.per_unit * estimate->standard_error);
  return shown;
}

}  // namespace palpate::viz
