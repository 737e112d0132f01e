#include "engine/calibrate/force/choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <span>

#include "engine/base/numbers.h"
#include "engine/calibrate/force/scatter.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kHuge = std::numeric_limits<double>::infinity();
constexpr double kLeastDrift_min = 10.0 / 60;  // less does not determine a change per minute
constexpr size_t kFewestBeyondMeans = 3;       // more than recordings: a drift follows from their means
constexpr double kAlike = 0.03;                // of the least error: less of a difference is none

// Where pixels show slopes, what bends is what presses: gradients come first there, and are measured only
// there. The mean of two readings comes before either: what spoils one of them on another day is halved.
constexpr std::array kSignals{ForceSignal::LayerAndBending, ForceSignal::Layer, ForceSignal::Gradient,
                              ForceSignal::GraySum,         ForceSignal::Area,  ForceSignal::Volume};
constexpr std::array kModels{ForceModel::Scale, ForceModel::Line, ForceModel::Power, ForceModel::Spline};

std::string why_left_out(std::span<const ForceSample> samples) {
  std::map<LeftOut, size_t> counts;
  for (const ForceSample& s : samples)
    if (!is_used(s)) ++counts[s.left_out];
  std::string text;
  for (const auto& [why, count] : counts)
    text += (text.empty() ? " (left out: " : ", ") + std::to_string(count) + " " + to_string(why);
  return text.empty() ? text : text + ")";
}

/// Whether all used readings have what a signal needs.
bool is_there(ForceSignal signal, std::span<const ForceSample> samples) {
  const auto lacks = [signal](const ForceSample& s) { return is_used(s) && !has_signal(signal, s.features); };
  return std::any_of(samples.begin(), samples.end(), is_used) &&
         std::none_of(samples.begin(), samples.end(), lacks);
}

std::vector<ForceCandidate> candidates_of(const ForceChoiceOptions& options,
                                          std::span<const ForceSample> samples) {
  std::vector<ForceCandidate> list;
  for (const ForceModel model : kModels)
    for (const bool branches : {false, true})
      for (const ForceSignal signal : kSignals) {
        // The layer's force is one: only its modulus is open.
        if ((model == ForceModel::Scale) != is_by_layer(signal)) continue;
        if (!is_there(signal, samples)) continue;
        if (options.signal.value_or(signal) != signal || options.model.value_or(model) != model ||
            options.branches.value_or(branches) != branches)
          continue;
        list.push_back({signal, model, branches});
      }
  return list;
}

/// What has to be left out for a signal to be taken unasked. How area, volume and bending go with force
/// depends on the object's shape: only objects that are held out speak for them. On a gel whose layer reads
/// force as well, what a pixel changes by is of the day's light too.
struct Eligible {
  bool asked = false, objects = false, days = false;
  bool gel_with_layer = false;

  bool operator()(ForceSignal signal) const {
    if (asked || signal == ForceSignal::Layer) return true;
    if (signal == ForceSignal::LayerAndBending) return objects;
    if (gel_with_layer) return objects && days;
    return objects || signal == ForceSignal::GraySum || signal == ForceSignal::Gradient;
  }
};
Eligible eligible(std::span<const ForceCandidate> candidates, std::span<const ForceSample> samples,
                  const HoldOut& held, const ForceChoiceOptions& options) {
  const bool layer = std::ranges::any_of(candidates, [](auto& c) { return c.signal == ForceSignal::Layer; });
  const bool gel = std::ranges::any_of(samples, [](auto& s) { return s.features.has_gradient; });
  return {options.signal.has_value(), held.objects, held.days, layer && gel};
}

/// Each used reading as a fit without its block says it. Throws where a block cannot be left out.
std::vector<double> held_out(const ForceCandidate& c, std::span<const ForceSample> samples,
                             const HoldOut& held, const std::function<bool()>& stopped = {}) {
  std::vector<double> predicted(samples.size(), kNaN);
  for (size_t b = 0; b < held.blocks && !(stopped && stopped()); ++b) {
    const auto counts = [&](size_t i) { return held.teaches(i, b); };
    const ForceTrack track = track_of(c.signal, samples, counts);
    const ForceCurves curves = fit_curves(c.model, c.branches, track, samples, counts);
    for (size_t i = 0; i < samples.size(); ++i)
      if (is_used(samples[i]) && held.block[i] == b)
        predicted[i] = curves.at(track.signal[i], track.unloading[i]);
  }
  return predicted;
}

/// Mean absolute error of each block.
std::vector<double> block_errors(std::span<const double> predicted, std::span<const ForceSample> samples,
                                 const HoldOut& held) {
  std::vector<double> sum(held.blocks), count(held.blocks);
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!is_used(samples[i])) continue;
    sum[held.block[i]] += std::abs(predicted[i] - samples[i].force_N);
    count[held.block[i]] += 1;
  }
  for (size_t b = 0; b < held.blocks; ++b) sum[b] /= std::max(count[b], 1.0);
  return sum;
}

/// R^2 of a curve over the readings with weight.
BranchLine line_of(const CurveFit& fit, ForceModel model, const ForceTrack& track,
                   std::span<const ForceSample> samples, const std::function<bool(size_t)>& counts) {
  BranchLine line{fit.curve, 0, 0};
  double sum = 0, squares = 0, left = 0;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!is_used(samples[i]) || !counts(i)) continue;
    ++line.readings;
    sum += samples[i].force_N;
    squares += samples[i].force_N * samples[i].force_N;
    left += std::pow(samples[i].force_N - force_at(model, fit.curve, track.signal[i]), 2);
  }
  const double about_mean = squares - sum * sum / static_cast<double>(line.readings);
  line.r_squared = about_mean > 0 ? 1 - left / about_mean : 0;
  return line;
}

/// Residual's change with time, each recording about its own mean; from the presses' means where each
/// recording has enough of them, since frames of one press err alike.
void find_drift(std::span<const ForceSample> samples, std::span<const double> residual_N,
                ForceChoice& choice) {
  struct Sum {
    double count = 0, time_min = 0, residual_N = 0;
  };
  std::map<std::pair<uint32_t, uint64_t>, Sum> presses, frames;
  for (size_t i = 0; i < samples.size(); ++i) {
    const ForceSample& s = samples[i];
    if (!is_used(s) || !std::isfinite(s.time_s)) continue;
    for (Sum* sum : {&presses[{s.recording, s.press}], &frames[{s.recording, s.frame}]}) {
      sum->count += 1;
      sum->time_min += s.time_s / 60;
      sum->residual_N += residual_N[i];
    }
  }
  std::map<uint32_t, Sum> means;
  for (const auto& [key, p] : presses) means[key.first];
  const auto& points = presses.size() >= means.size() + kFewestBeyondMeans ? presses : frames;
  for (const auto& [key, p] : points) {
    Sum& mean = means[key.first];
    mean.count += 1;
    mean.time_min += p.time_min / p.count;
    mean.residual_N += p.residual_N / p.count;
  }
  double tt = 0, tr = 0, rr = 0, least_min = kHuge, most_min = -kHuge;
  for (const auto& [key, p] : points) {
    const Sum& mean = means[key.first];
    const double t = p.time_min / p.count - mean.time_min / mean.count,
                 r = p.residual_N / p.count - mean.residual_N / mean.count;
    least_min = std::min(least_min, t), most_min = std::max(most_min, t);
    tt += t * t;
    tr += t * r;
    rr += r * r;
  }
  const double free = static_cast<double>(points.size()) - static_cast<double>(means.size()) - 1;
  choice.drift_sd_N_per_min = kNaN;
  if (!(tt > 0) || free < 1 || most_min - least_min < kLeastDrift_min) return;
  choice.calibration.drift_N_per_min = tr / tt;
  choice.drift_sd_N_per_min = std::sqrt(std::max(rr - tr * tr / tt, 0.0) / free / tt);
}

/// The largest difference between the directions where both were seen.
void find_hysteresis(const ForceTrack& track, std::span<const ForceSample> samples, const ForceCurves& curves,
                     double full_N, ForceChoice& choice) {
  double low[2], high[2];
  for (const int side : {0, 1}) {
    low[side] = std::numeric_limits<double>::infinity();
    high[side] = -low[side];
    for (size_t i = 0; i < samples.size(); ++i) {
      if (!is_used(samples[i]) || !(side ? track.unloads(i) : track.loads(i))) continue;
      low[side] = std::min(low[side], track.signal[i]);
      high[side] = std::max(high[side], track.signal[i]);
    }
  }
  const double from = std::max(low[0], low[1]), to = std::min(high[0], high[1]);
  if (!(to - from > 0.5 * (track.high - track.low))) return;
  choice.has_hysteresis = true;
  double largest_N = 0;
  constexpr int kSteps = 200;
  for (int k = 0; k <= kSteps; ++k) {
    const double s = from + (to - from) * k / kSteps;
    const double gap_N = std::abs(curves.at(s, 0) - curves.at(s, 1));
    if (gap_N < largest_N) continue;
    largest_N = gap_N;
    choice.hysteresis_signal = s;
  }
  choice.calibration.hysteresis = largest_N / full_N;
}

/// The 95 % interval from held-out readings, and how often it holds those of a block that did not widen it.
Scatter find_interval(std::span<const ForceSample> samples, std::span<const size_t> block, size_t blocks,
                      double full_N, ForceChoice& choice) {
  std::vector<double> residual_N, predicted_N, squares;
  std::vector<size_t> from;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!is_used(samples[i])) continue;
    predicted_N.push_back(choice.held_out_N[i]);
    residual_N.push_back(samples[i].force_N - choice.held_out_N[i]);
    from.push_back(block[i]);
    choice.held_out_rms_N += residual_N.back() * residual_N.back();
  }
  choice.held_out_rms_N = std::sqrt(choice.held_out_rms_N / static_cast<double>(residual_N.size()));
  const auto scatter_without = [&](size_t left_out) {
    std::vector<double> r, f;
    for (size_t i = 0; i < from.size(); ++i) {
      if (from[i] == left_out) continue;
      r.push_back(residual_N[i]);
      f.push_back(predicted_N[i]);
    }
    Scatter scatter = fit_scatter(r, f);
    const double factor = widening(scatter, r, f);
    return Scatter{scatter.still_N * factor, scatter.fraction * factor, scatter.grows_to_N};
  };
  size_t inside = 0;
  for (size_t b = 0; b < blocks; ++b) {
    const Scatter scatter = scatter_without(b);
    for (size_t i = 0; i < from.size(); ++i)
      inside += from[i] == b && std::abs(residual_N[i]) <= 1.96 * scatter.at(predicted_N[i]);
  }
  choice.interval_coverage = static_cast<double>(inside) / static_cast<double>(from.size());
  const Scatter scatter = scatter_without(blocks);
  choice.interval_full_N = 1.96 * scatter.at(full_N);
  return scatter;
}

size_t count_used(std::span<const ForceSample> samples) {
  return static_cast<size_t>(std::count_if(samples.begin(), samples.end(), is_used));
}

/// Throws Error where the signal that is asked for is not there, or too few readings are.
void check_readings(std::span<const ForceSample> samples, const ForceChoiceOptions& options) {
  if (options.signal == ForceSignal::Gradient && !is_there(ForceSignal::Gradient, samples))
    throw Error(Failure::Input, "the sum of gradients as signal",
                "frames of more than 8 bits, or without contact", "signal gray-sum");
  if (options.signal == ForceSignal::Volume && !is_there(ForceSignal::Volume, samples))
    throw Error(Failure::Input, "the indented volume as signal", "a sensor that measures no surface",
                "signal gray-sum or area, or a surface section in the sensor file");
  const bool by_layer = options.model == ForceModel::Scale || options.signal == ForceSignal::Layer;
  if (by_layer && !is_there(ForceSignal::Layer, samples))
    throw Error(Failure::Input, "the elastic layer's force as signal",
                "a sensor without a layer or a surface, or frames without contact",
                "the section 'layer' in the sensor file (young_MPa, poisson, thickness_mm)");
  if (options.signal == ForceSignal::LayerAndBending && !is_there(ForceSignal::LayerAndBending, samples))
    throw Error(Failure::Input, "the elastic layer's force and the bending as signal",
                "a sensor that is no colour gel with a layer, or frames without contact",
                "signal layer, or gray-sum");
  const size_t least = unknowns(options.model.value_or(ForceModel::Line), 0) + 1;
  if (count_used(samples) < least)
    throw Error(
        Failure::Input, "at least " + std::to_string(least) + " frames of a contact with gauge readings",
        std::to_string(count_used(samples)) + " of " + std::to_string(samples.size()) + why_left_out(samples),
        samples.empty() ? "a recording in which something presses"
                        : "a recording with more presses, less light, and the contact inside the frame, or "
                          "contacts at the border too (--keep-border)");
}

/// Every candidate judged by held-out readings into choice.scores, and the one that is taken: its place in
/// them. Throws Error where none can be judged.
size_t score_candidates(std::span<const ForceCandidate> candidates, std::span<const ForceSample> samples,
                        const HoldOut& held, const ForceChoiceOptions& options, ForceChoice& choice) {
  const Eligible may_be_taken = eligible(candidates, samples, held, options);
  std::vector<std::vector<double>> errors;
  std::optional<size_t> best;
  double best_N = 0;
  for (const ForceCandidate& c : candidates) {
    CandidateScore score{.candidate = c, .error_N = kNaN, .worse_N = kNaN, .worse_sd_N = kNaN, .refused = {}};
    errors.emplace_back();
    try {
      errors.back() = block_errors(held_out(c, samples, held, options.stopped), samples, held);
      score.error_N = std::accumulate(errors.back().begin(), errors.back().end(), 0.0) /
                      static_cast<double>(choice.blocks);
      if (may_be_taken(c.signal) && (!best || score.error_N < best_N)) {
        best = choice.scores.size();
        best_N = score.error_N;
      }
    } catch (const Error& error) {
      if (candidates.size() == 1) throw;
      score.refused = error.what();
    }
    if (options.stopped && options.stopped()) {
      choice.stopped = true;
      return 0;
    }
    choice.scores.push_back(score);
  }
  if (!best) {
    // Too few readings to hold any out: say what the simplest one lacks.
    fit_curves(candidates.front().model, candidates.front().branches,
               track_of(candidates.front().signal, samples), samples, [](size_t) { return true; });
    throw Error(Failure::Input, "enough readings to check a fit on held-out ones",
                std::to_string(count_used(samples)) + why_left_out(samples), "a recording with more presses");
  }
  size_t chosen = choice.scores.size();
  for (size_t k = 0; k < choice.scores.size(); ++k) {
    CandidateScore& score = choice.scores[k];
    if (!score.refused.empty()) continue;
    const auto n = static_cast<double>(choice.blocks);
    double sum = 0, squares = 0;
    for (size_t b = 0; b < choice.blocks; ++b) {
      const double d = errors[k][b] - errors[*best][b];
      sum += d;
      squares += d * d;
    }
    score.worse_N = sum / n;
    score.worse_sd_N =
        std::sqrt(std::max(squares / n - score.worse_N * score.worse_N, 0.0) / std::max(n - 1, 1.0));
    score.eligible = may_be_taken(score.candidate.signal);
    if (score.eligible && chosen == choice.scores.size() &&
        score.worse_N <= std::max(score.worse_sd_N, kAlike * best_N))
      chosen = k;
  }
  return chosen == choice.scores.size() ? *best : chosen;
}

/// Residuals of the fitted curves, N (0 where a sample is not used), and what they say of the fit.
std::vector<double> judge_residuals(std::span<const ForceSample> samples, const ForceTrack& track,
                                    const ForceCurves& curves, ForceChoice& choice) {
  ForceCalibration& f = choice.calibration;
  std::vector<double> residual_N(samples.size());
  double squares = 0, sum = 0, about = 0;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!is_used(samples[i])) continue;
    f.force_max_N = std::max(f.force_max_N, samples[i].force_N);
    residual_N[i] = samples[i].force_N - curves.at(track.signal[i], track.unloading[i]);
    choice.largest_residual_N = std::max(choice.largest_residual_N, std::abs(residual_N[i]));
    squares += residual_N[i] * residual_N[i];
    sum += samples[i].force_N;
    ++choice.readings;
  }
  const double mean = sum / static_cast<double>(choice.readings);
  for (const ForceSample& s : samples)
    if (is_used(s)) about += (s.force_N - mean) * (s.force_N - mean);
  choice.residual_rms_N = std::sqrt(squares / static_cast<double>(choice.readings));
  f.r_squared = about > 0 ? 1 - squares / about : 0;
  return residual_N;
}

}  // namespace

ForceChoice choose_force(std::vector<ForceSample>& samples, const ForceChoiceOptions& options) {
  check_readings(samples, options);
  const std::vector<ForceCandidate> candidates = candidates_of(options, samples);
  std::vector<ForceSignal> signals;
  for (const ForceSignal signal : kSignals)
    if (std::any_of(candidates.begin(), candidates.end(),
                    [&](const ForceCandidate& c) { return c.signal == signal; }))
      signals.push_back(signal);
  mark_outliers(samples, signals);

  ForceChoice choice;
  const HoldOut held = hold_out(samples);
  choice.blocks = held.blocks;
  choice.blocks_are = held.blocks_are;
  choice.objects_left_out = held.objects;
  choice.days_left_out = held.days;
  const size_t chosen = score_candidates(candidates, samples, held, options, choice);
  if (choice.stopped) return choice;
  choice.chosen = choice.scores[chosen];
  const ForceCandidate& c = choice.chosen.candidate;
  // Outliers of the chosen signal alone count for it alone.
  mark_outliers(samples, std::array{c.signal});
  const HoldOut final_held = hold_out(samples);
  choice.blocks = final_held.blocks;
  const ForceTrack track = track_of(c.signal, samples);
  const auto all = [](size_t) { return true; };
  const ForceCurves curves = fit_curves(c.model, c.branches, track, samples, all);
  choice.held_out_N = held_out(c, samples, final_held);
  choice.unloading_fraction = track.unloading;

  ForceCalibration& f = choice.calibration;
  f.signal = c.signal;
  f.model = c.model;
  f.c1_N_per_gray = curves.together.curve.c1;
  f.c0_N = curves.together.curve.c0_N;
  f.exponent = curves.together.curve.exponent;
  f.knots = curves.together.curve.knots;
  f.covariance = curves.together.covariance;
  f.bending_N_per_mm = track.bending_N_per_mm;
  f.gray_min = track.low;
  f.gray_max = track.high;
  const std::vector<double> residual_N = judge_residuals(samples, track, curves, choice);

  const Scatter scatter = find_interval(samples, final_held.block, choice.blocks, f.force_max_N, choice);
  f.residual_sd_N = scatter.still_N;
  f.residual_fraction = scatter.fraction;
  f.residual_grows_to_N = scatter.fraction > 0 ? scatter.grows_to_N : 0;
  if (curves.loading) {
    f.loading = curves.loading->curve;
    f.unloading = curves.unloading->curve;
    f.loading->residual_sd_N = f.unloading->residual_sd_N = scatter.still_N;
  }
  const auto loads = [&](size_t i) { return track.loads(i); };
  const auto unloads = [&](size_t i) { return track.unloads(i); };
  choice.line = line_of(fit_curves(ForceModel::Line, false, track, samples, all).together, ForceModel::Line,
                        track, samples, all);
  try {
    const ForceCurves lines = fit_curves(ForceModel::Line, true, track, samples, all);
    choice.loading = line_of(*lines.loading, ForceModel::Line, track, samples, loads);
    choice.unloading = line_of(*lines.unloading, ForceModel::Line, track, samples, unloads);
    find_hysteresis(track, samples, fit_curves(c.model, true, track, samples, all), f.force_max_N, choice);
  } catch (const Error&) {
    // One direction only: nothing can be said of the difference, and nothing is.
  }
  find_drift(samples, residual_N, choice);
  return choice;
}

}  // namespace palpate
