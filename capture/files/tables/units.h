// Columns of tables that hold a quantity: found by name, with their unit in the header, and turned into the
// program's unit.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/files/tables/csv_table.h"

namespace palpate {

inline constexpr double kGravity = 9.80665;  ///< m/s^2, standard

/// Quantity of a column, in the unit that its values are converted into.
enum class Quantity : uint8_t {
  Force_N,    ///< also mN, kN, gf, kgf, lbf, and g, kg, lb of a scale
  Time_s,     ///< also ms, us, ns
  Angle_rad,  ///< also deg
  Length_mm,  ///< also um, nm, cm, m, in
  Area_mm2,   ///< also um2, cm2, m2
};

struct QuantityColumn {
  size_t index = 0;
  double factor = 1;  ///< from the column's unit
  std::string note;   ///< "column 'force_kg' is read as kilograms-force ..."; empty: the program's own unit
};

/// The first column of a known unit that has one of these names (in small letters), the earlier names first:
/// "force_N", "Force [N]" and "force (N)" are force. Where a unit is written in other letters ("KN") it is
/// understood unless that could be another unit ("MN" is not mN). None where the table has no such column.
/// Throws Error(Failure::Input) where the only ones have no unit or an unknown one.
std::optional<QuantityColumn> find_quantity(const CsvTable& table,
                                            std::initializer_list<std::string_view> names, Quantity quantity);

/// "columns that are not read: 'a', 'b'", of those that are not in `read`; empty where all are.
std::string unread_columns(const CsvTable& table, const std::vector<size_t>& read);

}  // namespace palpate
