// Choice of the signal and the curve that measure force best, judged on presses that the fit did not see.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/calibrate/force/samples.h"

namespace palpate {

struct ForceChoiceOptions {
  std::optional<ForceSignal> signal{};
  std::optional<ForceModel> model{};
  std::optional<bool> branches{};
  std::function<bool()> stopped{};  ///< asked before each fit; true ends the choice
};

/// One candidate on presses (or stretches of time) that it was not fitted to.
struct CandidateScore {
  ForceCandidate candidate;
  double error_N = 0;     ///< mean absolute, of readings held out
  double worse_N = 0;     ///< than the best eligible candidate's, mean over the blocks
  double worse_sd_N = 0;  ///< standard error of that
  bool eligible = true;   ///< false: shown to compare only, see choose_force
  std::string refused;    ///< why it could not be fitted; empty: it was
};

struct BranchLine {
  ForceCurve curve;
  double r_squared = 0;
  size_t readings = 0;
};

struct ForceChoice {
  bool stopped = false;  ///< before all candidates were tried: nothing was chosen
  ForceCalibration calibration;
  CandidateScore chosen;
  std::vector<CandidateScore> scores;  ///< simplest first
  size_t blocks = 0;                   ///< that were held out one after the other
  const char* blocks_are = "";         ///< "objects", "recordings", "presses", "stretches of time"
  bool objects_left_out = false;       ///< no error is of an object that its fit saw
  bool days_left_out = false;          ///< nor of its day

  size_t readings = 0;        ///< used by the fit
  double residual_rms_N = 0;  ///< of the calibration on them
  double largest_residual_N = 0;
  double held_out_rms_N = 0;
  double interval_coverage = 0;  ///< fraction of held-out readings within their 95 % interval, whose width
                                 ///< was found without their block
  double interval_full_N = 0;    ///< half the 95 % interval at full scale
  /// The paper's lines of the chosen signal: both directions together, loading, unloading (those with too few
  /// readings are missing).
  BranchLine line;
  std::optional<BranchLine> loading, unloading;
  bool has_hysteresis = false;   ///< both directions were seen over a common range
  double hysteresis_signal = 0;  ///< where the largest difference lies
  double drift_sd_N_per_min =
      0;  ///< standard error of calibration.drift_N_per_min; NaN: times not known, or too short
  std::vector<double> unloading_fraction;  ///< of each sample, 0 to 1, in the chosen signal
  std::vector<double> held_out_N;  ///< of each sample: predicted by a fit without its block; NaN: none
};

/// Marks outliers in `samples` (readings further than six robust scatters from a flexible curve of every
/// signal), tries each candidate on blocks held out, and takes the simplest that is not worse than the best
/// by more than a standard error (or 3 % of its error). Order of simplicity: the layer's scale
/// (where there is a layer), line, power, spline; together, apart; gradient (where it was measured), gray
/// sum, area, volume. Throws Error(Failure::Input) where too few readings are left, with what left them out,
/// or where the fixed signal is not there. Taken only where asked for, or where what they depend on was held
/// out: area, volume, and bending beside the layer (shape: objects); on a gel with a layer all but the two by
/// the layer (the day's light: objects and days).
ForceChoice choose_force(std::vector<ForceSample>& samples, const ForceChoiceOptions& options);

}  // namespace palpate
