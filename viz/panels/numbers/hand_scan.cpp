#include "viz/panels/numbers/hand_scan.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "viz/render/format.h"

namespace palpate::viz {
namespace {

constexpr double kHeld_mm = 1e-4;  // error of the press that all others are placed by

size_t placed(const HandAnswer& answer) {
  return static_cast<size_t>(
      std::ranges::count_if(answer.rows, [](const HandRow& r) { return r.left_out.empty(); }));
}

PressRow row_of(const HandRow& press) {
  if (!press.left_out.empty()) return {Meaning::Doubtful, press.name, "left out: " + press.left_out};
  if (press.at_sd_mm[0] < kHeld_mm)
    return {Meaning::Explains, press.name, "the map lies where it was aimed at"};
  return {Meaning::Plain, press.name,
          text("%.2f, %.2f \xc2\xb1 %.2f mm, %.1f \xc2\xb1 %.1f\xc2\xb0", press.at_mm[0], press.at_mm[1],
               std::max(press.at_sd_mm[0], press.at_sd_mm[1]), press.turn_deg, press.turn_sd_deg)};
}

/// Values in kPa, and what lies between a hundredth of them at each end.
std::shared_ptr<const SeenMap> map_of(const HandAnswer& answer) {
  const PressureMap& top = answer.scan.map.observation.pressure_Pa.back();
  auto map = std::make_shared<SeenMap>();
  map->width = top.width;
  map->height = top.height;
  map->pitch_mm = top.pitch_mm[0];
  map->left_mm = -0.5 * (top.width - 1) * map->pitch_mm;
  map->top_mm = -0.5 * (top.height - 1) * map->pitch_mm;
  std::vector<float> seen;
  for (const float value : top.values) {
    map->height_mm.push_back(value / 1000);
    if (std::isfinite(value)) seen.push_back(value / 1000);
  }
  if (!seen.empty()) {
    const auto [low, high] = std::ranges::minmax(seen);
    map->low_mm = double{low};
    map->high_mm = double{high};
  }
  for (const lump::PressPlace& p : answer.scan.map.places)
    if (p.used) map->way_mm.push_back({p.stage_mm[0] + p.shift_mm[0], p.stage_mm[1] + p.shift_mm[1]});
  return map;
}

std::vector<std::array<double, 2>> circle(const lump::Estimate& e) {
  constexpr int kSides = 48;
  std::vector<std::array<double, 2>> line;
  for (int k = 0; k < kSides; ++k) {
    const double angle = 2 * std::numbers::pi * k / kSides, radius_mm = e.size_mm.value / 2;
    line.push_back({e.x_mm.value + radius_mm * std::cos(angle), e.y_mm.value + radius_mm * std::sin(angle)});
  }
  return line;
}

}  // namespace

std::vector<PressRow> scan_rows(const ScanStatus& s) {
  std::vector<PressRow> rows;
  if (!s.on && !s.seen) return {{Meaning::Explains, "", "presses by hand are not put together (Shift+T)"}};
  const HandAnswer* const answer = s.seen && s.seen->answer ? &*s.seen->answer : nullptr;
  std::string count = text("%zu", s.presses);
  if (answer) count += text(", %zu of %zu with a place", placed(*answer), answer->rows.size());
  rows.push_back({Meaning::Plain, "by hand", count + (s.working ? ", at work" : "")});
  if (!s.on) rows.push_back({Meaning::Explains, "", "no more are taken (Shift+T)"});
  if (s.full) rows.push_back({Meaning::Doubtful, "", "no room for more presses: begin anew (Shift+O)"});
  if (!s.broken.empty()) rows.push_back({Meaning::Doubtful, "the last press", s.broken});
  if (s.seen && !s.seen->trouble.empty()) rows.push_back({Meaning::Doubtful, "", s.seen->trouble});
  if (s.presses == 0)
    rows.push_back({Meaning::Explains, "", "press here and there, each press over half of another"});
  if (!answer) return rows;
  if (const auto& estimate = answer->scan.estimate) {
    if (estimate->verdict == lump::Status::NoLump)
      rows.push_back({Meaning::Valid, "", "no lump seen so far"});
    else
      add_estimate(*estimate, rows);
  }
  if (const auto& next = answer->scan.next)
    rows.push_back(
        {Meaning::Explains, "press next", text("at %g, %g mm (blue)", next->at_mm[0], next->at_mm[1])});
  rows.reserve(rows.size() + answer->rows.size());
  std::transform(answer->rows.rbegin(), answer->rows.rend(), std::back_inserter(rows), row_of);
  return rows;
}

MapLook scan_look(const ScanStatus& s) {
  MapLook look;
  look.unit = "kPa";
  look.words = {"no map yet", "two presses that overlap by half are needed"};
  if (!s.seen || !s.seen->answer) return look;
  const HandAnswer& answer = *s.seen->answer;
  const lump::ScanMap& map = answer.scan.map;
  look.map = map_of(answer);
  look.words = {text("pressure at %.3g N", map.observation.force_N.back()),
                text("%zu of %zu presses", placed(answer), answer.rows.size()),
                text("%.0f %% of the block seen", 100 * map.seen_fraction)};
  if (const auto& estimate = answer.scan.estimate) {
    if (reports_numbers(estimate->verdict)) look.outlines_mm.push_back(circle(*estimate));
    for (const lump::Estimate& each : estimate->lumps)
      if (reports_numbers(each.verdict)) look.outlines_mm.push_back(circle(each));
  }
  if (answer.scan.next) {
    const auto corners = corners_of(*answer.scan.next);
    look.next_mm.assign(corners.begin(), corners.end());
  }
  return look;
}

}  // namespace palpate::viz
