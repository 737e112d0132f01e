// Training of a lump network: data, options and report.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/stop.h"
#include "engine/fem/scene.h"
#include "engine/lump/network/network.h"

namespace palpate::lump {

/// A block whose lump is known.
struct Example {
  bool lump = true;
  InclusionShape shape = InclusionShape::Sphere;
  bool along_y = false;                                   ///< long shapes: their long axis is y
  double size_mm = 0, depth_mm = 0, stiffness_ratio = 1;  ///< size as in Estimate
  std::array<double, 2> offset_mm{};
  std::array<double, 3> block_mm = {40, 40, 20};
  double young_Pa = 4000;
  std::optional<fem::Skin> skin;  ///< over the tissue, part of its thickness
  bool plate_sticks = false;      ///< see fem::Scene
  double plate_friction = 0;
  double cell_mm = 1.25;  ///< of the grid that it was solved on, along x
  bool aside = false;     ///< intervals are calibrated on it, nothing is learnt; none: on one in four
  std::vector<PressureMap> pressure_Pa;
  std::vector<double> force_N, press_mm;
};

struct TrainingOptions {
  uint64_t seed = 1;
  uint32_t ensemble = 4;           ///< emulators whose mean is used
  uint32_t hidden = 192;           ///< width of both hidden layers
  uint32_t fields = 40;            ///< that a bump is a sum of
  uint32_t rounds = 500;           ///< through the examples
  double decay = 0.005;            ///< of weights, against what only a few examples say
  uint32_t observations = 200000;  ///< that the emulator makes for the network from observations to lumps
  uint32_t readers = 2;            ///< such networks, whose mean is used
  uint32_t reader_hidden = 256;    ///< width of their hidden layers
  uint32_t reader_rounds = 20;     ///< through those observations
  uint32_t components = 48;        ///< in which bumps differ, for their inputs
  uint32_t trials = 200;  ///< observations per noise and number of loads that intervals are calibrated on
  std::string made_from;  ///< one line for people that the network keeps: data, cases
  uint32_t threads = 0;   ///< 0: one per core
  /// Told what is being done and how much of all is; false: stop (train_lumps() throws Stopped then).
  std::function<bool(const std::string& what, double fraction)> progress = {};
};

struct TrainingReport {
  uint32_t lumps = 0, no_lumps = 0, left_out = 0;  ///< examples; left out: without a single load
  double base_error = 0;                           ///< RMS, fraction of the mean pressure
  double fields_error = 0;  ///< RMS of what the fields miss, fraction of the peak pressure
  /// RMS of the emulators' mean over the patch on blocks that were kept aside, fraction of the peak pressure.
  double network_error = 0;
  double network_error_seen = 0;  ///< the same on cases that it learnt from
  uint32_t kept_aside = 0;        ///< blocks with a lump that only the calibration sees
  double mean_error = 0;          ///< the same as network_error, median over the blocks
  double error_over_spread = 0;   ///< see Model
  double inverse_loss = 0;        ///< mean of -log likelihood, see train_inverse_network()
};

}  // namespace palpate::lump
