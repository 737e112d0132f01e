// The inverse of the forward model by trained networks: pressure maps in, the lump behind them out, in a few
// milliseconds.
//
// Two kinds of network serve each other. The emulator learns the forward way from pressed blocks: from a
// lump, the tissue's thickness and the load to the bump that the lump makes. The inverse network learns the
// way back from any number of observations that the emulator makes, with noise and windows of all kinds, and
// says how sure it is. Refined answers go on from the inverse network's by least squares through the emulator
// with the observation's own noise.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "engine/lump/observation/observation.h"

namespace palpate::lump {

struct Model;

/// How far a method is trusted at a number of loads and a noise (fraction of the peak).
struct CalibrationRow {
  Method method{};
  uint32_t loads = 0;
  double noise_fraction = 0;
  std::array<double, 3> inflation{};     ///< of the intervals of size, depth, ratio, so that they hold
  double log_likelihood_ratio = 0;       ///< that one in 100 observations without a lump reaches
  double misfit = 0;                     ///< that three in 100 observations with a lump exceed, see Inference
  std::array<double, 3> median_error{};  ///< of size, depth, ratio on what was kept aside, share
  double shape_rate = 0;                 ///< of shapes there that were right
};

class Network {
 public:
  explicit Network(std::shared_ptr<const Model> model) : model_(std::move(model)) {}

  /// The one that comes with the program.
  static const Network& built_in();
  /// Throws Error(Failure::Input) for a file that is no such network, of another version or damaged.
  static Network read(const std::filesystem::path& file);
  /// All bytes of such a file; `name` is for messages.
  static Network parse(const std::string& bytes, const std::string& name);
  std::string bytes() const;

  /// Estimates the lump behind an observation. Throws Error(Failure::Usage) where the observation's parts do
  /// not fit each other (see observation.h); an observation that allows no estimate gets a verdict instead.
  Estimate estimate(const Observation& observation, Method method = Method::Refined) const;

  const Model& model() const { return *model_; }
  std::shared_ptr<const Model> shared_model() const { return model_; }
  /// One line for people: data, cases, seed.
  std::string made_from() const;
  std::vector<CalibrationRow> calibration() const;

 private:
  std::shared_ptr<const Model> model_;
};

}  // namespace palpate::lump
