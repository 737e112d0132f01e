// The steps of training, each by itself.
#pragma once

#include <functional>
#include <vector>

#include "engine/lump/network/model.h"
#include "engine/lump/training/options.h"

namespace palpate {

/// The part of several that an example is in. Scrambled: a sweep's neighbours are far apart in turn.
inline size_t part_of(size_t example, size_t parts) {
  return ((example + 1) * 0x9e3779b97f4a7c15ULL >> 40) % parts;
}

/// One example in six teaches nothing: intervals are calibrated on it.
inline bool kept_aside(size_t example) {
  return ((example + 1) * 0xd1b54a32d192ed03ULL >> 33) % 6 == 0;
}

/// Ideal readings of the examples, in their order.
struct LumpExamples {
  std::vector<LumpExample> examples;  ///< without their maps
  std::vector<LumpReading> readings;
};

/// The base fitted to the examples without a lump for which `used` is true.
LumpBase fit_base(const LumpModel& model, const LumpExamples& all, const std::function<bool(size_t)>& used);

/// The fields that bumps are best made of. `missed`: RMS share of the peak that they miss.
LumpPatch fit_patch(const LumpModel& model, const LumpExamples& all, uint32_t count, uint64_t seed,
                    double& missed);

/// The emulator: fills members, scales, discrepancy and correlation.
void train_members(LumpModel& model, const LumpExamples& all, const LumpTrainingOptions& options,
                   LumpTrainingReport& report);

/// The network from readings to lumps: fills the reader. Returns its loss at the end: the mean of -log
/// likelihoods of shape, logarithms (in units of LumpReader::scale) and shift (mm).
double teach_reader(LumpModel& model, const LumpTrainingOptions& options);

/// Fills the tables of trust from readings of examples that were kept aside.
void calibrate(LumpModel& model, const LumpExamples& all, const LumpTrainingOptions& options);

/// Calls work(i) for i in [0, count) on `threads` threads (0: one per core).
void in_parallel(uint32_t threads, size_t count, const std::function<void(size_t)>& work);

}  // namespace palpate
