// Benchmarks of the other observations of gels: the skin's pattern and the sum of gradients.
#include "perf/tools/bench.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "capture/synthetic/synthetic.h"
#include "engine/gpu/commands.h"
#include "engine/stages/gradient.h"
#include "engine/stages/skin.h"
#include "perf/rivals/gradient_rival.h"
#include "perf/rivals/skin_rival.h"

namespace palpate::perf {

void Bench::skin(const Size& size, const char* pattern) {
  const SyntheticOptions options =
      parse_synthetic("synthetic:twist?size=" + size.text() + "&skin=" + pattern + "&mode=gel");
  const SyntheticSensor source(options);
  const Sensor sensor = synthetic_sensor(options);
  const Frame untouched = *source.own_background();
  Skin stage(context_, sensor, source.format());
  stage.set_background(untouched);
  std::vector<std::array<float, 2>> points;
  for (const SkinTemplate& t : stage.templates()) points.push_back(t.centre);
  const auto side_px = static_cast<int>(2 * stage.window().reach_px() + 1);
  OpenCvSkin rival(untouched, points, side_px);

  std::vector<Frame> frames;
  std::vector<PaddedImage> images;
  std::vector<gpu::Commands> commands;
  const gpu::DeviceBuffer records(context_, "records", stage.record_bytes(), gpu::Memory::Readback);
  constexpr uint64_t kFirst = 45, kFrames = 40;
  for (uint64_t k = 0; k < kFrames; ++k) {
    source.render(kFirst + k, frames.emplace_back());
    images.emplace_back(context_, "frame", source.format()).write(frames.back());
    gpu::Commands& one = commands.emplace_back(context_);
    one.begin();
    images.back().record(one);
    one.barrier();
    stage.record(one, images.back(), records);
    one.host_barrier();
    one.end();
  }
  // There and back: the skin never jumps.
  const auto place = [](size_t turn) {
    return turn % (2 * kFrames) < kFrames ? turn % kFrames : kFrames - 1 - turn % kFrames;
  };
  size_t turn = 0, rival_turn = 0;
  const auto follow = [&] {
    gpu::Commands& one = commands[place(turn++)];
    one.submit();
    one.wait();
    records.invalidate();
  };
  add(compare(
      std::string("skin (") + pattern + ", " + std::to_string(points.size()) + ")", size.text(),
      {"palpate", follow},
      {"calcOpticalFlowPyrLK", [&] { sink_ += double{rival.follow(frames[place(rival_turn++)])[0][0]}; }},
      repetitions_, inner(size, 8)));
  double ours = 0, theirs = 0, ours_count = 0, theirs_count = 0;
  for (turn = rival_turn = 0; turn < kFrames;) {
    const uint64_t sequence = kFirst + turn;
    follow();
    const auto motions = records.as<const Skin::Motion>();
    const auto& places = rival.follow(frames[place(rival_turn++)]);
    for (size_t i = sequence % 31; i < points.size(); i += 31) {
      const auto truth = source.skin_shift_px(sequence, double{points[i][0]}, double{points[i][1]});
      const auto square = [&](double x, double y) {
        return (std::pow(x - truth[0], 2) + std::pow(y - truth[1], 2)) / 2;
      };
      if (motions[i].correlation > 0) {
        ours += square(double{motions[i].shift_x_px}, double{motions[i].shift_y_px});
        ++ours_count;
      }
      if (places[i][0] == places[i][0]) {
        theirs +=
            square(double{places[i][0]} - double{points[i][0]}, double{places[i][1]} - double{points[i][1]});
        ++theirs_count;
      }
    }
  }
  std::printf("  RMS error of one component: palpate %.3f px, calcOpticalFlowPyrLK %.3f px\n",
              std::sqrt(ours / ours_count), std::sqrt(theirs / theirs_count));
}

void Bench::gradient(const Size& size) {
  Scene scene = scene_for(size, SyntheticMode::Gel);
  const FrameFormat& format = scene.background.format;
  const Gradient stage(context_, scene.sensor, format);
  const OpenCvGradient rival(scene.background);
  const gpu::DeviceBuffer sums(context_, "sums", stage.record_bytes(), gpu::Memory::Readback);
  PaddedImage rest(context_, "background", format), image(context_, "frame", format);
  rest.write(scene.background);
  const Frame& frame = scene.next();
  image.write(frame);
  gpu::Commands upload(context_), commands(context_);
  upload.begin();
  rest.record(upload);
  image.record(upload);
  upload.end();
  upload.submit();
  upload.wait();
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
  std::printf("  sums %.1f and %.1f gray levels x px\n", ours, theirs);
}

}  // namespace palpate::perf
