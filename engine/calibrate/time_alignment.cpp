#include "engine/calibrate/time_alignment.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <vector>

#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "engine/calibrate/time_series.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kLeastOverlap = 0.6;
constexpr double kLeastCorrelation = 0.8;
constexpr double kRivalExplains = 1.5;  // times the best offset's unexplained share
constexpr double kOppositeExplains = 0.5;
constexpr double kValley = 0.05;  // a peak of its own has this much lower ground around it
constexpr size_t kCoarse = 2000;  // samples, and steps of the offset

std::string number(double value, const char* format = "%.4g") {
  const std::string line = text(format, value);
  return line;
}

struct Series {
  std::vector<double> time_s, value;
};

bool varies(std::span<const double> values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high > *low;
}

/// Pairs of values at one offset, and what a straight line between them leaves.
struct SeriesFit {
  size_t pairs = 0;
  double correlation = -2;
  double slope = 0, mean_first = 0, mean_second = 0;
};

class Matcher {
 public:
  Matcher(std::span<const double> time_s, std::span<const double> value,
          std::span<const std::pair<double, double>> breaks)
      : time_s_(time_s), value_(value), breaks_(breaks) {}

  /// The second's value on the first clock's time, NaN where it has none.
  double at(double time_s, size_t& hint) const {
    if (!(time_s >= time_s_.front() && time_s <= time_s_.back())) return kNaN;
    while (hint + 2 < time_s_.size() && time_s_[hint + 1] < time_s) ++hint;
    for (const auto& [from, to] : breaks_)
      if (time_s > from && time_s < to) return kNaN;
    const double fraction = (time_s - time_s_[hint]) / (time_s_[hint + 1] - time_s_[hint]);
    return value_[hint] + fraction * (value_[hint + 1] - value_[hint]);
  }

  SeriesFit fit(const Series& first, double offset_s, size_t least_pairs) const {
    SeriesFit f;
    double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
    size_t hint = 0;
    for (size_t i = 0; i < first.time_s.size(); ++i) {
      const double y = at(first.time_s[i] - offset_s, hint);
      if (std::isnan(y)) continue;
      const double x = first.value[i];
      ++f.pairs;
      a += x;
      b += y;
      aa += x * x;
      bb += y * y;
      ab += x * y;
    }
    if (f.pairs < least_pairs || f.pairs < 3) return f;
    const auto n = static_cast<double>(f.pairs);
    const double var_a = aa - a * a / n, var_b = bb - b * b / n, cov = ab - a * b / n;
    if (!(var_a > 1e-12 * aa) || !(var_b > 1e-12 * bb)) return f;
    f.correlation = cov / std::sqrt(var_a * var_b);
    f.slope = cov / var_b;
    f.mean_first = a / n;
    f.mean_second = b / n;
    return f;
  }

  /// Standard error of the offset: what is left over, against how steeply the second changes.
  double offset_sd(const Series& first, double offset_s, double step_s, const SeriesFit& f) const {
    double squares = 0, steep = 0, lagged = 0, before = kNaN;
    size_t hint = 0, hint_left = 0, hint_right = 0;
    for (size_t i = 0; i < first.time_s.size(); ++i) {
      const double t = first.time_s[i] - offset_s;
      const double y = at(t, hint), left = at(t - step_s, hint_left), right = at(t + step_s, hint_right);
      if (std::isnan(y) || std::isnan(left) || std::isnan(right)) continue;
      const double r = first.value[i] - f.mean_first - f.slope * (y - f.mean_second);
      const double slope = f.slope * (right - left) / (2 * step_s);
      squares += r * r;
      steep += slope * slope;
      if (!std::isnan(before)) lagged += r * before;
      before = r;
    }
    if (!(steep > 0)) return kInfinity;
    const double rho = squares > 0 ? std::clamp(lagged / squares, 0.0, 0.98) : 0;
    const double n = static_cast<double>(std::max<size_t>(f.pairs, 3)) - 2;
    return std::sqrt(squares / n * (1 + rho) / (1 - rho) / steep);
  }

  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

 private:
  std::span<const double> time_s_, value_;
  std::span<const std::pair<double, double>> breaks_;
};

Series thinned(std::span<const double> time_s, std::span<const double> value) {
  // About the mean: correlations of 1e8 gray levels keep their digits.
  double mean = 0;
  for (const double v : value) mean += v / static_cast<double>(value.size());
  const size_t step = (time_s.size() + kCoarse - 1) / kCoarse;
  Series series;
  for (size_t i = 0; i < time_s.size(); i += step) {
    series.time_s.push_back(time_s[i]);
    series.value.push_back(value[i] - mean);
  }
  return series;
}

std::string wanted(const std::string& recording) {
  return "a gauge that saw the same presses as " + recording;
}

void check(std::span<const double> first, std::span<const double> second, const std::string& recording) {
  if (first.size() < 10 || second.size() < 10)
    throw Error(Failure::Input, wanted(recording),
                std::to_string(first.size()) + " frames and " + std::to_string(second.size()) + " readings",
                "longer ones, or --align none where the clocks agree");
  if (!varies(first))
    throw Error(Failure::Input, wanted(recording), "a recording in which nothing is pressed",
                "another recording");
  if (!varies(second))
    throw Error(Failure::Input, wanted(recording), "a gauge that reads the same all the time",
                "its recording of these presses");
}

/// Correlations at evenly spaced offsets.
struct Scan {
  double lowest_s = 0, step_s = 0;
  std::vector<double> score;
  size_t best = 0;

  double offset_s(size_t i) const { return lowest_s + static_cast<double>(i) * step_s; }
};

/// Offsets from the second's end at the first's start to the reverse, on the thinned first.
Scan scan_offsets(const Matcher& matcher, std::span<const double> first_time_s, std::span<const double> first,
                  std::span<const double> second_time_s, double frame_s) {
  const double length_first = first_time_s.back() - first_time_s.front(),
               length_second = second_time_s.back() - second_time_s.front();
  const double shorter = std::min(length_first, length_second);
  const double lowest = first_time_s.front() - second_time_s.back() + kLeastOverlap * shorter,
               highest = first_time_s.back() - second_time_s.front() - kLeastOverlap * shorter;
  const Series coarse = thinned(first_time_s, first);
  const double coarse_s = usual_step(coarse.time_s);
  const auto least = static_cast<size_t>(kLeastOverlap * std::min(1.0, shorter / length_first) * 0.8 *
                                         static_cast<double>(coarse.time_s.size()));
  Scan scan;
  scan.lowest_s = lowest;
  scan.step_s = std::max((highest - lowest) / (2 * kCoarse), 0.5 * std::min(frame_s, coarse_s));
  const auto steps = static_cast<size_t>(std::ceil((highest - lowest) / scan.step_s)) + 1;
  scan.score.resize(steps);
  for (size_t i = 0; i < steps; ++i) scan.score[i] = matcher.fit(coarse, scan.offset_s(i), least).correlation;
  scan.best =
      static_cast<size_t>(std::max_element(scan.score.begin(), scan.score.end()) - scan.score.begin());
  return scan;
}

/// Best of the peaks that lower ground parts from the scan's best.
void find_rival(const Scan& scan, TimeAlignment& found) {
  const double best = scan.score[scan.best];
  found.rival = -1;
  for (const ptrdiff_t direction : {-1, 1}) {
    double valley = best;
    for (auto i = static_cast<ptrdiff_t>(scan.best); i >= 0 && i < static_cast<ptrdiff_t>(scan.score.size());
         i += direction) {
      const double s = scan.score[static_cast<size_t>(i)];
      valley = std::min(valley, s);
      if (s > valley + kValley && s > found.rival && valley < best - kValley) {
        found.rival = s;
        found.rival_s = scan.offset_s(static_cast<size_t>(i));
      }
    }
  }
}

/// All samples, about their mean.
Series centred(std::span<const double> time_s, std::span<const double> value) {
  Series all;
  double mean = 0;
  for (const double v : value) mean += v / static_cast<double>(value.size());
  all.time_s.assign(time_s.begin(), time_s.end());
  for (const double v : value) all.value.push_back(v - mean);
  return all;
}

/// Ever smaller steps around an offset, then the parabola through the last three.
double refine_offset(const Matcher& matcher, const Series& all, double at, double step_s, double frame_s) {
  const double finest_s = 0.25 * frame_s;
  for (double h = step_s;; h = std::max(0.5 * h, finest_s)) {
    double top = at, top_score = matcher.fit(all, at, 3).correlation;
    for (int k = -3; k <= 3; ++k) {
      const double s = matcher.fit(all, at + k * h, 3).correlation;
      if (s > top_score) {
        top_score = s;
        top = at + k * h;
      }
    }
    at = top;
    if (h <= finest_s) break;
  }
  const double wide_s = std::max(finest_s, 0.5 * frame_s);
  const double left = matcher.fit(all, at - wide_s, 3).correlation,
               middle = matcher.fit(all, at, 3).correlation,
               right = matcher.fit(all, at + wide_s, 3).correlation;
  const double bend = left - 2 * middle + right;
  if (bend < 0 && left > -1 && right > -1) at += std::clamp(0.5 * (left - right) / bend, -1.0, 1.0) * wide_s;
  return at;
}

/// Lowest correlation of the scan: a second of the other sign goes best with the first's opposite.
void find_opposite(const Scan& scan, TimeAlignment& found) {
  for (size_t i = 0; i < scan.score.size(); ++i)
    if (scan.score[i] >= -1.001 && scan.score[i] < found.opposite) {
      found.opposite = scan.score[i];
      found.opposite_s = scan.offset_s(i);
    }
}

double unexplained(double correlation) {
  return 1 - std::max(correlation, 0.0) * std::max(correlation, 0.0);
}

}  // namespace

void check_alignment(const TimeAlignment& found, const std::string& recording) {
  if (-found.opposite >= kLeastCorrelation &&
      unexplained(-found.opposite) <= kOppositeExplains * unexplained(found.correlation))
    throw Error(Failure::Input, "a gauge that reads more where more is pressed in " + recording,
                "one that reads less there (correlation " + number(found.opposite, "%.4f") +
                    " at an offset of " + number(found.opposite_s) + " s)",
                "the gauge's table with its sign turned, or that of this recording");
  if (!(found.correlation >= kLeastCorrelation))
    throw Error(
        Failure::Input,
        "a gauge that goes with " + recording + " (correlation " + number(kLeastCorrelation) + " or more)",
        number(found.correlation, "%.3f") + " at best, at an offset of " + number(found.offset_s) + " s",
        "the gauge's table of this recording, or --align SECONDS where the offset is known");
  if (found.rival > 0 && unexplained(found.rival) < kRivalExplains * unexplained(found.correlation))
    throw Error(Failure::Input, "one offset between the clocks of " + recording + " and its gauge",
                "two that fit alike: " + number(found.offset_s) + " s (correlation " +
                    number(found.correlation, "%.4f") + ") and " + number(found.rival_s) + " s (" +
                    number(found.rival, "%.4f") + ")",
                "presses of different lengths and forces, or --align SECONDS where the offset is known");
}

TimeAlignment find_in_time(std::span<const double> first_time_s, std::span<const double> first,
                           std::span<const double> second_time_s, std::span<const double> second,
                           std::span<const std::pair<double, double>> breaks, const std::string& recording) {
  assert(first_time_s.size() == first.size() && second_time_s.size() == second.size());
  check(first, second, recording);
  const Matcher matcher(second_time_s, second, breaks);
  const double frame_s = usual_step(first_time_s);
  const Scan scan = scan_offsets(matcher, first_time_s, first, second_time_s, frame_s);
  if (scan.score[scan.best] < -1)
    throw Error(Failure::Input, wanted(recording), "too little time in common",
                "the gauge's table of this recording");
  TimeAlignment found;
  find_rival(scan, found);
  find_opposite(scan, found);
  const Series all = centred(first_time_s, first);
  const double at = refine_offset(matcher, all, scan.offset_s(scan.best), scan.step_s, frame_s);
  const SeriesFit fit = matcher.fit(all, at, 3);
  found.offset_s = at;
  found.correlation = fit.correlation;
  found.sd_s = matcher.offset_sd(all, at, 0.5 * frame_s, fit);
  return found;
}

TimeAlignment align_in_time(std::span<const double> first_time_s, std::span<const double> first,
                            std::span<const double> second_time_s, std::span<const double> second,
                            std::span<const std::pair<double, double>> breaks) {
  const TimeAlignment found = find_in_time(first_time_s, first, second_time_s, second, breaks);
  check_alignment(found);
  return found;
}

}  // namespace palpate
