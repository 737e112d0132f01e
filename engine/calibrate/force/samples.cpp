#include "engine/calibrate/force/samples.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "engine/base/statistics.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kOnBranch = 0.1;     // an unloading share closer to 0 or 1 than this counts as on a branch
constexpr size_t kLeastOnBranch = 7;  // readings
constexpr double kOutlier_sd = 6;
constexpr double kLeastScatter = 0.004;  // fraction of full scale below which nothing is an outlier
constexpr double kMostOutliers = 0.1;    // more are no outliers but a curve that does not fit
constexpr size_t kFewestPresses = 4;     // the same
constexpr size_t kMostBlocks = 10;
constexpr size_t kStretches = 8;  // of time, where there are few presses

double bending_scale(std::span<const ForceSample> samples, const std::function<bool(size_t)>& counts) {
  double products = 0, squares = 0;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!is_used(samples[i]) || !counts(i)) continue;
    const ForceFeatures& f = samples[i].features;
    products += f.layer_N * f.bending_mm;
    squares += f.bending_mm * f.bending_mm;
  }
  return squares > 0 ? products / squares : 0;
}

}  // namespace

const char* to_string(LeftOut left_out) {
  switch (left_out) {
    case LeftOut::Used:
      return "used";
    case LeftOut::NoGauge:
      return "without gauge reading";
    case LeftOut::Saturated:
      return "saturated";
    case LeftOut::AtBorder:
      return "at the border";
    case LeftOut::Outlier:
      return "outliers";
  }
  return "?";
}

std::string to_string(const ForceCandidate& c) {
  return std::string(to_string(c.model)) + " of " + to_string(c.signal) +
         (c.branches ? ", apart" : ", together");
}

bool ForceTrack::loads(size_t i) const {
  return unloading[i] <= kOnBranch;
}

bool ForceTrack::unloads(size_t i) const {
  return unloading[i] >= 1 - kOnBranch;
}

double ForceCurves::at(double signal, double w) const {
  if (!loading) return force_at(model, together.curve, signal);
  return (1 - w) * force_at(model, loading->curve, signal) + w * force_at(model, unloading->curve, signal);
}

ForceTrack track_of(ForceSignal signal, std::span<const ForceSample> samples,
                    const std::function<bool(size_t)>& counts) {
  ForceTrack track;
  if (signal == ForceSignal::LayerAndBending) track.bending_N_per_mm = bending_scale(samples, counts);
  ForceCalibration reads;
  reads.signal = signal;
  reads.bending_N_per_mm = track.bending_N_per_mm;
  track.low = std::numeric_limits<double>::infinity();
  track.high = -track.low;
  for (const ForceSample& s : samples) {
    track.signal.push_back(signal_of(reads, s.features));
    if (!is_used(s)) continue;
    track.low = std::min(track.low, track.signal.back());
    track.high = std::max(track.high, track.signal.back());
  }
  LoadDirection direction;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (i == 0 || samples[i].press != samples[i - 1].press) direction = LoadDirection();
    track.unloading.push_back(
        direction.update(true, track.signal[i], kTurn_fraction * (track.high - track.low)));
  }
  return track;
}

ForceCurves fit_curves(ForceModel model, bool branches, const ForceTrack& track,
                       std::span<const ForceSample> samples, const std::function<bool(size_t)>& counts) {
  std::map<uint32_t, double> of_recording;
  double all = 0;
  for (size_t i = 0; i < samples.size(); ++i)
    if (is_used(samples[i]) && counts(i)) of_recording[samples[i].recording] += 1, all += 1;
  std::vector<double> s, f, weight, on_loading, on_unloading;
  size_t loading = 0, unloading = 0;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!is_used(samples[i]) || !counts(i)) continue;
    s.push_back(track.signal[i]);
    f.push_back(samples[i].force_N);
    weight.push_back(model == ForceModel::Scale
                         ? all / static_cast<double>(of_recording.size()) / of_recording[samples[i].recording]
                         : 1);
    on_loading.push_back(track.loads(i) ? weight.back() : 0);
    on_unloading.push_back(track.unloads(i) ? weight.back() : 0);
    loading += on_loading.back() > 0;
    unloading += on_unloading.back() > 0;
  }
  ForceCurves curves{model, fit_curve(model, s, f, weight), {}, {}};
  if (!branches) return curves;
  for (const auto& [name, count] : {std::pair{"loading", loading}, std::pair{"unloading", unloading}})
    if (count < kLeastOnBranch)
      throw Error(Failure::Input, std::to_string(kLeastOnBranch) + " readings while " + name,
                  std::to_string(count), "a recording with slower presses");
  curves.loading = fit_curve(model, s, f, on_loading);
  curves.unloading = fit_curve(model, s, f, on_unloading);
  return curves;
}

size_t count_objects(std::span<const ForceSample> samples) {
  std::set<uint32_t> objects;
  for (const ForceSample& s : samples)
    if (is_used(s)) objects.insert(object_of(s));
  return objects.size();
}

/// Blocks of objects become blocks of what one object showed on one day. False, and nothing changes, where
/// days differ in their object alone, or some fit would be left with fewer than two objects.
bool HoldOut::apart_by_day(std::span<const ForceSample> samples) {
  std::map<std::pair<size_t, uint32_t>, size_t> number;  // of group and day
  for (size_t i = 0; i < samples.size(); ++i)
    if (is_used(samples[i])) number.try_emplace({block[i], samples[i].day}, number.size());
  std::set<uint32_t> seen_days;
  for (const auto& [judged, b] : number) {
    seen_days.insert(judged.second);
    std::set<size_t> teach;
    for (const auto& [other, c] : number)
      if (other.first != judged.first && other.second != judged.second) teach.insert(other.first);
    if (teach.size() < 2) return false;
  }
  if (seen_days.size() == number.size()) return false;
  group_ = block;
  group_of_block_.resize(number.size());
  day_of_block_.resize(number.size());
  for (const auto& [judged, b] : number) {
    group_of_block_[b] = judged.first;
    day_of_block_[b] = judged.second;
  }
  for (size_t i = 0; i < samples.size(); ++i) {
    day_.push_back(samples[i].day);
    if (is_used(samples[i])) block[i] = number[{group_[i], day_[i]}];
  }
  blocks = number.size();
  return true;
}

HoldOut hold_out(std::span<const ForceSample> samples) {
  HoldOut h;
  h.block.resize(samples.size());
  std::map<uint32_t, size_t> in_press, in_recording, in_object;
  for (const ForceSample& s : samples)
    if (is_used(s)) {
      ++in_press[s.press];
      ++in_recording[s.recording];
      ++in_object[object_of(s)];
    }
  const auto in_blocks = [&](const std::map<uint32_t, size_t>& groups, const char* what, auto&& group_of) {
    h.blocks_are = what;
    h.blocks = std::min(groups.size(), kMostBlocks);
    std::map<uint32_t, size_t> number;
    for (const auto& [group, count] : groups) number.emplace(group, number.size());
    for (size_t i = 0; i < samples.size(); ++i)
      if (is_used(samples[i])) h.block[i] = number[group_of(samples[i])] * h.blocks / groups.size();
  };
  if (in_object.size() >= kFewestObjects) {
    const bool named =
        std::ranges::any_of(samples, [](const ForceSample& s) { return s.object.has_value(); });
    in_blocks(in_object, named ? "objects" : "recordings, each taken as an object of its own", object_of);
    h.objects = true;
    h.days = h.apart_by_day(samples);
    return h;
  }
  if (in_recording.size() >= kFewestObjects) {
    in_blocks(in_recording, "recordings", [](const ForceSample& s) { return s.recording; });
    return h;
  }
  if (in_press.size() >= kFewestPresses) {
    in_blocks(in_press, "presses", [](const ForceSample& s) { return s.press; });
    return h;
  }
  h.blocks_are = "stretches of time";
  std::map<uint32_t, size_t> seen, first;
  for (size_t i = 0; i < samples.size(); ++i) {
    const ForceSample& s = samples[i];
    if (!is_used(s)) continue;
    if (first.emplace(s.press, h.blocks).second) h.blocks += kStretches;
    h.block[i] = first[s.press] + seen[s.press]++ * kStretches / in_press[s.press];
  }
  return h;
}

void mark_outliers(std::vector<ForceSample>& samples, std::span<const ForceSignal> signals) {
  std::vector<size_t> judged(samples.size());
  double full_N = 0;
  size_t count = 0;
  for (const ForceSample& s : samples)
    if (is_used(s)) {
      full_N = std::max(full_N, std::abs(s.force_N));
      ++count;
    }
  for (const ForceSignal signal : signals) {
    const ForceTrack track = track_of(signal, samples);
    std::vector<bool> kept(samples.size(), true);
    std::vector<double> off(samples.size());
    // Fitted again without what stood out, until that does not change.
    for (int round = 0; round < 4; ++round) {
      std::optional<ForceCurves> curves;
      const auto counts = [&](size_t i) { return bool{kept[i]}; };
      for (const bool branches : {true, false}) {
        try {
          curves = fit_curves(ForceModel::Spline, branches, track, samples, counts);
          break;
        } catch (const Error&) {
          continue;  // too few readings for that many numbers: nothing is judged by them
        }
      }
      if (!curves) return;
      std::vector<double> sizes;
      for (size_t i = 0; i < samples.size(); ++i) {
        off[i] = is_used(samples[i])
                     ? std::abs(samples[i].force_N - curves->at(track.signal[i], track.unloading[i]))
                     : 0;
        if (is_used(samples[i])) sizes.push_back(off[i]);
      }
      const double scatter_N = std::max(1.4826 * median(sizes), kLeastScatter * full_N);
      bool changed = false;
      for (size_t i = 0; i < samples.size(); ++i) {
        const bool keep = off[i] <= kOutlier_sd * scatter_N;
        changed |= keep != kept[i];
        kept[i] = keep;
      }
      if (!changed) break;
    }
    for (size_t i = 0; i < samples.size(); ++i) judged[i] += !kept[i];
  }
  const auto is_outlier = [&](size_t i) { return is_used(samples[i]) && judged[i] == signals.size(); };
  size_t outliers = 0;
  for (size_t i = 0; i < samples.size(); ++i) outliers += is_outlier(i);
  if (static_cast<double>(outliers) > kMostOutliers * static_cast<double>(count)) return;
  for (size_t i = 0; i < samples.size(); ++i)
    if (is_outlier(i)) samples[i].left_out = LeftOut::Outlier;
}

}  // namespace palpate
