// The steps of training, each by itself.
#pragma once

#include <functional>
#include <vector>

#include "engine/lump/network/model.h"
#include "perf/lab/training/options.h"

namespace palpate::lump {

/// The part of several that an example is in. Scrambled: a sweep's neighbours are far apart in turn.
inline size_t part_of(size_t example, size_t parts) {
  return ((example + 1) * 0x9e3779b97f4a7c15ULL >> 40) % parts;
}

/// Ideal observations of the examples, in their order. Examples of coarser grids than the finest train the
/// emulator only, which has the cell size as an input: many cheap blocks show how bumps change, a few fine
/// ones what their level is.
struct Examples {
  std::vector<Example> examples;  ///< without their maps
  std::vector<Observation> observations;
  double finest_mm = 0;  ///< cells
  bool unseen = false;   ///< none of them was used in training
  bool told = false;     ///< which ones are kept aside

  bool finest(size_t i) const { return examples[i].cell_mm < finest_mm * 1.001; }
  /// Kept out of training, so that intervals are calibrated on it: one in four, unless told.
  bool aside(size_t i) const {
    if (told) return examples[i].aside;
    return finest(i) && (unseen || ((i + 1) * 0xd1b54a32d192ed03ULL >> 33) % 4 == 0);
  }
};

/// The base fitted to the examples without a lump for which `used` is true.
Base fit_base(const Model& model, const Examples& all, const std::function<bool(size_t)>& used);

/// The fields that bumps are best made of. `missed`: RMS fraction of the peak that they miss.
Patch fit_patch(const Model& model, const Examples& all, uint32_t count, uint64_t seed, double& missed);

/// The emulator: fills members, scales, discrepancy and correlation.
void train_ensemble(Model& model, const Examples& all, const TrainingOptions& options,
                    TrainingReport& report);

/// The network from observations to lumps: fills the inverse network. Returns its loss at the end: the mean
/// of -log likelihoods of shape, logarithms (in units of InverseNetwork::scale) and shift (mm).
double train_inverse_network(Model& model, const TrainingOptions& options);

/// Fills the tables of calibration from observations of examples that were kept aside.
void calibrate(Model& model, const Examples& all, const TrainingOptions& options);

/// Calls work(i) for i in [0, count) on `threads` threads (0: one per core).
void in_parallel(uint32_t threads, size_t count, const std::function<void(size_t)>& work);

}  // namespace palpate::lump
