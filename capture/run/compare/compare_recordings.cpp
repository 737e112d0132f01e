#include "capture/run/compare/compare_recordings.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "capture/files/measurements.h"
#include "capture/files/tables/csv_table.h"
#include "engine/base/text.h"
#include "engine/measure/quantities.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using Get = Estimate (*)(const CurvePoint&);

bool known(const Estimate& e) {
  return has_value(e) && std::isfinite(e.value);
}

Estimate area_of(const CurvePoint& point) {
  return {point.area_mm2, 0, point.contact ? Validity::Valid : Validity::NoContact};
}

/// Frame of the largest value: of the valid ones, where there is one.
std::optional<size_t> frame_of_largest(const RecordingCurve& curve, Get get) {
  std::optional<size_t> best;
  for (size_t i = 0; i < curve.points.size(); ++i) {
    const Estimate now = get(curve.points[i]);
    if (!curve.points[i].contact || !known(now)) continue;
    if (best) {
      const Estimate before = get(curve.points[*best]);
      const bool valid = now.validity == Validity::Valid, was = before.validity == Validity::Valid;
      if (valid == was ? now.value <= before.value : was) continue;
    }
    best = i;
  }
  return best;
}

Estimate difference_of(const Estimate& a, const Estimate& b) {
  if (!known(a) || !known(b)) return {0, 0, Validity::NotCalibrated};
  const Validity doubt = b.validity != Validity::Valid ? b.validity : a.validity;
  return {b.value - a.value, std::hypot(a.standard_error, b.standard_error), doubt};
}

struct Compared {
  const char* name;
  const char* unit;
  Get get;
  bool has_error;
};
const Compared kCompared[] = {
    {"force", "N", [](const CurvePoint& p) { return p.force_N; }, true},
    {"depth", "mm", [](const CurvePoint& p) { return p.depth_mm; }, true},
    {"area", "mm2", area_of, false},
};

/// Value of frame `index`, and its time.
std::pair<Estimate, std::optional<double>> at_frame(const RecordingCurve& curve, std::optional<size_t> index,
                                                    Get get) {
  if (!index) return {Estimate{0, 0, Validity::NotCalibrated}, std::nullopt};
  return {get(curve.points[*index]), curve.points[*index].time_s};
}

bool scaled(const RecordingCurve& curve) {
  return has_scale(curve.sensor);
}

std::optional<size_t> frame_near(const RecordingCurve& curve, double time_s) {
  const size_t index = curve.index_at(time_s);
  const double reach = curve.rate_Hz > 0 ? 1 / curve.rate_Hz : 0.1;
  return std::abs(curve.points[index].time_s - time_s) <= reach ? std::optional(index) : std::nullopt;
}

template <typename Find>
std::vector<ComparedValue> compared(const RecordingCurve& a, const RecordingCurve& b, const char* prefix,
                                    Find find) {
  std::vector<ComparedValue> values;
  for (const Compared& one : kCompared) {
    if (std::string(one.unit) == "mm2" && !(scaled(a) && scaled(b))) continue;
    ComparedValue value;
    value.name = std::string(prefix) + one.name;
    value.unit = one.unit;
    value.has_error = one.has_error;
    std::tie(value.a, value.a_time_s) = at_frame(a, find(a, one.get, true), one.get);
    std::tie(value.b, value.b_time_s) = at_frame(b, find(b, one.get, false), one.get);
    const auto missing = [](const Estimate& e) { return e.validity == Validity::NotCalibrated; };
    if (missing(value.a) && missing(value.b)) continue;
    value.difference = difference_of(value.a, value.b);
    values.push_back(std::move(value));
  }
  return values;
}

json::Value json_of(const Estimate& e) {
  if (!known(e)) return nullptr;
  return {{"value", e.value}, {"sd", e.standard_error}, {"state", to_string(e.validity)}};
}

}  // namespace

const char* to_string(Alignment alignment) {
  constexpr const char* kWords[] = {"first frame", "first touch", "largest force", "mark"};
  return kWords[static_cast<int>(alignment)];
}

std::optional<size_t> largest_frame(const RecordingCurve& curve) {
  const auto by_force = frame_of_largest(curve, kCompared[0].get);
  return by_force ? by_force : frame_of_largest(curve, kCompared[1].get);
}

std::optional<double> moment_of(const RecordingCurve& curve, Alignment alignment, const std::string& mark) {
  switch (alignment) {
    case Alignment::Start:
      return curve.points.front().time_s;
    case Alignment::Touch: {
      const auto first = std::ranges::find_if(curve.points, &CurvePoint::contact);
      return first == curve.points.end() ? std::nullopt : std::optional(first->time_s);
    }
    case Alignment::Largest: {
      const auto frame = largest_frame(curve);
      return frame ? std::optional(curve.points[*frame].time_s) : std::nullopt;
    }
    case Alignment::Mark:
      break;
  }
  for (const viz::Event& event : curve.events)
    if (event.kind == "mark" && (mark.empty() || event.text == mark)) return event.time_s;
  return std::nullopt;
}

SharedTime::SharedTime(const RecordingCurve& a, const RecordingCurve& b, Alignment alignment,
                       const std::string& mark, double offset_s) {
  for (const auto& [curve, time_s] : {std::pair{&a, &a_s}, std::pair{&b, &b_s}}) {
    const std::optional<double> moment = moment_of(*curve, alignment, mark);
    if (!moment)
      throw Error(
          Failure::Usage,
          "'" + curve->input + "' with a " + to_string(alignment) + (mark.empty() ? "" : " '" + mark + "'"),
          alignment == Alignment::Mark ? "no such mark in it" : "nothing touches the pad",
          "--align-by start, or largest");
    *time_s = *moment;
  }
  b_s -= offset_s;
}

std::vector<ComparedValue> compare_largest(const RecordingCurve& a, const RecordingCurve& b) {
  std::vector<ComparedValue> values =
      compared(a, b, "largest ",
               [](const RecordingCurve& curve, Get get, bool) { return frame_of_largest(curve, get); });
  for (ComparedValue& value : values)
    for (const Compared& one : kCompared) {
      if (!value.name.ends_with(one.name)) continue;
      for (const auto& [curve, name, valid] : {std::tuple{&a, "A", value.a}, std::tuple{&b, "B", value.b}}) {
        Estimate most = valid;
        for (const CurvePoint& point : curve->points)
          if (const Estimate e = one.get(point); point.contact && known(e) && e.value > most.value) most = e;
        if (most.value > valid.value && known(valid))
          value.doubt += (value.doubt.empty() ? "" : "; ") + std::string(name) + " reaches " +
                         value_words(most, one.unit, one.has_error);
      }
    }
  return values;
}

std::vector<ComparedValue> compare_at(const RecordingCurve& a, const RecordingCurve& b,
                                      const SharedTime& time, double at_s) {
  return compared(a, b, "", [&](const RecordingCurve& curve, Get, bool first) {
    return frame_near(curve, at_s + (first ? time.a_s : time.b_s));
  });
}

std::optional<double> force_rms_N(const RecordingCurve& a, const RecordingCurve& b, const SharedTime& time) {
  double squares = 0;
  int count = 0;
  for (const CurvePoint& point : a.points) {
    const auto other = frame_near(b, point.time_s - time.a_s + time.b_s);
    if (!other || !(point.contact || b.points[*other].contact)) continue;
    // What does not touch presses with no force.
    const auto force = [](const CurvePoint& p) {
      return p.contact ? p.force_N : Estimate{0, 0, Validity::Valid};
    };
    const Estimate f = force(point), g = force(b.points[*other]);
    if (f.validity != Validity::Valid || g.validity != Validity::Valid) continue;
    squares += (g.value - f.value) * (g.value - f.value);
    ++count;
  }
  return count > 0 ? std::optional(std::sqrt(squares / count)) : std::nullopt;
}

int deserved_places(double standard_error, int most) {
  if (!(standard_error > 0)) return most;
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(standard_error))), 0, most);
}

std::string value_words(const Estimate& value, const std::string& unit, bool has_error, bool sign) {
  if (!known(value)) return "-";
  const std::string shown_unit = unit == "mm2" ? "mm\xc2\xb2" : unit;
  const int places = deserved_places(has_error ? value.standard_error : 0, 3);
  std::string words = text(sign ? "%+.*f" : "%.*f", places, value.value);
  if (has_error && value.standard_error > 0) words += text(" \xc2\xb1 %.*f", places, value.standard_error);
  words += " " + shown_unit;
  if (value.validity != Validity::Valid && value.validity != Validity::NoContact)
    words += std::string(", ") + to_string(value.validity);
  return words;
}

std::string headline_of(const std::vector<ComparedValue>& values) {
  for (const ComparedValue& value : values) {
    if (!known(value.difference)) continue;
    const bool force = value.name.ends_with("force"), depth = value.name.ends_with("depth");
    const char* verb = force ? "presses" : depth ? "dents" : "touches";
    const char* more = force ? "harder" : depth ? "deeper" : "more";
    const char* less = force ? "less" : depth ? "less deep" : "less";
    const double sd = value.difference.standard_error, by = value.difference.value;
    if (value.has_error && sd > 0 && std::abs(by) < 2 * sd)
      return text("No difference of %s beyond its error: B %s A by %s", value.name.c_str(),
                  by < 0 ? "is below" : "exceeds",
                  value_words({std::abs(by), sd, value.difference.validity}, value.unit, true).c_str());
    std::string words =
        text("B %s ", verb) +
        value_words({std::abs(by), sd, value.difference.validity}, value.unit, value.has_error) + " " +
        (by < 0 ? less : more);
    if (value.a.value > 0) words += text(" (%+.0f %%)", 100 * by / value.a.value);
    return words;
  }
  return "Nothing that both recordings measure";
}

Facts facts_of(const RecordingCurve& a, const RecordingCurve& b, const std::vector<ComparedValue>& values,
               Alignment alignment, const SharedTime& time) {
  Facts facts;
  facts.add("headline", headline_of(values), headline_of(values) + "\n\n");
  facts.add("a", a.input, "A: " + a.input + "\n");
  facts.add("b", b.input, "B: " + b.input + "\n\n");
  facts.say(text("%-16s %26s %26s %30s\n", "", "A", "B", "B - A"));
  json::Value rows = json::Value::array();
  for (const ComparedValue& v : values) {
    // Columns are counted in letters: the sign of the error takes two bytes.
    const auto cell = [](const std::string& words, int width) {
      const auto extra = std::ranges::count_if(words, [](char c) { return (c & 0xC0) == 0x80; });
      return text("%*s", width + static_cast<int>(extra), words.c_str());
    };
    facts.say(text("%-16s ", v.name.c_str()) + cell(value_words(v.a, v.unit, v.has_error), 26) + " " +
              cell(value_words(v.b, v.unit, v.has_error), 26) + " " +
              cell(value_words(v.difference, v.unit, v.has_error, true), 30) + "\n");
    json::Value row = {{"quantity", v.name},
                       {"unit", v.unit},
                       {"a", json_of(v.a)},
                       {"b", json_of(v.b)},
                       {"difference", json_of(v.difference)}};
    if (!v.doubt.empty()) facts.say("  " + v.doubt + "\n");
    if (!v.doubt.empty()) row["doubt"] = v.doubt;
    if (v.a_time_s) row["a_time_s"] = *v.a_time_s;
    if (v.b_time_s) row["b_time_s"] = *v.b_time_s;
    rows.push_back(row);
  }
  facts.add("values", rows);
  facts.add(
      "aligned_by", to_string(alignment),
      text("\naligned by the %s: %.3f s of A, %.3f s of B\n", to_string(alignment), time.a_s, time.b_s));
  facts.add("a_zero_s", time.a_s);
  facts.add("b_zero_s", time.b_s);
  if (const auto rms = force_rms_N(a, b, time))
    facts.add("force_rms_N", *rms,
              text("forces differ by %.4f N (RMS over the time that both have)\n", *rms));
  for (const RecordingCurve* curve : {&a, &b})
    if (!curve->warning.empty()) facts.say(curve->warning + "\n");
  return facts;
}

std::string comparison_csv(const std::vector<ComparedValue>& values) {
  std::string table =
      "quantity,unit,a,a_sd,a_state,a_time_s,b,b_sd,b_state,b_time_s,difference,difference_sd,"
      "difference_state\n";
  const auto cells = [](const Estimate& e, bool has_error) {
    if (!known(e)) return "," + std::string(",") + csv_cell(to_string(e.validity));
    return shortest(e.value) + "," + (has_error ? shortest(e.standard_error) : "") + "," +
           csv_cell(to_string(e.validity));
  };
  for (const ComparedValue& v : values)
    table += csv_cell(v.name) + "," + v.unit + "," + cells(v.a, v.has_error) + "," +
             (v.a_time_s ? shortest(*v.a_time_s) : "") + "," + cells(v.b, v.has_error) + "," +
             (v.b_time_s ? shortest(*v.b_time_s) : "") + "," + cells(v.difference, v.has_error) + "\n";
  return table;
}

}  // namespace palpate
