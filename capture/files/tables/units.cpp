#include "capture/files/tables/units.h"

#include <algorithm>
#include <numbers>
#include <span>

#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

struct Unit {
  std::string_view name;
  double factor;
  std::string_view means = {};  ///< of another spelling, or a mass that stands for its weight
};

constexpr double kPound_N = 4.4482216152605;
constexpr Unit kForce[] = {{"N", 1},
                           {"mN", 1e-3},
                           {"kN", 1e3},
                           {"gf", kGravity / 1000},
                           {"kgf", kGravity},
                           {"lbf", kPound_N},
                           {"g", kGravity / 1000, "gf"},
                           {"kg", kGravity, "kgf"},
                           {"lb", kPound_N, "lbf"},
                           {"lbs", kPound_N, "lbf"},
                           {"kp", kGravity, "kgf"},
                           {"newton", 1, "N"},
                           {"newtons", 1, "N"}};
constexpr Unit kTime[] = {{"s", 1},
                          {"ms", 1e-3},
                          {"us", 1e-6},
                          {"ns", 1e-9},
                          {"sec", 1, "s"},
                          {"seconds", 1, "s"},
                          {"\xc2\xb5s", 1e-6, "us"},
                          {"\xce\xbcs", 1e-6, "us"}};
constexpr Unit kAngle[] = {{"rad", 1},
                           {"deg", std::numbers::pi / 180},
                           {"degrees", std::numbers::pi / 180, "deg"},
                           {"\xc2\xb0", std::numbers::pi / 180, "deg"}};
constexpr Unit kLength[] = {{"mm", 1},
                            {"um", 1e-3},
                            {"nm", 1e-6},
                            {"cm", 10},
                            {"m", 1000},
                            {"in", 25.4},
                            {"\xc2\xb5m", 1e-3, "um"},
                            {"\xce\xbcm", 1e-3, "um"}};
constexpr Unit kArea[] = {{"mm2", 1}, {"um2", 1e-6}, {"cm2", 100}, {"m2", 1e6}};

std::span<const Unit> units_of(Quantity quantity) {
  switch (quantity) {
    case Quantity::Force_N:
      return kForce;
    case Quantity::Time_s:
      return kTime;
    case Quantity::Angle_rad:
      return kAngle;
    case Quantity::Length_mm:
      return kLength;
    case Quantity::Area_mm2:
      return kArea;
  }
  return {};
}

/// As it is spelled, else in other letters; a capital M that is no prefix of a thousandth is a million.
const Unit* unit_named(std::span<const Unit> units, const std::string& name) {
  for (const Unit& unit : units)
    if (unit.name == name) return &unit;
  for (const Unit& unit : units) {
    if (lower(std::string(unit.name)) != lower(name)) continue;
    const bool thousandth = unit.name.size() > 1 && unit.name.front() == 'm' && unit.name != "mm";
    if (!thousandth || name.front() == 'm' || lower(name) == "ms") return &unit;
  }
  return nullptr;
}

/// Empty for the program's own unit, and for the usual units of times and angles.
std::string note_of(const ColumnHeader& header, const Unit& unit, Quantity quantity) {
  const std::string_view own = units_of(quantity).front().name;
  const std::string_view canonical = unit.means.empty() ? unit.name : unit.means;
  const bool usual = quantity == Quantity::Time_s || quantity == Quantity::Angle_rad;
  if (header.unit == own || (usual && header.unit == canonical)) return {};
  std::string note = "column " + printable(header.text) + " is read in " + std::string(canonical);
  if (canonical != own) note += text(" (%.6g ", unit.factor) + std::string(own) + " each)";
  return note;
}

}  // namespace

std::optional<QuantityColumn> find_quantity(const CsvTable& table,
                                            std::initializer_list<std::string_view> names,
                                            Quantity quantity) {
  const std::span<const Unit> units = units_of(quantity);
  std::optional<ColumnHeader> strange;
  bool bare = false;
  std::string_view of;
  for (const std::string_view name : names)
    for (size_t i = 0; i < table.columns().size(); ++i) {
      const ColumnHeader header = column_header(table.columns()[i]);
      const bool has_none = lower(header.text) == name;
      if (header.name != name && !has_none) continue;
      const Unit* unit = has_none ? nullptr : unit_named(units, header.unit);
      if (unit) return QuantityColumn{i, unit->factor, note_of(header, *unit, quantity)};
      if (strange) continue;
      strange = header;
      bare = has_none;
      of = name;
    }
  if (!strange) return std::nullopt;
  std::string known;
  for (const Unit& unit : units)
    if (unit.means.empty()) known += (known.empty() ? "" : ", ") + std::string(unit.name);
  throw Error(Failure::Input,
              "a unit (" + known + ") in the header of column " + printable(strange->text) + " of " +
                  table.file().string(),
              bare || strange->unit.empty() ? "none" : printable(strange->unit),
              "naming it, such as " + std::string(of) + "_" + std::string(units.front().name));
}

std::string unread_columns(const CsvTable& table, const std::vector<size_t>& read) {
  std::string list;
  for (size_t i = 0; i < table.columns().size(); ++i)
    if (std::find(read.begin(), read.end(), i) == read.end() && !table.columns()[i].empty())
      list += (list.empty() ? "" : ", ") + printable(table.columns()[i]);
  return list.empty() ? list : "columns that are not read: " + list;
}

}  // namespace palpate
