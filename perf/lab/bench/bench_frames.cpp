// Whole frames: to height and depth, against OpenCV and FFTW, and frames per second.
#include "perf/lab/bench/bench.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "engine/base/text.h"
#include "engine/calibrate/photometric/fit.h"
#include "engine/calibrate/photometric/polynomial.h"
#include "engine/gpu/commands.h"
#include "engine/pipeline/pipeline_access.h"
#include "perf/lab/say.h"
#include "perf/rivals/rivals.h"

namespace palpate::perf {

void Bench::frame(const Size& size, SyntheticMode mode) {
  Scene scene = scene_for(size, mode);
  const std::string work = "frame to height (" + std::string(to_string(scene.sensor.reading)) + ")";
  Pipeline pipeline = make_pipeline(scene, Output::Force | Output::Surface, SurfaceSolver::Live);
  OpenCvFftwFrame rival(scene.background, scene.sensor, size.padded_width, size.padded_height);
  add(compare(work, size.text(), {"palpate", [&] { pipeline.process(scene.next()); }},
              {"OpenCV + FFTW", [&] { sink_ += rival.run(scene.next()); }}, repetitions_, inner(size, 8)));
  stages(pipeline, scene, size, work);
}

void Bench::place_weights(const Size& size) {
  Scene scene = scene_for(size, SyntheticMode::Gel);
  Pipeline plain = make_pipeline(scene, Output::Force | Output::Surface, SurfaceSolver::Live);
  for (const NormalOrder& order : std::span(kNormalOrders).subspan(1)) {
    const int terms = photometric::places_of(std::max(order.colours, order.products));
    for (NormalWeights* weights : {&scene.sensor.photometric.wx, &scene.sensor.photometric.wy}) {
      weights->resize(order.products < 0 ? 3 : photometric::kColours);
      for (std::vector<double>& row : *weights) row.resize(static_cast<size_t>(terms), 0.01);
    }
    Pipeline with = make_pipeline(scene, Output::Force | Output::Surface, SurfaceSolver::Live);
    add(compare(std::string("weights: ") + order.name, size.text(),
                {order.name, [&] { with.process(scene.next()); }},
                {"linear", [&] { plain.process(scene.next()); }}, repetitions_, inner(size, 8)));
  }
}

void Bench::lookup(const Size& size) {
  Scene scene = scene_for(size, SyntheticMode::Lambert);
  scene.sensor.reading = SurfaceReading::Lookup;
  scene.sensor.lookup.points = {{4, 0}, {60, 0.8}, {120, 1.2}, {200, 1.5}};
  Pipeline pipeline = make_pipeline(scene, Output::Force | Output::Surface, SurfaceSolver::Live);
  add(compare("frame to depth (lookup)", size.text(), {"palpate", [&] { pipeline.process(scene.next()); }},
              {"OpenCV", [&] { sink_ += opencv_lookup(scene.next(), scene.background); }}, repetitions_,
              inner(size, 8)));
}

void Bench::throughput(const Size& size, SyntheticMode mode) {
  Scene scene = scene_for(size, mode);
  Pipeline pipeline = make_pipeline(scene, Output::Force | Output::Surface, SurfaceSolver::Live);
  constexpr int kFrames = 150;
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < kFrames; ++i) {
    while (!pipeline.submit(scene.next())) pipeline.wait();
  }
  while (pipeline.wait()) {
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  throughput_csv_ += std::string(to_string(scene.sensor.reading)) + "," + size.text() + "," +
                     std::to_string(std::lround(kFrames / seconds)) + "\n";
  say(text("throughput, %s, %s: %.1f frames/s\n", to_string(scene.sensor.reading), size.text().c_str(),
           kFrames / seconds));
}

void Bench::stages(Pipeline& pipeline, Scene& scene, const Size& size, const std::string& work) {
  if (!context_.timers()) return;
  pipeline.submit(scene.next());
  const auto result = pipeline.wait();
  say(text("  stages of %s, %s:", work.c_str(), size.text().c_str()));
  for (const gpu::ScopeTime& t : PipelineAccess::times(pipeline, *result))
    say(text(" %s %.2f ms", t.name.c_str(), t.ms));
  say("\n");
}

}  // namespace palpate::perf
