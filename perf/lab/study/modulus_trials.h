// Trials of the modulus estimate on samples of known modulus under the simulated sensor: error, width and
// coverage of the intervals.
#pragma once

#include <string>
#include <vector>

#include "capture/synthetic/modulus_press.h"
#include "engine/elasticity/modulus/modulus.h"
#include "viz/report/plot.h"

namespace palpate {
namespace gpu {
class Context;
}
}  // namespace palpate

namespace palpate::perf {

/// One estimate of one press of one sample.
struct ModulusTrial {
  SampleShape shape = SampleShape::Cube;
  bool stage = false;  ///< the approach was known, without its zero
  double truth_MPa = 0;
  double force_max_N = 0;
  ModulusAnswer answer;

  bool valid() const { return answer.best().state == ModulusState::Valid; }
  double error() const { return answer.best().young_MPa / truth_MPa - 1; }
  bool inside() const { return answer.best().low_MPa <= truth_MPa && truth_MPa <= answer.best().high_MPa; }
};

/// Pad that the sample is pressed against, and its light.
struct ModulusBench {
  double pad_thickness_mm = SyntheticOptions{}.pad_thickness_mm;
  double brightness = ModulusScene{}.brightness;
};

/// `presses` from a fifth of the largest force up, on a pad whose modulus (1 %), a sample whose size (0.5 %)
/// and a stage whose zero (0.1 mm) are drawn by `seed`; then estimated with these errors stated, beside the
/// stage and without it. `nodes`: of the finite elements' face.
std::vector<ModulusTrial> modulus_trial(gpu::Context& context, SampleShape shape, double young_MPa,
                                        uint64_t seed, int presses, int nodes,
                                        const ModulusBench& bench = {});
/// At forces chosen.
std::vector<ModulusTrial> modulus_trial(gpu::Context& context, SampleShape shape, double young_MPa,
                                        const std::vector<double>& forces_N, uint64_t seed, int nodes,
                                        const ModulusBench& bench = {});

/// Error and coverage over trials.
struct ModulusScore {
  size_t trials = 0, valid = 0, inside = 0;
  double median = 0, ninety = 0;       ///< of the absolute error of valid ones, as a fraction
  size_t bounds = 0, bounds_hold = 0;  ///< pad-limited ones, and those whose bound holds
};
ModulusScore score(const std::vector<ModulusTrial>& trials, double from_MPa, double to_MPa);

std::string trials_csv(const std::vector<ModulusTrial>& trials);
/// Rows of shape, stage, range with the score.
std::string scores_text(const std::vector<ModulusTrial>& trials);
/// Estimates over truths with their intervals, for gnuplot.
Plot trials_plot(const std::vector<ModulusTrial>& trials);

}  // namespace palpate::perf
