#include "perf/profile/outputs.h"

#include <deque>
#include <utility>

#include "engine/gpu/context.h"
#include "palpate/pipeline.h"
#include "perf/profile/frames.h"

namespace palpate::perf {
namespace {

constexpr size_t kLeastChoices = 2;

struct Choice {
  std::string outputs;
  SurfaceReading reading = SurfaceReading::None;
  double touched_fraction = 1;
  PipelineOptions options;
};

PipelineOptions options_for(Outputs outputs, SurfaceSolver solver = SurfaceSolver::Live,
                            SolveBy by = SolveBy::Auto) {
  return {.outputs = outputs, .solver = solver, .solve_by = by};
}

/// The first choice of each reading is its full frame.
std::vector<Choice> choices_for(SurfaceReading reading) {
  const Outputs all = Output::Force | Output::Surface;
  PipelineOptions one_slot = options_for(all);
  one_slot.slots = 1;
  std::vector<Choice> choices{
      {"force + surface", reading, 1, options_for(all)},
      {"force only", reading, 1, options_for(Output::Force)},
      {"force + surface (10 % touched)", reading, 0.1, options_for(all)},
      {"force only (10 % touched)", reading, 0.1, options_for(Output::Force)},
      {"force + surface (one frame in flight)", reading, 1, one_slot},
      {"force + surface (best, host)", reading, 1, options_for(all, SurfaceSolver::Best, SolveBy::Host)}};
  if (reading == SurfaceReading::Elastic) return choices;  // a convolution: no cycles, no weights
  choices.push_back(
      {"force + surface (best, device)", reading, 1, options_for(all, SurfaceSolver::Best, SolveBy::Device)});
  choices.push_back({"force + surface + confidence", reading, 1, options_for(all | Output::Confidence)});
  for (const auto& [by, name] : {std::pair{SolveBy::Host, "host"}, {SolveBy::Device, "device"}})
    choices.push_back({std::string("force + surface + motion (") + name + ")", reading, 1,
                       options_for(all | Output::Motion, SurfaceSolver::Live, by)});
  return choices;
}

}  // namespace

void measure_outputs(const gpu::ContextOptions& device, const FrameSize& size, double seconds,
                     const Watch& watch, Profile& profile) {
  gpu::Context context(device);
  const double end_s = wall_now_s() + seconds;
  const SurfaceReading readings[] = {SurfaceReading::Shading, SurfaceReading::Photometric,
                                     SurfaceReading::Elastic};
  double last_s = 0;
  for (size_t r = 0; r < std::size(readings); ++r) {
    const SurfaceReading reading = readings[r];
    const std::string what = std::string("cost of outputs, ") + to_string(reading);
    const double begin_s = wall_now_s(), left_s = std::max(0.0, end_s - begin_s);
    if (r > 0 && left_s < last_s / 2) {
      skip(what, watch, profile);
      continue;
    }
    const std::vector<Choice> group = choices_for(reading);
    std::deque<Scene> scenes;
    std::deque<Pipeline> pipelines;
    std::vector<Contender> contenders;
    for (const Choice& choice : group) {
      // A whole frame and one without its surface, whatever the time.
      if (contenders.size() >= kLeastChoices && wall_now_s() > end_s) {
        skip(what + ", all but the first " + std::to_string(kLeastChoices), watch, profile);
        break;
      }
      Scene& scene = scenes.emplace_back(
          timing_scene(size.width_px, size.height_px, choice.reading, choice.touched_fraction));
      Pipeline& pipeline =
          pipelines.emplace_back(context, scene.sensor, scene.background.format, choice.options);
      pipeline.set_background(scene.background);
      contenders.push_back({choice.outputs, [&] { pipeline.process(scene.next()); }});
    }
    if (!take_turns(contenders, {3, 200, left_s / static_cast<double>(std::size(readings) - r)}, watch))
      return;
    for (size_t i = 0; i < contenders.size(); ++i) {
      std::vector<double> ratios;
      for (size_t round = 0; round < contenders[i].cpu_ms.size(); ++round)
        ratios.push_back(contenders[i].cpu_ms[round] / contenders[0].cpu_ms[round]);
      OutputFigure figure;
      figure.outputs = group[i].outputs;
      figure.reading = to_string(reading);
      figure.width_px = size.width_px;
      figure.height_px = size.height_px;
      figure.touched_fraction = group[i].touched_fraction;
      figure.time = distribution_of(contenders[i].wall_ms);
      figure.cpu_ms = quantile(contenders[i].cpu_ms, 0.5);
      figure.cpu_ratio = quantile(ratios, 0.5);
      figure.cpu_ratio_q25 = quantile(ratios, 0.25);
      figure.cpu_ratio_q75 = quantile(ratios, 0.75);
      figure.memory_bytes = pipelines[i].memory_bytes();
      profile.outputs.push_back(std::move(figure));
    }
    last_s = wall_now_s() - begin_s;
    watch.say(what + ": done");
  }
  watch.leave(context);
}

}  // namespace palpate::perf
