// The measured quantities, each once: name, unit, group, sentence, value with its error and state. Tables,
// lines of JSON, Python's attributes and their stubs, the panel and the README's table are made from these
// lists.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "engine/measure/measured_columns.h"
#include "palpate/touch.h"

namespace palpate {

/// Places of numbers that have no error of their own, see Digits.
inline constexpr int kGrayPlaces = 2, kForcePlaces = 4, kPixelPlaces = 2, kLengthPlaces = 4, kAnglePlaces = 4,
                     kTimePlaces = 6, kRatioPlaces = 6, kSumPlaces = 1, kAllPlaces = -1;

enum class QuantityKind : uint8_t {
  Flag,
  Whole,
  Number,
  Estimated,  ///< a number with its standard error and state
  Word,
};

/// A value of the quantity's kind, or none.
using QuantityValue = std::variant<std::monostate, bool, uint64_t, double, Estimate, std::string_view>;

/// A quantity's row of the panel. Quantities with one label share a row, where the last of them stands:
/// values in one unit joined by commas, of two units the last that is there.
struct PanelRow {
  const char* label = "";  ///< "": `why` says why it has none
  int places = 0;
  bool sign = false;          ///< with its sign
  const char* unit = "";      ///< "": the quantity's own
  double per_unit = 1;        ///< of these in one of the quantity's own
  bool only_if_some = false;  ///< no row of 0, no, none, valid or steady
};

inline constexpr int kByUnit = -2;

/// Defaults of most quantities.
template <typename Of>
struct QuantityDetails {
  const char* unit = nullptr;             ///< null: as the name ends
  int places = kByUnit;                   ///< of a number without an error
  bool (*in_table)(const Of&) = nullptr;  ///< whether its cell is filled, where there is a value; null: it is
  const char* state = nullptr;            ///< column of an estimate's state; null: none
  const char* error = nullptr;            ///< column of its error; null: error_name() makes it from the name
  uint32_t error_group = 0;               ///< 0: the quantity's
  bool every_state = false;               ///< an estimate's number is shown whatever its state
  const char* python = nullptr;           ///< attribute of a touch; null: python_name() makes it; "": none
  const char* python_also = nullptr;      ///< an older name of the attribute, which stays
  bool none = false;                      ///< Python: None where there is no number, not NaN
  PanelRow row = {};
  const char* why = "";  ///< why it has no column, no attribute or no row
};

/// One quantity of an `Of`: a frame's touch, one of its contacts, ...
template <typename Of>
struct MeasuredQuantity : QuantityDetails<Of> {
  const char* name;  ///< of its column: ends in the unit
  uint32_t group;    ///< of MeasuredColumns; 0: no column
  QuantityKind kind;
  const char* sentence;  ///< what it is, for the README and Python's help
  QuantityValue (*value)(const Of&);
};

/// A frame as its source numbers it.
struct FrameKey {
  uint64_t sequence = 0;
  int64_t time_ns = 0;
  std::string_view source = {};  ///< its file, where it has one of its own
};

// In the order of the columns.
std::span<const MeasuredQuantity<FrameKey>> frame_quantities();
std::span<const MeasuredQuantity<Touch>> touch_quantities();
/// The part of touch_quantities() that each contact has too.
std::span<const MeasuredQuantity<Touch>> shape_quantities();
/// The six components of the wrench: "wrench_fx_N", "fx_N" within a wrench.
std::span<const MeasuredQuantity<Touch>> wrench_quantities();
inline constexpr std::string_view kWrenchPrefix = "wrench_", kObjectPrefix = "object_";
std::span<const MeasuredQuantity<ContactTouch>> contact_quantities();

/// "force_sd_N" of "force_N", "stick_share_sd" of "stick_share".
std::string error_name(std::string_view name, std::string_view unit);
template <typename Of>
std::string error_name(const MeasuredQuantity<Of>& quantity) {
  return quantity.error ? quantity.error : error_name(quantity.name, quantity.unit);
}
/// The attribute of a touch, "wrench.fx_N" that of its wrench, "motion.track" of its object; "" where there
/// is none.
template <typename Of>
std::string python_name(const MeasuredQuantity<Of>& quantity) {
  if (quantity.python) return quantity.python;
  const std::string name = quantity.name;
  if (name.starts_with(kWrenchPrefix)) return "wrench." + name.substr(kWrenchPrefix.size());
  return name.starts_with(kObjectPrefix) ? "motion." + name.substr(kObjectPrefix.size()) : name;
}

/// "shear x, N" of "shear_x_N".
std::string words_of(std::string_view name, std::string_view unit);

/// True where an estimate has a number to show: calibrated, followed where that is needed, and something
/// touches.
bool has_value(const Estimate& estimate);
/// The estimate in a value, where it has a number to show.
template <typename Of>
const Estimate* shown_estimate(const MeasuredQuantity<Of>& quantity, const QuantityValue& value) {
  const Estimate* estimate = std::get_if<Estimate>(&value);
  return estimate && (quantity.every_state || has_value(*estimate)) ? estimate : nullptr;
}

}  // namespace palpate
