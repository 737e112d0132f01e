// Errors and intervals of Young's modulus, nothing timed.
#include "perf/tools/bench.h"

#include <cmath>
#include <cstdio>
#include <vector>

#include "capture/files/output_file.h"
#include "perf/rivals/modulus_trials.h"
#include "viz/report/plot_script.h"

namespace palpate::perf {

void modulus_study(gpu::Context& context, const std::string& out, int seeds) {
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
    std::printf("%s done\n", to_string(shape));
    std::fflush(stdout);
  }
  for (int seed = 1; seed <= 10; ++seed)
    for (ModulusTrial& t :
         modulus_trial(context, SampleShape::Cube, 0.103, {0.8, 1.0}, static_cast<uint64_t>(seed), kNodes))
      paper.push_back(std::move(t));
  std::printf("%s\nthe paper's case, a cube of 103 kPa at 0.8 and 1.0 N, ten times:\n",
              scores_text(trials).c_str());
  for (const bool stage : {true, false}) {
    std::vector<ModulusTrial> some;
    for (const ModulusTrial& t : paper)
      if (t.stage == stage) some.push_back(t);
    const ModulusScore s = score(some, 0.01, 1);
    std::printf("  stage %s: %zu of %zu valid, median error %.1f %%, 90th percentile %.1f %%, inside %zu\n",
                stage ? "known" : "not known", s.valid, s.trials, 100 * s.median, 100 * s.ninety, s.inside);
  }
  if (out.empty()) return;
  write_whole(out + "/trials.csv", std::string_view(trials_csv(trials)));
  write_whole(out + "/cl2000x.csv", std::string_view(trials_csv(paper)));
  write_whole(out + "/scores.txt", std::string_view(scores_text(trials)));
  std::string written;
  draw_plots([&](PlotKind kind) { return trials_script(trials, kind); }, out + "/trials", written);
}

}  // namespace palpate::perf
