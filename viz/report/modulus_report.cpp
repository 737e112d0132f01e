#include "viz/report/modulus_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "engine/base/json.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Json = json::Value;

/// kPa with four digits, an empty cell where there is none.
std::string kilo(double value_MPa) {
  return value_MPa > 0 && std::isfinite(value_MPa) ? palpate::text("%.4g", 1e3 * value_MPa) : "";
}

std::string interval(const ModulusEstimate& e) {
  if (e.state == ModulusState::PadLimited) return "above " + kilo(e.low_MPa);
  if (!e.has_bounds() || !std::isfinite(e.high_MPa)) return "-";
  return kilo(e.low_MPa) + " to " + kilo(e.high_MPa);
}

Json low(const ModulusEstimate& e) {
  return e.has_bounds() ? Json(e.low_MPa) : Json(nullptr);
}

Json high(const ModulusEstimate& e) {
  return e.has_bounds() ? Json(e.high_MPa) : Json(nullptr);
}

std::string sample_words(const Sample& s) {
  return s.flat() ? palpate::text("%s %g mm, %g mm high", to_string(s.shape), s.size_mm, s.height_mm)
                  : palpate::text("%s of %g mm diameter", to_string(s.shape), s.size_mm);
}

/// The answer in one sentence.
std::string headline(const ModulusReport& r) {
  const ModulusEstimate& best = r.answer.best();
  if (best.state == ModulusState::DoesNotFit)
    return "Young's modulus: no value, the readings do not fit each other or the model";
  if (!best.has_value()) return "Young's modulus: no way gives a value";
  return palpate::text("Young's modulus %.3g kPa (95 %%: %.3g to %.3g) by %s", 1e3 * best.young_MPa,
                       1e3 * best.low_MPa, 1e3 * best.high_MPa, to_string(best.way));
}

/// Sample, pad and presses.
void add_setup(const ModulusReport& r, Facts& facts) {
  const Sample& s = r.setup.sample;
  const Pad& pad = r.setup.pad;
  facts.add("sample",
            {{"shape", to_string(s.shape)},
             {"size_mm", s.size_mm},
             {"height_mm", s.flat() ? Json(s.height_mm) : Json(nullptr)},
             {"poisson", s.poisson}},
            sample_words(s) + text(", Poisson %g", s.poisson));
  facts.add("pad",
            {{"young_MPa", pad.material.young_MPa},
             {"poisson", pad.material.poisson},
             {"thickness_mm", pad.thickness_mm}},
            text(", on a pad of %g kPa, ", 1e3 * pad.material.young_MPa) +
                (std::isfinite(pad.thickness_mm) ? text("%g mm thick", pad.thickness_mm) : "a half space"));
  facts.add("presses", r.frames.size(), text("; %zu presses", r.frames.size()));
  if (!r.frames.empty()) {
    const auto [least, most] = std::minmax_element(r.frames.begin(), r.frames.end(),
                                                   [](auto& a, auto& b) { return a.force_N < b.force_N; });
    facts.say(text(", %.4g to %.4g N", least->force_N, most->force_N));
  }
  facts.say("\n");
}

/// One way to the modulus, a row of the table.
Json add_way(const ModulusEstimate& e, Facts& facts) {
  facts.say(text("%-19s %-14s %7s   %-18s %8s %7.1f %%   %8u\n", to_string(e.way), to_string(e.state),
                 e.has_value() ? kilo(e.young_MPa).c_str() : "-", interval(e).c_str(),
                 e.points.empty() ? "-" : text("%.2f sd", e.residual).c_str(), 100 * e.strain_max,
                 e.readings));
  if (!e.reason.empty()) facts.say("                    " + e.reason + "\n");
  return {{"way", to_string(e.way)},
          {"state", to_string(e.state)},
          {"reason", e.reason.empty() ? Json(nullptr) : Json(e.reason)},
          {"young_MPa", e.has_value() ? Json(e.young_MPa) : Json(nullptr)},
          {"low_MPa", low(e)},
          {"high_MPa", high(e)},
          {"residual_sd", e.points.empty() ? Json(nullptr) : Json(e.residual)},
          {"strain_max", e.strain_max},
          {"readings", e.readings}};
}

/// The chosen way's words.
std::string answer_text(const ModulusReport& r) {
  const ModulusEstimate& best = r.answer.best();
  if (!best.has_value()) {
    std::string none = std::string("\nno modulus: ") + to_string(best.state) + "; " + best.reason + "\n";
    if (best.state == ModulusState::DoesNotFit) none += r.answer.why + "\n";
    return none;
  }
  return "\nYoung's modulus " + kilo(best.young_MPa) + " kPa (" + interval(best) + ", 95 %), by the " +
         to_string(best.way) + ": " + r.answer.why + "\n";
}

std::string expected_text(const ModulusReport& r) {
  const ModulusEstimate& best = r.answer.best();
  if (!best.has_value() || !(r.expected_MPa > 0)) return "";
  const bool inside = best.low_MPa <= r.expected_MPa && r.expected_MPa <= best.high_MPa;
  return text("expected %.4g kPa: %+.1f %%, %s the interval\n", 1e3 * r.expected_MPa,
              100 * (best.young_MPa / r.expected_MPa - 1), inside ? "inside" : "outside");
}

}  // namespace

Facts facts_of(const ModulusReport& r) {
  Facts facts;
  facts.say(headline(r) + "\n");
  add_setup(r, facts);
  for (const std::string& note : r.notes) facts.say("  " + note + "\n");
  facts.say(
      "\nway                 state           E, kPa   95 % interval, kPa   residual   strain   readings\n");
  Json ways = Json::array();
  for (const ModulusEstimate& e : r.answer.methods) ways.push_back(add_way(e, facts));
  const ModulusEstimate& best = r.answer.best();
  facts.add("chosen", to_string(r.answer.chosen), answer_text(r));
  facts.add("why", r.answer.why);
  facts.add("state", to_string(best.state));
  facts.add("reason", best.reason.empty() ? Json(nullptr) : Json(best.reason));
  facts.add("young_MPa", best.has_value() ? Json(best.young_MPa) : Json(nullptr));
  facts.add("low_MPa", low(best));
  facts.add("high_MPa", high(best));
  facts.add("expected_MPa", r.expected_MPa > 0 ? Json(r.expected_MPa) : Json(nullptr), expected_text(r));
  facts.add("ways", ways);
  facts.add("notes", r.notes);
  return facts;
}

std::string ways_csv(const ModulusAnswer& answer) {
  std::string text = "way,state,young_MPa,low_MPa,high_MPa,residual_sd,strain_max,readings,chosen\n";
  for (const ModulusEstimate& e : answer.methods) {
    const auto cell = [](double v) {
      return v > 0 && std::isfinite(v) ? palpate::text("%.7g", v) : std::string();
    };
    text += std::string(to_string(e.way)) + "," + to_string(e.state) + "," +
            (e.has_value() ? cell(e.young_MPa) : "") + "," + (e.has_bounds() ? cell(e.low_MPa) : "") + "," +
            (e.has_bounds() ? cell(e.high_MPa) : "") +
            palpate::text(",%.5g,%.5g,%u,%d\n", e.residual, e.strain_max, e.readings, e.way == answer.chosen);
  }
  return text;
}

std::string points_csv(const ModulusAnswer& answer) {
  std::string text = "way,press,quantity,against,measured,fitted,residual,sd\n";
  for (const ModulusEstimate& e : answer.methods)
    for (const ModulusPoint& p : e.points)
      text += std::string(to_string(e.way)) + palpate::text(",%u,\"%s\",", p.frame, p.quantity) +
              palpate::text("%.7g,%.7g,%.7g,%.7g,%.7g\n", p.against, p.measured, p.fitted,
                            p.measured - p.fitted, p.sd);
  return text;
}

Plot residual_plot(const ModulusReport& r) {
  PlotPanel panel{"", "force, N", "measured less fitted, standard errors"};
  panel.key = "outside right top";
  double largest = 0, most_N = 0;
  for (const ModulusEstimate& e : r.answer.methods) {
    std::map<std::string, std::vector<std::vector<double>>> groups;
    for (const ModulusPoint& p : e.points) {
      auto& columns = groups[p.quantity];
      columns.resize(2);
      columns[0].push_back(r.frames[p.frame].force_N);
      columns[1].push_back((p.measured - p.fitted) / p.sd);
      largest = std::max(largest, std::abs(columns[1].back()));
      most_N = std::max(most_N, columns[0].back());
    }
    for (const auto& [quantity, columns] : groups)
      panel.add(std::string(to_string(e.way)) + ": " + quantity, columns[0], columns[1], panel.curves.size(),
                PlotCurve::Style::LinesAndPoints);
  }
  panel.title = panel.curves.empty()
                    ? "no way has a fit"
                    : palpate::text("Measured and fitted differ by at most %.2g standard errors", largest);
  if (!panel.curves.empty()) panel.add_line("", {0, 0}, {most_N, 0});
  return {.panels = {panel}, .width_px = 860};
}

Plot modulus_plot(const ModulusReport& r) {
  // A flat sample's stress over its strain, else what the chosen way compared.
  const ModulusEstimate* shown = &r.answer.methods[static_cast<size_t>(ModulusMethod::StressStrain)];
  if (shown->points.empty()) shown = &r.answer.best();
  const bool stress = shown->way == ModulusMethod::StressStrain && r.setup.sample.flat();
  std::map<std::string, std::pair<PlotCurve, PlotCurve>> groups;  // measured, fitted
  for (const ModulusPoint& p : shown->points) {
    auto& [measured, fit] = groups[p.quantity];
    const double against = stress ? 1e3 * p.against : p.against;
    measured.add(stress ? p.measured : against, stress ? against : p.measured, p.measured - p.sd,
                 p.measured + p.sd);
    fit.add(stress ? p.fitted : against, stress ? against : p.fitted);
  }
  PlotPanel fits{groups.empty() ? "no fit" : to_string(shown->way),
                 stress                                           ? "axial strain"
                 : shown->way == ModulusMethod::DisplacementRatio ? "pad or contact, mm"
                                                                  : "force, N",
                 stress ? "stress, kPa" : "measured and fitted"};
  fits.key = "top left";
  for (auto& [quantity, curves] : groups) {
    auto& [measured, fit] = curves;
    measured.title = stress ? "measured" : quantity;
    measured.style = PlotCurve::Style::Points;
    measured.across = stress;
    fit.title = "fit";
    measured.colour = fit.colour = fits.curves.size() / 2;
    fits.curves.insert(fits.curves.end(), {measured, fit});
  }
  PlotPanel ways{"Young's modulus by each way, 95 % intervals", "", "Young's modulus, kPa"};
  ways.x_range = {{-0.5, kModulusMethods - 0.5}};
  ways.y_range = {{0, r.expected_MPa > 0 ? kPlotAuto : 1}};
  PlotCurve found{.title = "measured", .style = PlotCurve::Style::Points, .mark = 6, .size = 1.4};
  for (size_t i = 0; i < kModulusMethods; ++i) {
    const ModulusEstimate& e = r.answer.methods[i];
    ways.x_tics.emplace_back(to_string(e.way), i);
    if (!e.has_value()) continue;
    ways.y_range = {{0, kPlotAuto}};
    found.add(static_cast<double>(i), 1e3 * e.young_MPa, 1e3 * e.low_MPa, 1e3 * e.high_MPa);
  }
  ways.curves.push_back(found);
  const double known = 1e3 * r.expected_MPa;
  if (known > 0) ways.add("known", {-0.5, kModulusMethods - 0.5}, {known, known}, 1);
  return {headline(r), {fits, ways}, 2, 1100, 480};
}

}  // namespace palpate
