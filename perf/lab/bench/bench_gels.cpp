// Benchmarks of the other observations of gels: the skin's pattern and the sum of gradients.
#include "perf/lab/bench/bench.h"

#include <array>
#include <cmath>
#include <vector>

#include "capture/synthetic/synthetic.h"
#include "engine/base/text.h"
#include "engine/gpu/commands.h"
#include "engine/stages/frame/gradient.h"
#include "perf/lab/rivals/gradient_rival.h"
#include "perf/lab/rivals/skin_run.h"
#include "perf/lab/say.h"

namespace palpate::perf {

void Bench::skin(const Size& size, const char* pattern) {
  SkinRun run(context_, size.text(), pattern);
  add(compare(std::string("skin (") + pattern + ", " + std::to_string(run.points()) + ")", size.text(),
              {"palpate", [&] { run.follow(); }}, {"calcOpticalFlowPyrLK", [&] { run.rival_follow(); }},
              repetitions_, inner(size, 8)));
  const auto [ours_px, theirs_px] = run.errors_px();
  say(text("  RMS error of one component: palpate %.3f px, calcOpticalFlowPyrLK %.3f px\n", ours_px,
           theirs_px));
}

void Bench::gradient(const Size& size) {
  Scene scene = scene_for(size, SyntheticMode::Gel);
  const FrameFormat& format = scene.background.format;
  const Gradient stage(context_, scene.sensor, format, default_tuning(context_));
  const OpenCvGradient rival(scene.background);
  const gpu::DeviceBuffer sums(context_, "sums", stage.record_bytes(), gpu::Memory::Readback);
  PaddedImage rest(context_, "background", format), image(context_, "frame", format);
  rest.write(scene.background);
  const Frame& frame = scene.next();
  image.write(frame);
  gpu::run_once(context_, [&](gpu::Commands& upload) {
    rest.record(upload);
    image.record(upload);
  });
  gpu::Commands commands(context_);
  commands.begin();
  stage.record(commands, image, rest, sums);
  commands.host_barrier();
  commands.end();
  double ours = 0, theirs = 0;
  const auto sum = [&] {
    commands.submit();
    commands.wait();
    sums.invalidate();
    ours = static_cast<double>(stage.sum(sums.as<const uint32_t>())) / shared::kGradientUnits;
  };
  const double limit = scene.sensor.gradient_gray_per_px;
  add(compare("gradient", size.text(), {"palpate", sum},
              {"OpenCV Sobel", [&] { theirs = rival.run(frame, limit); }}, repetitions_, inner(size, 10)));
  say(text("  sums %.1f and %.1f gray levels x px\n", ours, theirs));
}

}  // namespace palpate::perf
