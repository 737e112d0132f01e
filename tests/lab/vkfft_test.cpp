// VkFFT as a rival: it solves the same equations.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/numeric/poisson_dct.h"
#include "perf/rivals/vkfft_poisson.h"

namespace palpate {
namespace {

TEST(VkfftPoisson, SolvesWhatTheProcessorSolves) {
  gpu::Context context({});  // without validation, which VkFFT does not pass
  for (const auto& [width, height] : {std::pair{64u, 48u}, {120u, 91u}, {640u, 480u}}) {
    SCOPED_TRACE(width);
    std::vector<float> right(size_t{width} * height), wanted(right.size());
    std::mt19937 random(1);
    for (float& f : right) f = std::normal_distribution<float>(0, 1)(random);
    PoissonDct(width, height).solve(right.data(), wanted.data(), width);
    perf::VkfftPoisson vkfft(context, width, height);
    vkfft.set_right_side(right);
    gpu::Commands commands(context);
    commands.begin();
    vkfft.record(commands);
    commands.end();
    commands.submit();
    commands.wait();
    const std::vector<float> z = vkfft.heights();
    float largest = 0, error = 0;
    for (size_t i = 0; i < z.size(); ++i) {
      largest = std::max(largest, std::abs(wanted[i]));
      error = std::max(error, std::abs(z[i] - wanted[i]));
    }
    EXPECT_LT(error, 1e-4f * largest);
  }
}

}  // namespace
}  // namespace palpate
