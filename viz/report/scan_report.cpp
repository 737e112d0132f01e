#include "viz/report/scan_report.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <utility>

#include "capture/files/estimate_report.h"
#include "capture/files/lump_maps.h"
#include "capture/files/npy.h"
#include "capture/files/output_file.h"
#include "engine/base/json.h"
#include "engine/base/text.h"
#include "engine/fem/scene_json.h"
#include "palpate/version.h"
#include "viz/report/html.h"
#include "viz/report/plot.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using Json = json::Value;
using Rows = std::vector<std::pair<std::string, std::string>>;

/// Observations of one bump; `fit`: of the profile through it, may be null.
Rows felt_rows(const lump::Outline& o, const lump::GaussianFit* fit) {
  Rows rows;
  if (!o.found) {
    rows.emplace_back("outline", o.reason);
    return rows;
  }
  rows.emplace_back("height above the block", interval_text(o.height_Pa, "Pa"));
  rows.emplace_back("centre x, as pressed", interval_text(o.x_mm, "mm"));
  rows.emplace_back("centre y, as pressed", interval_text(o.y_mm, "mm"));
  if (o.closed) {
    rows.emplace_back("area at half height", interval_text(o.area_mm2, "mm2"));
    rows.emplace_back("width at half height", interval_text(o.width_mm, "mm"));
  } else {
    rows.emplace_back("outline", o.reason);
  }
  if (fit && fit->found)
    rows.emplace_back("Gaussian of the profile",
                      palpate::text("a = %.4g +- %.2g Pa, s^2 = %.4g +- %.2g mm2", fit->amplitude, fit->sd[0],
                                    fit->width_mm * fit->width_mm, 2 * fit->width_mm * fit->sd[2]));
  return rows;
}
Rows felt_rows(const ScanAnswer& a) {
  Rows rows = felt_rows(a.outline, &a.fit);
  if (!a.second_outline) return rows;
  rows.emplace_back("a second bump", "");
  for (auto& row : felt_rows(*a.second_outline, nullptr)) rows.push_back(std::move(row));
  return rows;
}

/// Presses that see one of two bumps alone: a line each.
Rows press_rows(const ScanAnswer& a) {
  Rows rows;
  for (const ScannedPress& p : a.presses) {
    const lump::Estimate& e = p.estimate;
    std::string words = palpate::text("the bump at %.3g, %.3g mm: %s", p.bump_mm[0], p.bump_mm[1],
                                      lump::status_text(e.verdict));
    if (reports_numbers(e.verdict))
      words += "; size " + interval_text(e.size_mm, "mm") + ", depth " + interval_text(e.depth_mm, "mm") +
               palpate::text(", stiffness ratio %.3g to %.3g", e.stiffness_ratio.low, e.stiffness_ratio.high);
    rows.emplace_back(p.name, words);
  }
  return rows;
}

Json to_json(const lump::Outline& o) {
  Json value = {{"found", o.found}, {"closed", o.closed}, {"significance", o.significance}};
  if (!o.reason.empty()) value["reason"] = o.reason;
  if (o.found) {
    value["x_mm"] = interval_json(o.x_mm);
    value["y_mm"] = interval_json(o.y_mm);
    value["height_Pa"] = interval_json(o.height_Pa);
  }
  if (o.closed) {
    value["area_mm2"] = interval_json(o.area_mm2);
    value["width_mm"] = interval_json(o.width_mm);
    value["points_mm"] = o.points_mm;
  }
  return value;
}

Json to_json(const lump::Estimate& e) {
  Json v = {{"verdict", lump::status_text(e.verdict)},
            {"method", e.method},
            {"evidence", e.detection_statistic},
            {"false_alarm_rate", e.false_alarm_rate},
            {"reasons", e.reasons}};
  if (!e.bumps_mm.empty()) v["bumps_mm"] = e.bumps_mm;
  v["lumps"] = facts_of(e).json.at("lumps");
  if (e.separable_from_mm > 0) v["separable_from_mm"] = e.separable_from_mm;
  if (!reports_numbers(e.verdict)) return v;
  v["size_mm"] = interval_json(e.size_mm);
  v["depth_mm"] = interval_json(e.depth_mm);
  v["stiffness_ratio"] = interval_json(e.stiffness_ratio);
  v["x_mm"] = interval_json(e.x_mm);
  v["y_mm"] = interval_json(e.y_mm);
  v["shape"] = to_string(e.shape);
  v["shape_probability"] = e.shape_probability;
  return v;
}

Json to_json(const NextPress& n) {
  Json v = {{"at_mm", n.at_mm},
            {"window_mm", n.window_mm},
            {"force_N", n.force_N},
            {"shows_share", n.shows_fraction},
            {"reason", n.reason}};
  if (std::isfinite(n.narrower[0])) v["narrower"] = n.narrower;
  if (n.harder_N > 0) v["harder"] = {{"force_N", n.harder_N}, {"narrower", n.harder_narrower}};
  return v;
}

Rows map_rows(const lump::ScanMap& map) {
  Rows rows;
  std::string forces;
  for (const double force_N : map.observation.force_N)
    forces += (forces.empty() ? "" : ", ") + palpate::text("%.3g", force_N);
  const auto used =
      std::count_if(map.places.begin(), map.places.end(), [](const lump::PressPlace& p) { return p.used; });
  rows.emplace_back("presses", palpate::text("%ld of %zu used", static_cast<long>(used), map.places.size()));
  rows.emplace_back("forces on the block", forces + " N");
  rows.emplace_back("seen", palpate::text("%.1f %% of the block, its rim aside", 100 * map.seen_fraction));
  rows.emplace_back("noise of a value", palpate::text("%.3g Pa", map.observation.noise_Pa));
  rows.emplace_back("presses differ by", map.between_presses_Pa > 0
                                             ? palpate::text("%.3g Pa", map.between_presses_Pa)
                                             : std::string("not known: no overlap"));
  return rows;
}

Rows truth_rows(const fem::Scene& s) {
  if (!s.inclusion) return {{"lump", "none"}};
  Rows rows;
  std::vector<fem::Inclusion> lumps = {*s.inclusion};
  lumps.insert(lumps.end(), s.others.begin(), s.others.end());
  for (const fem::Inclusion& lump : lumps) {
    const auto size = lump.size();
    rows.emplace_back("shape", to_string(lump.shape));
    rows.emplace_back("size", palpate::text("%g x %g x %g mm", size[0], size[1], size[2]));
    rows.emplace_back("depth of its top", palpate::text("%g mm", lump.depth_mm));
    rows.emplace_back("stiffness over the tissue's", palpate::text("%g", lump.stiffness_ratio));
    rows.emplace_back("centre", palpate::text("%g, %g mm", lump.offset_mm[0], lump.offset_mm[1]));
  }
  return rows;
}

std::string hand_row(const HandRow& h) {
  if (!h.left_out.empty()) return "left out: " + h.left_out;
  const bool origin = std::max(h.at_sd_mm[0], h.at_sd_mm[1]) < 0.001;
  const std::string place =
      origin ? "where the map begins"
             : palpate::text("at %.2f +- %.2f, %.2f +- %.2f mm, turned %.1f +- %.1f", h.at_mm[0],
                             h.at_sd_mm[0], h.at_mm[1], h.at_sd_mm[1], h.turn_deg, h.turn_sd_deg);
  return place +
         palpate::text(", tilted %.1f, %.1f +- %.1f degrees", h.tilt.x_deg, h.tilt.y_deg, h.tilt.sd_deg);
}

Rows hand_rows(const ScanReport& r) {
  Rows rows;
  for (const HandRow& h : r.hand) rows.emplace_back(h.name, hand_row(h));
  return rows;
}

Json hand_json(const ScanReport& r) {
  Json all = Json::array();
  for (const HandRow& h : r.hand) {
    Json press = {{"name", h.name}, {"used", h.left_out.empty()}};
    if (h.left_out.empty())
      press.update({{"at_mm", h.at_mm},
                    {"at_sd_mm", h.at_sd_mm},
                    {"turn_deg", h.turn_deg},
                    {"turn_sd_deg", h.turn_sd_deg},
                    {"tilt_deg", {h.tilt.x_deg, h.tilt.y_deg}},
                    {"tilt_sd_deg", h.tilt.sd_deg}});
    else
      press["reason"] = h.left_out;
    all.push_back(press);
  }
  return all;
}

std::string hand_csv(const ScanReport& r) {
  std::string csv =
      "press,used,x_mm,x_sd_mm,y_mm,y_sd_mm,turn_deg,turn_sd_deg,tilt_x_deg,tilt_y_deg,tilt_sd_deg,reason\n";
  for (const HandRow& h : r.hand) {
    csv += "\"" + h.name + "\"," + (h.left_out.empty() ? "1" : "0");
    for (const double value : {h.at_mm[0], h.at_sd_mm[0], h.at_mm[1], h.at_sd_mm[1], h.turn_deg,
                               h.turn_sd_deg, h.tilt.x_deg, h.tilt.y_deg, h.tilt.sd_deg})
      csv += "," + (h.left_out.empty() ? plot_number(value) : std::string());
    csv += ",\"" + h.left_out + "\"\n";
  }
  return csv;
}

std::string table(const std::string& title, const Rows& rows) {
  std::string text = title + "\n";
  for (const auto& [name, value] : rows) text += palpate::text("  %-28s ", name.c_str()) + value + "\n";
  return text;
}

std::string places_csv(const lump::ScanMap& map) {
  std::string csv =
      "press,used,stage_x_mm,stage_y_mm,shift_x_mm,shift_x_sd_mm,shift_y_mm,shift_y_sd_mm,gain,gain_sd,"
      "misfit,"
      "reason\n";
  for (const lump::PressPlace& p : map.places) {
    csv += "\"" + p.name + "\"," + (p.used ? "1," : "0,") + plot_number(p.stage_mm[0]) + "," +
           plot_number(p.stage_mm[1]) + ",";
    if (p.used)
      csv += plot_number(p.shift_mm[0]) + "," + plot_number(p.shift_sd_mm[0]) + "," +
             plot_number(p.shift_mm[1]) + "," + plot_number(p.shift_sd_mm[1]) + "," + plot_number(p.gain) +
             "," + plot_number(p.gain_sd) + "," + plot_number(p.deviation) + ",\n";
    else
      csv += ",,,,,,,\"" + p.reason + "\"\n";
  }
  return csv;
}

double place(uint32_t i, uint32_t count, double pitch_mm) {
  return (i - (count - 1) / 2.0) * pitch_mm;
}

std::string map_csv(const lump::ScanMap& map) {
  std::string csv = "x_mm,y_mm,presses";
  for (const double force_N : map.observation.force_N)
    csv += palpate::text(",pressure_Pa_at_%.4g_N", force_N);
  csv += ",between_presses_Pa\n";
  const PressureMap& top = map.observation.pressure_Pa.back();
  const auto cell = [](float value) {
    return std::isfinite(value) ? plot_number(static_cast<double>(value)) : std::string();
  };
  for (uint32_t j = 0; j < top.height; ++j)
    for (uint32_t i = 0; i < top.width; ++i) {
      csv += plot_number(place(i, top.width, top.pitch_mm[0])) + "," +
             plot_number(place(j, top.height, top.pitch_mm[1])) + "," + cell(map.presses.at(i, j));
      for (const PressureMap& load : map.observation.pressure_Pa) csv += "," + cell(load.at(i, j));
      csv += "," + cell(map.disagreement_Pa.at(i, j)) + "\n";
    }
  return csv;
}

/// The map in a unit that suits its largest value.
std::pair<PlotMap, std::string> plot_map(const PressureMap& map) {
  double most = 0;
  for (const float value : map.values)
    if (std::isfinite(value)) most = std::max(most, static_cast<double>(value));
  const PlotUnit unit = plot_unit(most, "Pa");
  PlotMap plot{map.width, map.height, map.pitch_mm[0], map.pitch_mm[1]};
  plot.values = plot_scaled({map.values.begin(), map.values.end()}, unit.factor);
  return {plot, unit.name};
}

/// The answer in one sentence.
std::string headline(const ScanAnswer& a) {
  if (!a.estimate)
    return a.outline.found ? "A bump is felt; what lies behind it was not estimated." : "No bump is felt.";
  const lump::Estimate& e = *a.estimate;
  std::string words = lump::status_text(e.verdict);
  if (!words.empty()) words[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(words[0])));
  if (e.lumps.size() == 2) {
    words = palpate::text("Two lumps, %.2g mm apart", std::hypot(e.bumps_mm[0][0] - e.bumps_mm[1][0],
                                                                 e.bumps_mm[0][1] - e.bumps_mm[1][1]));
    for (const lump::Estimate& each : e.lumps)
      words += reports_numbers(each.verdict) ? palpate::text("; %.2g mm wide, its top %.2g mm deep",
                                                             each.size_mm.value, each.depth_mm.value)
                                             : std::string("; one without numbers");
    return words + ".";
  }
  if (!reports_numbers(e.verdict)) return words + ".";
  words += palpate::text(": %.2g mm wide, its top %.2g mm deep", e.size_mm.value, e.depth_mm.value);
  return words + palpate::text(std::isfinite(e.stiffness_ratio.value)
                                   ? ", %.2g to %.2g times as stiff as the tissue."
                                   : ", between %.2g and %.2g times as stiff as the tissue.",
                               e.stiffness_ratio.low, e.stiffness_ratio.high);
}

Plot map_plot(const ScanReport& r) {
  const ScanAnswer& a = r.answer;
  const auto [pressure, unit] = plot_map(a.map.observation.pressure_Pa.back());
  const auto [disagreement, spread_unit] = plot_map(a.map.disagreement_Pa);
  PlotPanel map{palpate::text("pressure at %.3g N on the block, %s (gray: not seen)",
                              a.map.observation.force_N.back(), unit.c_str()),
                "x, mm",
                "y, mm",
                "",
                {},
                pressure};
  map.key = "top left";
  const auto outline = [&map](const lump::Outline& found, const char* title) {
    if (!found.closed) return;
    PlotCurve& curve = map.add(title, {}, {}, kPlotRed);
    for (size_t i = 0; i <= found.points_mm.size(); ++i) {
      const auto& p = found.points_mm[i % found.points_mm.size()];
      curve.add(p[0], p[1]);
    }
  };
  outline(a.outline, "felt: half height");
  if (a.second_outline) outline(*a.second_outline, "");
  const char* estimated = "estimated size";
  for (const lump::Estimate& e : a.estimate ? lumps_of(*a.estimate) : std::vector<lump::Estimate>{}) {
    if (!reports_numbers(e.verdict)) continue;
    const auto [x, y] = plot_ellipse(e.x_mm.value, e.y_mm.value, e.size_mm.value, e.size_mm.value);
    map.add(std::exchange(estimated, ""), x, y, kPlotCyan).dashed = true;
  }
  if (r.truth && r.truth->inclusion) {
    std::vector<fem::Inclusion> lumps = {*r.truth->inclusion};
    lumps.insert(lumps.end(), r.truth->others.begin(), r.truth->others.end());
    for (const fem::Inclusion& lump : lumps) {
      const auto [x, y] = plot_ellipse(lump.offset_mm[0], lump.offset_mm[1], lump.size()[0], lump.size()[1]);
      map.add(&lump == &lumps.front() ? "true size" : "", x, y, kPlotWhite).dashed = true;
    }
  }
  PlotPanel spread{"spread between presses, " + spread_unit + " (crosses: windows)",
                   "x, mm",
                   "y, mm",
                   "",
                   {},
                   disagreement};
  PlotCurve& windows = spread.add("", {}, {}, kPlotWhite, PlotCurve::Style::Points);
  windows.mark = 1;
  windows.size = 1.2;
  for (const lump::PressPlace& p : a.map.places) {
    windows.add(p.stage_mm[0] + p.shift_mm[0], p.stage_mm[1] + p.shift_mm[1]);
  }
  if (a.next) {
    PlotCurve& next = map.add("next press", {}, {}, 5);
    next.dashed = true;
    for (const auto& [x, y] : corners_of(*a.next)) next.add(x, y);
    next.add(corners_of(*a.next)[0][0], corners_of(*a.next)[0][1]);
  }
  return {headline(a), {map, spread}, 2, 1120, 520};
}

Plot profile_plot(const ScanAnswer& a) {
  const std::vector<double>& x = a.profile.x_mm;
  double most_Pa = 0;  // of what was seen
  for (const double value : a.profile.value) most_Pa = std::max(most_Pa, value);
  const PlotUnit unit = plot_unit(most_Pa, "Pa");
  PlotPanel panel{palpate::text("through y = %.2f mm at %.3g N",
                                a.outline.found ? std::round(100 * a.outline.y_mm.value) / 100 + 0.0 : 0.0,
                                a.map.observation.force_N.back()),
                  "x, mm", "pressure, " + unit.name};
  panel.key = "outside top center horizontal";
  PlotCurve& points = panel.add("map, with its noise", x, plot_scaled(a.profile.value, unit.factor), 0,
                                PlotCurve::Style::Points);
  for (const double value : points.y) {
    points.low.push_back(value - unit.factor * a.map.observation.noise_Pa);
    points.high.push_back(value + unit.factor * a.map.observation.noise_Pa);
  }
  std::vector<double> curve;
  for (size_t i = 0; a.fit.found && i < x.size(); ++i) curve.push_back(a.block.value[i] + a.fit.at(x[i]));
  panel.add("smooth block", a.block.x_mm, plot_scaled(a.block.value, unit.factor), kPlotGray).dashed = true;
  if (a.fit.found)
    panel.add(palpate::text("with Gaussian, s^2 %.3g mm^2", a.fit.width_mm * a.fit.width_mm), x,
              plot_scaled(curve, unit.factor), 1);
  return {.panels = {panel}, .width_px = 640, .height_px = 420};
}

std::string html(const ScanReport& r, const fs::path& folder) {
  const ScanAnswer& a = r.answer;
  std::string body =
      "<h1>Scan of a tissue block</h1>\n<p class=\"notice\">" + std::string(kNotice) + "</p>\n";
  body += "<p class=\"answer\">" + html_escaped(headline(a)) + "</p>\n";
  body += "<div class=\"two\"><section><h2>What lies behind it</h2>\n" +
          (a.estimate ? html_rows(estimate_rows(*a.estimate))
                      : std::string("<p>Not estimated: no model was asked.</p>\n")) +
          "</section><section><h2>What is felt</h2>\n" + html_rows(felt_rows(a)) + "</section></div>\n";
  if (a.estimate) body += "<h2>The next press</h2>\n" + html_rows(next_press_rows(a.next, *a.estimate));
  if (!a.presses.empty()) body += "<h2>Presses that see one bump alone</h2>\n" + html_rows(press_rows(a));
  body += html_figure(folder / "map.svg") + "<div class=\"two\">" + html_figure(folder / "profile.svg") +
          "<section><h2>The map</h2>\n" + html_rows(map_rows(a.map));
  if (!r.hand.empty()) body += "<h2>Presses by hand</h2>\n" + html_rows(hand_rows(r));
  if (r.truth) body += "<h2>The synthetic block's truth</h2>\n" + html_rows(truth_rows(*r.truth));
  body += "</section></div>\n";
  if (!a.warnings.empty()) {
    body += "<h2>Warnings</h2>\n<ul class=\"warning\">\n";
    for (const std::string& warning : a.warnings) body += "<li>" + html_escaped(warning) + "</li>\n";
    body += "</ul>\n";
  }
  Rows inputs = r.inputs;
  inputs.emplace_back("program", "palpate " PALPATE_VERSION_TEXT);
  inputs.emplace_back("model", r.model.empty() ? "none" : r.model);
  inputs.emplace_back("made", r.made);
  body += "<h2>Inputs</h2>\n" + html_rows(inputs);
  body +=
      "<p class=\"small\">Intervals hold nine of ten truths where the model's assumptions hold: one lump or "
      "two, "
      "even tissue whose modulus and thickness are as stated within their errors, a plate without "
      "friction. " +
      std::string(kNotice) + "</p>\n";
  return html_page("Scan of a tissue block", body);
}

}  // namespace

std::string scan_text(const ScanReport& r) {
  const ScanAnswer& a = r.answer;
  std::string text =
      headline(a) + "\n" + table("map of the block", map_rows(a.map)) + table("felt", felt_rows(a));
  text += a.estimate ? table("estimate (" + r.model + ")", estimate_rows(*a.estimate))
                     : std::string("not estimated: no model was asked\n");
  if (a.estimate) text += table("next press", next_press_rows(a.next, *a.estimate));
  if (!a.presses.empty()) text += table("presses that see one bump alone", press_rows(a));
  if (!r.hand.empty()) text += table("presses by hand", hand_rows(r));
  if (r.truth) text += table("truth of the synthetic block", truth_rows(*r.truth));
  for (const std::string& warning : a.warnings) text += "warning: " + warning + "\n";
  return text + kNotice + "\n";
}

Json scan_json(const ScanReport& r) {
  const ScanAnswer& a = r.answer;
  Json value = {{"inputs", Json::object()},
                {"program_version", PALPATE_VERSION_TEXT},
                {"model", r.model},
                {"made", r.made}};
  for (const auto& [name, text] : r.inputs) value["inputs"][name] = text;
  const lump::Observation& observation = a.map.observation;
  value["map"] = {{"force_N", observation.force_N},
                  {"width", observation.pressure_Pa.back().width},
                  {"height", observation.pressure_Pa.back().height},
                  {"pitch_mm", observation.pressure_Pa.back().pitch_mm[0]},
                  {"seen_share", a.map.seen_fraction},
                  {"saturated_share", observation.saturated_fraction},
                  {"noise_Pa", observation.noise_Pa},
                  {"between_presses_Pa", a.map.between_presses_Pa},
                  {"presses", Json::array()}};
  for (const lump::PressPlace& p : a.map.places) {
    Json press = {{"name", p.name}, {"used", p.used}, {"stage_mm", p.stage_mm}};
    if (p.used)
      press.update({{"shift_mm", p.shift_mm},
                    {"shift_sd_mm", p.shift_sd_mm},
                    {"gain", p.gain},
                    {"gain_sd", p.gain_sd},
                    {"misfit", p.deviation}});
    else
      press["reason"] = p.reason;
    value["map"]["presses"].push_back(press);
  }
  value["outline"] = to_json(a.outline);
  if (a.second_outline) value["second_outline"] = to_json(*a.second_outline);
  value["estimate"] = nullptr;
  if (a.estimate) value["estimate"] = to_json(*a.estimate);
  value["next_press"] = nullptr;
  if (a.next) value["next_press"] = to_json(*a.next);
  for (const ScannedPress& p : a.presses) {
    Json press = {{"name", p.name}, {"bump_mm", p.bump_mm}};
    press["estimate"] = to_json(p.estimate);
    value["presses_of_one_bump"].push_back(press);
  }
  if (!r.hand.empty()) value["hand"] = hand_json(r);
  if (r.truth) value["truth"] = to_json(*r.truth);
  value["warnings"] = a.warnings;
  value["notice"] = kNotice;
  return value;
}

std::string write_scan(const ScanReport& r, const fs::path& folder) {
  make_output_folder(folder);
  const lump::ScanMap& map = r.answer.map;
  const PressureMap& top = map.observation.pressure_Pa.back();
  write_observation(folder, map.observation);
  write_npy(folder / "disagreement_Pa.npy", map.disagreement_Pa.values, {top.height, top.width});
  write_whole(folder / "map.csv", std::string_view(map_csv(map)));
  write_whole(folder / "presses.csv", std::string_view(places_csv(map)));
  fs::remove(folder / "hand.csv");
  if (!r.hand.empty()) write_whole(folder / "hand.csv", std::string_view(hand_csv(r)));
  const auto write_outline = [&folder](const lump::Outline& outline, const char* name) {
    std::string csv = "x_mm,y_mm\n";
    for (const auto& p : outline.points_mm) csv += plot_number(p[0]) + "," + plot_number(p[1]) + "\n";
    write_whole(folder / name, std::string_view(csv));
  };
  write_outline(r.answer.outline, "outline.csv");
  fs::remove(folder / "outline_2.csv");
  if (r.answer.second_outline) write_outline(*r.answer.second_outline, "outline_2.csv");
  write_whole(folder / "scan.json", std::string_view(scan_json(r).dump(2) + "\n"));
  std::string written =
      (folder / "report.html").string() + ", scan.json, map.csv, presses.csv, outline.csv, " +
      (r.answer.second_outline ? "outline_2.csv, " : "") + (r.hand.empty() ? "" : "hand.csv, ") +
      "observation.json, pressure_Pa.npy, disagreement_Pa.npy";
  for (const char* stem : {"map", "profile"})
    for (const char* ending : {".svg", ".png", ".pdf"}) fs::remove(folder / (std::string(stem) + ending));
  draw_plot(map_plot(r), folder / "map", written);
  draw_plot(profile_plot(r.answer), folder / "profile", written);
  write_whole(folder / "report.html", std::string_view(html(r, folder)));
  return written;
}

}  // namespace palpate
