#include "capture/files/tables/gauge.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "capture/files/tables/csv_table.h"
#include "capture/files/tables/units.h"
#include "engine/base/text.h"
#include "engine/calibrate/time_series.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kNegative = 2;  // times the largest force above 0

std::string gauge_number(double value) {
  return palpate::text("%.6g", value);
}

class GaugeTable {
 public:
  GaugeTable(const std::filesystem::path& file, GaugeColumns wanted)
      : file_(file.string()),
        table_(file, "a gauge's table with the columns time_s and force_N", {.width = CsvWidth::Shorter}),
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

  std::optional<QuantityColumn> column(std::initializer_list<std::string_view> names, Quantity quantity) {
    std::optional<QuantityColumn> found = find_quantity(table_, names, quantity);
    if (found && !found->note.empty()) gauge_.notes.push_back(found->note + " in " + file_);
    return found;
  }

  void find_columns() {
    const std::string& line = table_.header_line();
    time_ = column({"time", "t"}, Quantity::Time_s);
    if (!time_)
      for (size_t i = 0; i < table_.columns().size(); ++i)
        if (lower(table_.columns()[i]) == "frame") frame_ = QuantityColumn{i, 1, {}};
    if (!time_ && !frame_)
      fail("a column time_s (or _ms, _us, _ns) or frame in " + file_, "the header " + printable(line),
           "naming the columns in the first line");
    force_ = column({"force", "fz", "normal_force", "force_z", "load", "weight", "mass"}, Quantity::Force_N);
    if (!force_ && wanted_ != GaugeColumns::Tangential)
      fail("a column force_N (or _mN, _kN, _gf, _kgf, _lbf) in " + file_, "the header " + printable(line),
           "naming the column of the normal force so");
    if (wanted_ == GaugeColumns::Normal) return;
    fx_ = column({"fx"}, Quantity::Force_N);
    fy_ = column({"fy"}, Quantity::Force_N);
    if (!fx_ && !fy_) {
      shear_ = column({"shear"}, Quantity::Force_N);
      direction_ = column({"direction"}, Quantity::Angle_rad);
    } else if (!fx_ || !fy_) {
      gauge_.notes.push_back(std::string("no column ") + (fx_ ? "fy_N" : "fx_N") + " in " + file_ +
                             ": its force is taken as 0");
    }
    if ((shear_ && direction_) || fx_ || fy_) return;
    fail("tangential forces in " + file_ + ": columns fx_N and fy_N, or shear_N and direction_deg",
         "the header " + printable(line), "a gauge that measures along the pad");
  }

  double number(const std::optional<QuantityColumn>& column) const {
    return table_.number(column->index) * column->factor;
  }

  void add() {
    const std::string where = table_.where();
    if (time_) {
      const double time_s = number(time_);
      if (!gauge_.time_s.empty() && !(time_s > gauge_.time_s.back()))
        fail("times that rise",
             gauge_number(time_s) + " s after " + gauge_number(gauge_.time_s.back()) + " s in " + where,
             table_.seems_cut()
                 ? "decimal points, or semicolons between the cells: commas may have cut numbers"
                 : "one recording a file, in order");
      gauge_.time_s.push_back(time_s);
    } else {
      const double frame = number(frame_);
      if (frame < 0 || frame > 1e12 || frame != std::floor(frame))
        fail("whole frame numbers from 0", gauge_number(frame) + " in " + where,
             "the recording's own numbers");
      const auto whole = static_cast<uint64_t>(frame);
      if (!gauge_.frames.empty() && whole <= gauge_.frames.back())
        fail("frames that rise",
             gauge_number(frame) + " after " + std::to_string(gauge_.frames.back()) + " in " + where,
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
    const double longest_s = longest_step(gauge_.time_s);
    for (size_t i = 1; i < gauge_.time_s.size(); ++i)
      if (gauge_.time_s[i] - gauge_.time_s[i - 1] > longest_s)
        gauge_.gaps.push_back({gauge_.time_s[i - 1], gauge_.time_s[i]});
  }

  std::string file_;
  CsvTable table_;
  GaugeColumns wanted_;
  std::optional<QuantityColumn> time_, frame_, force_, fx_, fy_, shear_, direction_;
  Gauge gauge_;
};

}  // namespace

Gauge read_gauge(const std::filesystem::path& file, GaugeColumns wanted) {
  return GaugeTable(file, wanted).read();
}

bool Gauge::reads_negative() const {
  if (force_N.empty()) return false;
  const auto [low, high] = std::minmax_element(force_N.begin(), force_N.end());
  return *low < 0 && -*low > kNegative * *high;
}

void Gauge::turn() {
  const double low = *std::min_element(force_N.begin(), force_N.end());
  for (double& force : force_N) force = -force;
  notes.push_back(file + text(" reads down to %.4g N: its sign is turned, so that a press is positive", low));
}

std::string take_off_zero(std::vector<double>& readings, const std::vector<bool>& touched,
                          const std::string& what, Pressed pressed, double range_N) {
  const std::optional<GaugeZero> zero = find_gauge_zero(readings, touched, pressed, range_N);
  if (!zero) return what + ": no frames without a touch, so that its zero is not known";
  const std::string value = text("%+.4g +- %.2g N", zero->offset, zero->sd);
  if (!zero->steady())
    throw Error(
        Failure::Input, "a gauge that reads the same whenever nothing touches",
        what + ", which reads " + value + text(" there and differs by %.3g N between presses", zero->spread),
        "a gauge that was left to settle and tared, or the table of this recording");
  if (!zero->differs()) return {};
  for (double& reading : readings) reading -= zero->offset;
  return what + " reads " + value + " where nothing touches (" + std::to_string(zero->readings) +
         " frames): taken off";
}

std::optional<double> gauge_at(const Gauge& gauge, const std::vector<double>& column, double time_s) {
  const std::vector<double>& t = gauge.time_s;
  if (t.empty() || column.size() != t.size() || !(time_s >= t.front() && time_s <= t.back()))
    return std::nullopt;
  for (const GaugeGap& gap : gauge.gaps)
    if (time_s > gap.from_s && time_s < gap.to_s) return std::nullopt;
  return place_in(t, time_s).of(column);
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
         gauge_number(all_s) + " s in all, the longest from " + gauge_number(longest.from_s) + " s to " +
         gauge_number(longest.to_s) + " s";
}

}  // namespace palpate
