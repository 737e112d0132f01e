// Readings with a gauge, the branch that each is on, and the curves through some of them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/calibrate/force/fit.h"
#include "engine/measure/force.h"

namespace palpate {

/// Why a reading with a gauge does not count.
enum class LeftOut : uint8_t { Used, NoGauge, Saturated, AtBorder, Outlier };
const char* to_string(LeftOut left_out);

/// One touched frame of a calibration, with the gauge's force. In order, recording after recording, all
/// frames of a press in a row, also those left out: the branch follows from the frames before.
struct ForceSample {
  ForceFeatures features;
  double force_N = 0;  ///< gauge; NaN: none
  double time_s = 0;   ///< since its recording began; NaN: not known
  uint64_t frame = 0;  ///< of its recording
  uint32_t recording = 0;
  uint32_t press = 0;  ///< from 0 over all recordings
  /// What is pressed, of all recordings or of none: then each recording is taken as an object of its own.
  std::optional<uint32_t> object{};
  uint32_t day = 0;  ///< recordings made under the same light
  LeftOut left_out = LeftOut::Used;
};

/// A signal and a curve to try.
struct ForceCandidate {
  ForceSignal signal = ForceSignal::GraySum;
  ForceModel model = ForceModel::Line;
  bool branches = false;  ///< loading and unloading apart
};
std::string to_string(const ForceCandidate& candidate);

inline bool is_used(const ForceSample& sample) {
  return sample.left_out == LeftOut::Used;
}

/// One signal of all samples, with the branch that each is on.
struct ForceTrack {
  double bending_N_per_mm = 0;  ///< ForceSignal::LayerAndBending
  std::vector<double> signal;
  std::vector<double> unloading;  ///< as LoadDirection says, 0 to 1
  double low = 0, high = 0;       ///< of the signal of used readings
  bool loads(size_t i) const;     ///< on a branch, not between the two
  bool unloads(size_t i) const;
};
/// The layer's force over the bending is found by least squares from the used samples for which `counts`
/// says so; no gauge decides it.
ForceTrack track_of(
    ForceSignal signal, std::span<const ForceSample> samples,
    const std::function<bool(size_t)>& counts = [](size_t) { return true; });

/// The curves of one candidate, fitted to some readings.
struct ForceCurves {
  ForceModel model = ForceModel::Line;
  CurveFit together;
  std::optional<CurveFit> loading, unloading;

  double at(double signal, double unloading_fraction) const;
};
/// To the used samples for which `counts` says so; of a scale each recording counts alike, for its frames err
/// alike. Throws Error(Failure::Input) where they are too few.
ForceCurves fit_curves(ForceModel model, bool branches, const ForceTrack& track,
                       std::span<const ForceSample> samples, const std::function<bool(size_t)>& counts);

/// So many objects or more are held out one after the other.
inline constexpr size_t kFewestObjects = 3;

/// The object of a sample: named, or its recording.
inline uint32_t object_of(const ForceSample& sample) {
  return sample.object.value_or(sample.recording);
}
/// Objects of the used samples.
size_t count_objects(std::span<const ForceSample> samples);

/// Groups that are held out together: objects where there are three or more, each then judged by fits that
/// never saw it, nor its day where samples of two days or more allow that; else recordings, three or more of
/// them; else presses, or with fewer than four of them stretches of their time.
struct HoldOut {
  std::vector<size_t> block;  ///< of each sample
  size_t blocks = 0;
  const char* blocks_are = "";  ///< for people
  bool objects = false;         ///< no fit saw the object that it is judged by
  bool days = false;            ///< nor its day

  /// Whether the fit that block `b` judges is made of sample `i`.
  bool teaches(size_t i, size_t b) const {
    return group_of_block_.empty() ? block[i] != b
                                   : group_[i] != group_of_block_[b] && day_[i] != day_of_block_[b];
  }

 private:
  friend HoldOut hold_out(std::span<const ForceSample>);
  bool apart_by_day(std::span<const ForceSample> samples);
  std::vector<size_t> group_, group_of_block_;  ///< of objects
  std::vector<uint32_t> day_, day_of_block_;
};
HoldOut hold_out(std::span<const ForceSample> samples);

/// Marks readings further than six robust scatters from a flexible curve of every one of the signals; none
/// where more than a tenth would be.
void mark_outliers(std::vector<ForceSample>& samples, std::span<const ForceSignal> signals);

}  // namespace palpate
