// Errors and intervals of Young's modulus, nothing timed.
#include "perf/lab/bench/bench.h"

#include <cmath>
#include <vector>

#include "engine/base/text.h"
#include "perf/lab/say.h"
#include "perf/lab/study/modulus_trials.h"
#include "viz/report/plot.h"

namespace palpate::perf {

std::map<std::string, std::string> modulus_study(gpu::Context& context, const std::filesystem::path& out,
                                                 int seeds) {
  constexpr int kModuli = 13, kPresses = 6, kNodes = 50;
  std::vector<ModulusTrial> trials, paper;
  for (const SampleShape shape : {SampleShape::Cube, SampleShape::Cylinder, SampleShape::Sphere}) {
    for (int i = 0; i < kModuli; ++i)
      for (int seed = 1; seed <= seeds; ++seed) {
        const double young_MPa = 0.005 * std::pow(1000, i / (kModuli - 1.0));
        for (ModulusTrial& t : modulus_trial(
                 context, shape, young_MPa,
                 uint64_t{100} * static_cast<uint64_t>(seed) + static_cast<uint64_t>(i), kPresses, kNodes))
          trials.push_back(std::move(t));
      }
    say(text("%s done\n", to_string(shape)));
  }
  for (int seed = 1; seed <= 10; ++seed)
    for (ModulusTrial& t :
         modulus_trial(context, SampleShape::Cube, 0.103, {0.8, 1.0}, static_cast<uint64_t>(seed), kNodes))
      paper.push_back(std::move(t));
  say(text("%s\nthe paper's case, a cube of 103 kPa at 0.8 and 1.0 N, ten times:\n",
           scores_text(trials).c_str()));
  for (const bool stage : {true, false}) {
    std::vector<ModulusTrial> some;
    for (const ModulusTrial& t : paper)
      if (t.stage == stage) some.push_back(t);
    const ModulusScore s = score(some, 0.01, 1);
    say(text("  stage %s: %zu of %zu valid, median error %.1f %%, 90th percentile %.1f %%, inside %zu\n",
             stage ? "known" : "not known", s.valid, s.trials, 100 * s.median, 100 * s.ninety, s.inside));
  }
  std::string written;
  if (!out.empty()) draw_plot(trials_plot(trials), out / "trials", written);
  return {{"trials.csv", trials_csv(trials)},
          {"cl2000x.csv", trials_csv(paper)},
          {"scores.txt", scores_text(trials)}};
}

}  // namespace palpate::perf
