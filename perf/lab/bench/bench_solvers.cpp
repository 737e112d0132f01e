// Heights from slopes, deflection from pressure, and the forward model.
#include "perf/lab/bench/bench.h"

#include <algorithm>
#include <random>
#include <vector>

#include "capture/synthetic/synthetic.h"
#include "engine/base/text.h"
#include "engine/gpu/commands.h"
#include "engine/numeric/poisson_dct.h"
#include "engine/numeric/weighted_poisson.h"
#include "engine/pad/layer_convolution.h"
#include "engine/stages/surface/elastic.h"
#include "engine/stages/surface/surface.h"
#include "engine/stages/surface/weighted_surface.h"
#include "perf/lab/rivals/forward_rival.h"
#include "perf/lab/rivals/weighted_rival.h"
#include "perf/lab/say.h"
#include "perf/rivals/rivals.h"
#include "perf/rivals/vkfft_poisson.h"

namespace palpate::perf {

void Bench::surface(const Size& size) {
  const Surface surface(context_, size.width, size.height, Solve::Live, load_tuning(context_).tuning);
  const FloatMap depth(context_, "depth", surface.grid());
  std::vector<float> right(size_t{size.width} * size.height), z(right.size());
  std::mt19937 random(1);
  for (float& f : right) f = std::normal_distribution<float>(0, 1)(random);
  gpu::Commands commands(context_);
  commands.begin();
  surface.record(commands, depth);
  commands.end();
  const Work ours{"palpate", [&] {
                    commands.submit();
                    commands.wait();
                  }};
  FftwPoisson fftw(size.width, size.height, size.width, size.height);
  const Work rival{"FFTW", [&] { fftw.solve(right.data(), z.data()); }};
  add(compare("surface", size.text(), ours, rival, repetitions_, inner(size, 8)));
  PoissonDct dct(size.width, size.height);
  add(compare("surface (exact)", size.text(),
              {"palpate", [&] { dct.solve(right.data(), z.data(), size.width); }}, rival, repetitions_,
              inner(size, 8)));
  // As FFTW padded: the frame in the next larger size with small prime factors.
  VkfftPoisson vkfft(context_, size.padded_width, size.padded_height);
  std::vector<float> padded_right(size_t{size.padded_width} * size.padded_height);
  for (uint32_t y = 0; y < size.height; ++y)
    std::copy_n(right.begin() + size_t{y} * size.width, size.width,
                padded_right.begin() + size_t{y} * size.padded_width);
  vkfft.set_right_side(padded_right);
  gpu::Commands transforms(context_);
  transforms.begin();
  vkfft.record(transforms);
  transforms.end();
  const Work same_device{"VkFFT", [&] {
                           transforms.submit();
                           transforms.wait();
                         }};
  add(compare("surface", size.text(), ours, same_device, repetitions_, inner(size, 8)));
  if (size.padded_width == size.width && size.padded_height == size.height) return;
  FftwPoisson padded(size.width, size.height, size.padded_width, size.padded_height);
  add(compare("surface", size.text(), ours, {"FFTW padded", [&] { padded.solve(right.data(), z.data()); }},
              repetitions_, inner(size, 8)));
}

void Bench::weighted(const Size& size) {
  const size_t cells = size_t{size.width} * size.height;
  std::mt19937 random(1);
  std::vector<float> slopes(2 * cells), weights(cells);
  for (float& slope : slopes) slope = std::normal_distribution<float>(0, 1)(random);
  for (float& weight : weights) weight = random() % 10 == 0 ? 0.0f : 1.0f;
  const Surface plain(context_, size.width, size.height, Solve::Live, load_tuning(context_).tuning);
  const FloatMap depth(context_, "depth", plain.grid());
  const gpu::DeviceBuffer scalars(context_, "scalars", WeightedSurface::scalar_bytes(),
                                  gpu::Memory::Readback);
  gpu::Commands without(context_);
  without.begin();
  plain.record(without, depth);
  without.end();
  const WeightedFaces faces = weighted_faces(slopes, weights, size.width, size.height);
  for (const uint32_t iterations :
       {WeightedSurface::kLiveIterations, WeightedSurface::kConvergedIterations}) {
    const WeightedSurface surface(context_, size.width, size.height, 1, iterations);
    const auto upload = [&](const auto& value) {
      gpu::DeviceBuffer buffer(context_, "upload", surface.grid().bytes(), gpu::Memory::Upload);
      for (size_t i = 0; i < cells; ++i)
        buffer.as<float>()[i / size.width * surface.grid().pitch * 4 + i % size.width] = value(i);
      buffer.flush();
      return buffer;
    };
    const auto p = upload([&](size_t i) { return slopes[2 * i]; });
    const auto q = upload([&](size_t i) { return slopes[2 * i + 1]; });
    const auto w = upload([&](size_t i) { return weights[i]; });
    gpu::Commands with(context_);
    with.begin();
    with.copy(p, surface.slope_x().buffer, p.bytes());
    with.copy(q, surface.slope_y().buffer, q.bytes());
    with.copy(w, surface.weights().buffer, w.bytes());
    with.barrier();
    surface.record(with, depth, scalars);
    with.host_barrier();
    with.end();
    const bool live = iterations == WeightedSurface::kLiveIterations;
    const Work ours{"palpate", [&] {
                      with.submit();
                      with.wait();
                    }};
    const Work unweighted{"no weights", [&] {
                            without.submit();
                            without.wait();
                          }};
    const Work eigen{"Eigen LDLT", [&] { sink_ += solve_with_eigen(faces).front(); }};
    if (live)
      add(compare("weighted surface (live)", size.text(), ours, unweighted, repetitions_, inner(size, 8)));
    if (!live) add(compare("weighted surface (converged)", size.text(), ours, eigen, 3, 1));
    const WeightedStatistics statistics = WeightedSurface::statistics(scalars);
    say(text("  %u iterations, residual %.1e\n", statistics.iterations, statistics.residual));
  }
}

void Bench::elastic(const Size& size) {
  SyntheticOptions options;
  options.width = size.width;
  options.height = size.height;
  const Sensor sensor = synthetic_sensor(options);
  const LayerKernel kernel(pad_of(sensor.elastic), sensor.pitch_mm_per_px);
  const Elastic stage(context_, kernel, size.width, size.height, load_tuning(context_).tuning);
  const FloatMap depth(context_, "depth", stage.grid());
  std::vector<float> pressure(size_t{size.width} * size.height), deflection(pressure.size());
  std::mt19937 random(1);
  for (float& p : pressure) p = std::uniform_real_distribution<float>(0, 0.1f)(random);
  const gpu::DeviceBuffer staging(context_, "pressure", stage.pressure().bytes(), gpu::Memory::Upload);
  const std::span<float> padded = staging.as<float>();
  std::fill(padded.begin(), padded.end(), 0.0f);
  for (size_t y = 0; y < size.height; ++y)
    std::copy_n(
        pressure.begin() + static_cast<std::ptrdiff_t>(y * size.width), size.width,
        padded.begin() + static_cast<std::ptrdiff_t>(stage.pressure_start() + y * stage.pressure_pitch()));
  staging.flush();
  gpu::run_once(context_,
                [&](gpu::Commands& upload) { upload.copy(staging, stage.pressure(), staging.bytes()); });
  gpu::Commands commands(context_);
  commands.begin();
  stage.record_deflection(commands, depth);
  commands.end();
  FftwElastic fftw(kernel, size.width, size.height);
  const Work rival{"FFTW zero-padded", [&] { fftw.solve(pressure.data(), deflection.data()); }};
  add(compare("elastic", size.text(),
              {"palpate",
               [&] {
                 commands.submit();
                 commands.wait();
               }},
              rival, repetitions_, inner(size, 8)));
  LayerConvolution exact(kernel, size.width, size.height, false);
  add(compare("elastic (exact)", size.text(),
              {"palpate",
               [&] { exact.depth_by_pressure(pressure.data(), size.width, deflection.data(), size.width); }},
              rival, repetitions_, inner(size, 8)));
}

void Bench::forward(uint32_t along) {
  ForwardRival pair(context_, along);
  const int inner = std::max(1, static_cast<int>(20 * 64 * 64 * 64 / (along * along * along)));
  add(pair.product(repetitions_, inner));
  add(pair.wide_product(repetitions_, inner));
  add(pair.cycle(std::min(repetitions_, 7), 1));
  add(pair.solve(std::min(repetitions_, 5)));
  say(text("  iterations: device %u, processor %u\n", pair.device_iterations(), pair.processor_iterations()));
}

}  // namespace palpate::perf
