#include "viz/panels/numbers/press.h"

#include <algorithm>

#include "engine/palpation/scan.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

/// "8.1 mm (7.6 to 8.7)": the interval is that of the heading.
std::string with_interval(const lump::Value& v, const char* unit) {
  return text("%.3g%s (%.3g to %.3g)", v.value, unit, v.low, v.high);
}

/// Age of a press; of another time line (a replay that jumped) its frame alone.
std::string age(const PressAnswer& last, double time_s) {
  const std::string from = text("press %llu, frame %llu", static_cast<unsigned long long>(last.press),
                                static_cast<unsigned long long>(last.last_frame));
  return last.time_s <= time_s ? from + ", " + time_text(time_s - last.time_s) + " ago" : from;
}

void add_numbers(const lump::Estimate& e, std::vector<PressRow>& rows) {
  const bool open = e.verdict == lump::Status::StiffnessOpen;
  rows.push_back({Meaning::Plain, "size", with_interval(e.size_mm, " mm")});
  rows.push_back({Meaning::Plain, "depth of top", with_interval(e.depth_mm, " mm")});
  rows.push_back({open ? Meaning::Doubtful : Meaning::Plain, "stiffness",
                  open ? text("open: %.3g to %.3g x", e.stiffness_ratio.low, e.stiffness_ratio.high)
                       : with_interval(e.stiffness_ratio, " x tissue")});
  const auto shape = static_cast<size_t>(e.shape);
  rows.push_back({Meaning::Plain, "shape",
                  std::string(shape_text(e.shape)) + text(", %.0f %%", 100 * e.shape_probability[shape])});
  rows.push_back({Meaning::Plain, "centre x", with_interval(e.x_mm, " mm")});
  rows.push_back({Meaning::Plain, "centre y", with_interval(e.y_mm, " mm")});
}

Meaning meaning_of(lump::Status verdict) {
  return verdict == lump::Status::Found || verdict == lump::Status::NoLump ? Meaning::Valid
                                                                           : Meaning::Doubtful;
}

}  // namespace

void add_estimate(const lump::Estimate& e, std::vector<PressRow>& rows) {
  const bool two = e.lumps.size() == 2;
  rows.push_back(
      {meaning_of(e.verdict), "", two ? "two lumps, each by itself" : lump::status_text(e.verdict)});
  if (two || reports_numbers(e.verdict))
    rows.push_back({Meaning::Explains, "", "90 % intervals in brackets"});
  if (reports_numbers(e.verdict)) add_numbers(e, rows);
  for (size_t i = 0; i < e.lumps.size(); ++i) {
    const lump::Estimate& each = e.lumps[i];
    rows.push_back({meaning_of(each.verdict), text("lump %zu", i + 1), lump::status_text(each.verdict)});
    if (reports_numbers(each.verdict)) add_numbers(each, rows);
    for (const std::string& reason : each.reasons) rows.push_back({Meaning::Explains, "", reason});
  }
  for (const std::string& reason : e.reasons) rows.push_back({Meaning::Explains, "", reason});
}

std::vector<PressRow> press_rows(const PressStatus& s, double time_s, bool by_hand) {
  std::vector<PressRow> rows;
  const std::array<double, 3>& size = s.block.block_mm;
  rows.push_back({Meaning::Explains, "tissue",
                  text("%g x %g x %g mm, %g Pa", size[0], size[1], size[2], s.block.young_Pa)});
  if (!s.trouble.empty()) rows.push_back({Meaning::Doubtful, "", s.trouble});
  if (s.pressing) {
    rows.push_back(
        {Meaning::Plain, "pressing", text("%.2f N, loads %u of %u", s.force_N, s.loads, s.wanted)});
    rows.push_back(s.tilt ? PressRow{Meaning::Plain, "tilt",
                                     text("%.1f, %.1f \xc2\xb1 %.1f\xc2\xb0", s.tilt->x_deg, s.tilt->y_deg,
                                          std::max(s.tilt->x_sd_deg, s.tilt->y_sd_deg))}
                          : PressRow{Meaning::Explains, "tilt", "cannot be told"});
  } else if (by_hand) {
    return rows;
  } else if (s.estimating) {
    rows.push_back({Meaning::Plain, "pressing", "over, being read"});
  } else if (s.trouble.empty() && !s.last) {
    rows.push_back(
        {Meaning::Explains, "", "press the block and take the sensor off: then the estimate comes"});
  }
  if (!s.last || by_hand) return rows;
  rows.push_back({Meaning::Explains, "", age(*s.last, time_s)});
  if (s.last->saturated_fraction > 0)
    rows.push_back(
        {Meaning::Doubtful, "saturated", text("%.2g %% of the window", 100 * s.last->saturated_fraction)});
  if (s.last->estimate)
    add_estimate(*s.last->estimate, rows);
  else
    rows.push_back({Meaning::Doubtful, "", s.last->trouble});
  return rows;
}

}  // namespace palpate::viz
