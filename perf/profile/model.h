// The time of a frame on a GPU that is not there, from what its compiler makes of the kernels and from the
// card's published figures. A model, with no measurement in it: perf/README.md states what it assumes.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "perf/profile/compiled.h"
#include "perf/profile/profile.h"

namespace palpate::perf {

/// Published figures of a card.
struct Card {
  const char* name;
  const char* family;  ///< of kFamilies
  uint32_t units;      ///< compute units
  uint32_t simds;      ///< of each
  double clock_GHz;    ///< boost
  double GB_per_s;     ///< memory
};

/// Null: none of the family is known.
const Card* card_of(const std::string& family);

/// One dispatch of a frame as it is recorded with the tuning of GPUs.
struct FrameDispatch {
  std::string stage_kernel;  ///< name of the kernel
  std::string key;           ///< kernel_key of it
  uint64_t groups = 0;
  uint32_t workgroup = 0;
  uint64_t read_bytes = 0, written_bytes = 0;
};
struct FrameWork {
  std::string reading;
  uint32_t width_px = 0, height_px = 0;
  std::vector<FrameDispatch> dispatches;
};

/// The whole frame of SurfaceSolver::Live at 640 x 480 and 1392 x 1042, gray and colour; recorded on the
/// machine's own device, nothing of it runs.
std::vector<FrameWork> frames_of_work();

/// What one dispatch takes, and why.
struct ModelledDispatch {
  FrameDispatch dispatch;
  uint64_t waves = 0;
  double memory_us = 0;   ///< its bytes at four fifths of the card's bandwidth
  double compute_us = 0;  ///< its instructions over all SIMDs
  double latency_us = 0;  ///< its rounds of waves, each as long as one wave
  double total_us = 0;    ///< the largest of these and what a dispatch costs
};
struct ModelledFrame {
  FrameWork work;
  std::vector<ModelledDispatch> dispatches;
  double total_us = 0;
};
std::vector<ModelledFrame> model(const Card& card, const std::vector<CompiledKernel>& kernels,
                                 const std::vector<FrameWork>& frames);

/// As a profile whose machine is of the kind "modelled".
Profile to_profile(const Card& card, const std::vector<ModelledFrame>& frames);
Table table_of(const Card& card, const std::vector<ModelledFrame>& frames);
std::string to_csv(const std::map<std::string, std::vector<ModelledFrame>>& cards);

}  // namespace palpate::perf
