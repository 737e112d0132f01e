#include "capture/files/gauge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include "capture/files/csv_table.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

struct Unit {
  std::string_view name;
  double factor;
};
constexpr std::array kTimeUnits{Unit{"s", 1}, Unit{"ms", 1e-3}, Unit{"us", 1e-6}, Unit{"ns", 1e-9}};
constexpr double kGravity = 9.80665;  // m/s^2, standard
constexpr std::array kForceUnits{Unit{"N", 1},          Unit{"mN", 1e-3},
                                 Unit{"kN", 1e3},       Unit{"gf", kGravity / 1000},
                                 Unit{"kgf", kGravity}, Unit{"lbf", 4.4482216152605}};
constexpr std::array kAngleUnits{Unit{"rad", 1}, Unit{"deg", std::numbers::pi / 180}};

constexpr double kGap_intervals = 5;
constexpr double kGap_s = 0.02;

std::string lower(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

std::string number_text(double value) {
  const std::string line = palpate::text("%.6g", value);
  return line;
}

/// A column that is read: where it stands and what turns it into SI.
struct Column {
  int index = -1;
  double factor = 1;
  explicit operator bool() const { return index >= 0; }
};

class GaugeTable {
 public:
  GaugeTable(const std::filesystem::path& file, GaugeColumns wanted)
      : file_(file.string()),
        table_(file, "a gauge's table with the columns time_s and force_N", {.ragged = true}),
        wanted_(wanted) {}

  Gauge read() {
    find_columns();
    while (table_.next()) add();
    if (gauge_.size() < 3)
      fail("at least 3 readings in " + file_, std::to_string(gauge_.size()),
           "a longer recording of the gauge");
    gauge_.file = file_;
    find_gaps();
    return std::move(gauge_);
  }

 private:
  [[noreturn]] static void fail(const std::string& wanted, const std::string& found,
                                const std::string& remedy) {
    throw Error(Failure::Input, wanted, found, remedy);
  }

  template <size_t N>
  Column column(const std::vector<ColumnHeader>& headers, std::initializer_list<std::string_view> names,
                const std::array<Unit, N>& units) const {
    for (const std::string_view name : names) {
      for (size_t i = 0; i < headers.size(); ++i) {
        const ColumnHeader& h = headers[i];
        const bool bare = lower(h.text) == name;
        if (h.name != name && !bare) continue;
        std::string known;
        for (const Unit& unit : units) {
          if (!bare && h.unit == unit.name) return {static_cast<int>(i), unit.factor};
          known += (known.empty() ? "" : ", ") + std::string(unit.name);
        }
        fail("a unit (" + known + ") in the header of column " + printable(h.text) + " of " + file_,
             bare || h.unit.empty() ? "none" : printable(h.unit),
             "naming it, such as " + std::string(name) + "_" + std::string(units[0].name));
      }
    }
    return {};
  }

  void find_columns() {
    const std::string& line = table_.header_line();
    std::vector<ColumnHeader> headers;
    for (const std::string& cell : table_.columns()) headers.push_back(column_header(cell));
    time_ = column(headers, {"time", "t"}, kTimeUnits);
    if (!time_)
      for (size_t i = 0; i < headers.size(); ++i)
        if (lower(headers[i].text) == "frame") frame_ = {static_cast<int>(i), 1};
    if (!time_ && !frame_)
      fail("a column time_s (or _ms, _us, _ns) or frame in " + file_, "the header " + printable(line),
           "naming the columns in the first line");
    if (wanted_ != GaugeColumns::Tangential) {
      force_ = column(headers, {"force", "fz", "normal_force", "load"}, kForceUnits);
      if (!force_)
        fail("a column force_N (or _mN, _kN, _gf, _kgf, _lbf) in " + file_, "the header " + printable(line),
             "naming the column of the normal force so");
    } else {
      force_ = column(headers, {"force", "fz", "normal_force", "load"}, kForceUnits);
    }
    if (wanted_ == GaugeColumns::Normal) return;
    fx_ = column(headers, {"fx"}, kForceUnits);
    fy_ = column(headers, {"fy"}, kForceUnits);
    if (!fx_ && !fy_) {
      shear_ = column(headers, {"shear"}, kForceUnits);
      direction_ = column(headers, {"direction"}, kAngleUnits);
    }
    if ((shear_ && direction_) || fx_ || fy_) return;
    fail("tangential forces in " + file_ + ": columns fx_N and fy_N, or shear_N and direction_deg",
         "the header " + printable(line), "a gauge that measures along the pad");
  }

  double number(const Column& column) const {
    return table_.number(static_cast<size_t>(column.index)) * column.factor;
  }

  void add() {
    const std::string where = table_.where();
    if (time_) {
      const double time_s = number(time_);
      if (!gauge_.time_s.empty() && !(time_s > gauge_.time_s.back()))
        fail("times that rise",
             number_text(time_s) + " s after " + number_text(gauge_.time_s.back()) + " s in " + where,
             "one recording a file, in order");
      gauge_.time_s.push_back(time_s);
    } else {
      const double frame = number(frame_);
      if (frame < 0 || frame > 1e12 || frame != std::floor(frame))
        fail("whole frame numbers from 0", number_text(frame) + " in " + where,
             "the recording's own numbers");
      const auto whole = static_cast<uint64_t>(frame);
      if (!gauge_.frames.empty() && whole <= gauge_.frames.back())
        fail("frames that rise",
             number_text(frame) + " after " + std::to_string(gauge_.frames.back()) + " in " + where,
             "one recording a file, in order");
      gauge_.frames.push_back(whole);
    }
    if (force_) gauge_.force_N.push_back(number(force_));
    if (shear_) {
      const double size = number(shear_), angle = number(direction_);
      gauge_.fx_N.push_back(size * std::cos(angle));
      gauge_.fy_N.push_back(size * std::sin(angle));
    } else if (fx_ || fy_) {
      gauge_.fx_N.push_back(fx_ ? number(fx_) : 0);
      gauge_.fy_N.push_back(fy_ ? number(fy_) : 0);
    }
  }

  void find_gaps() {
    if (gauge_.by_frame()) return;
    std::vector<double> steps;
    for (size_t i = 1; i < gauge_.time_s.size(); ++i)
      steps.push_back(gauge_.time_s[i] - gauge_.time_s[i - 1]);
    std::nth_element(steps.begin(), steps.begin() + static_cast<ptrdiff_t>(steps.size() / 2), steps.end());
    const double longest_s = std::max(kGap_intervals * steps[steps.size() / 2], kGap_s);
    for (size_t i = 1; i < gauge_.time_s.size(); ++i)
      if (gauge_.time_s[i] - gauge_.time_s[i - 1] > longest_s)
        gauge_.gaps.push_back({gauge_.time_s[i - 1], gauge_.time_s[i]});
  }

  std::string file_;
  CsvTable table_;
  GaugeColumns wanted_;
  Column time_, frame_, force_, fx_, fy_, shear_, direction_;
  Gauge gauge_;
};

}  // namespace

Gauge read_gauge(const std::filesystem::path& file, GaugeColumns wanted) {
  return GaugeTable(file, wanted).read();
}

std::optional<double> gauge_at(const Gauge& gauge, const std::vector<double>& column, double time_s) {
  const std::vector<double>& t = gauge.time_s;
  if (t.empty() || column.size() != t.size() || !(time_s >= t.front() && time_s <= t.back()))
    return std::nullopt;
  for (const GaugeGap& gap : gauge.gaps)
    if (time_s > gap.from_s && time_s < gap.to_s) return std::nullopt;
  const auto after = std::lower_bound(t.begin(), t.end(), time_s);
  const auto i = static_cast<size_t>(after - t.begin());
  if (t[i] == time_s) return column[i];
  const double fraction = (time_s - t[i - 1]) / (t[i] - t[i - 1]);
  return column[i - 1] + fraction * (column[i] - column[i - 1]);
}

std::optional<double> gauge_at_frame(const Gauge& gauge, const std::vector<double>& column, uint64_t frame) {
  const auto at = std::lower_bound(gauge.frames.begin(), gauge.frames.end(), frame);
  if (at == gauge.frames.end() || *at != frame || column.empty()) return std::nullopt;
  return column[static_cast<size_t>(at - gauge.frames.begin())];
}

std::string describe_gaps(const Gauge& gauge) {
  if (gauge.gaps.empty()) return {};
  double all_s = 0;
  GaugeGap longest;
  for (const GaugeGap& gap : gauge.gaps) {
    all_s += gap.to_s - gap.from_s;
    if (gap.to_s - gap.from_s > longest.to_s - longest.from_s) longest = gap;
  }
  const size_t n = gauge.gaps.size();
  return std::to_string(n) + (n == 1 ? " gap" : " gaps") + " without readings in " + gauge.file + ", " +
         number_text(all_s) + " s in all, the longest from " + number_text(longest.from_s) + " s to " +
         number_text(longest.to_s) + " s";
}

}  // namespace palpate
