// palpate_depth_loop SCENE FRAMES: a C++ program's loop over measured frames with their depth maps, beside
// which perf/tools/python_overhead puts the Python module's.
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <memory>

#include "capture/open_source.h"
#include "capture/run/input.h"
#include "capture/run/run_recording.h"
#include "engine/base/clock.h"
#include "engine/gpu/context.h"

namespace {

using namespace palpate;

double thread_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void run(const char* scene, uint64_t frames) {
  const MeasuredInput input = find_input(1, scene, std::optional<Sensor>(), {});
  gpu::Context context({});
  const std::unique_ptr<Source> source = open_source(input.input, input.sensor);
  Pipeline pipeline(context, for_rectified_frames(input.sensor), source->format(),
                    {.outputs = input.outputs, .slots = 4});
  pipeline.set_background(load_background(input.input, input.sensor, *source));
  double reading_s = 0, sum_mm = 0;
  const int64_t start_ns = monotonic_ns();
  const uint64_t done = run_recording(*source, pipeline, frames, {}, [&](const Result& result, const Frame&) {
    const double before_s = thread_cpu_s();
    sum_mm += double{result.depth_mm()[0]};
    reading_s += thread_cpu_s() - before_s;
  });
  const double wall_s = 1e-9 * static_cast<double>(monotonic_ns() - start_ns);
  std::printf("{\"frames\": %llu, \"wall_ms\": %.4f, \"reading_us\": %.3f, \"sum_mm\": %.3f}\n",
              static_cast<unsigned long long>(done), 1e3 * wall_s / static_cast<double>(done),
              1e6 * reading_s / static_cast<double>(done), sum_mm);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: palpate_depth_loop SCENE FRAMES\n");
    return 2;
  }
  try {
    run(argv[1], std::strtoull(argv[2], nullptr, 10));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "palpate_depth_loop: %s\n", error.what());
    return 1;
  }
  return 0;
}
