// The membrane: harmonic between what is known, which it holds.
#include "engine/numeric/membrane.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace palpate {
namespace {

class MembraneTest : public testing::Test {
 protected:
  /// Fills a disk in a map of `truth`, and returns the largest error over its range.
  static double error(uint32_t width, uint32_t height, double radius, double (*truth)(double, double)) {
    std::vector<float> values(size_t{width} * height);
    std::vector<uint8_t> known(values.size());
    double least = INFINITY, most = -INFINITY;
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x) {
        const double u = x - width / 2.0, v = y - height / 2.0, value = truth(u, v);
        const size_t cell = size_t{y} * width + x;
        known[cell] = std::hypot(u, v) > radius;
        values[cell] = known[cell] != 0 ? static_cast<float>(value) : 1e6f;
        least = std::min(least, value), most = std::max(most, value);
      }
    Membrane(width, height).fill(values, known);
    double worst = 0;
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x)
        worst = std::max(worst, std::abs(double{values[size_t{y} * width + x]} -
                                         truth(x - width / 2.0, y - height / 2.0)));
    return worst / (most - least);
  }
};

TEST_F(MembraneTest, HarmonicFunctionsAreContinued) {
  const auto plane = [](double x, double y) { return 3 + 0.2 * x - 0.1 * y; };
  const auto saddle = [](double x, double y) { return x * x - y * y + x * y; };
  for (const auto& [width, height] : {std::pair{95u, 70u}, {64u, 64u}, {33u, 101u}})
    for (const double radius : {8.0, 20.0, 30.0}) {
      if (2 * radius + 2 > std::min(width, height)) continue;
      EXPECT_LT(error(width, height, radius, plane), 0.01) << width << " x " << height << ", " << radius;
      EXPECT_LT(error(width, height, radius, saddle), 0.02) << width << " x " << height << ", " << radius;
    }
}

TEST_F(MembraneTest, WhatIsKnownIsHeldAndBoundsTheRest) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> value(-2, 3);
  std::bernoulli_distribution is_known(0.2);
  for (const auto& [width, height] : {std::pair{40u, 31u}, {1u, 17u}, {9u, 1u}, {2u, 2u}}) {
    std::vector<float> values(size_t{width} * height);
    std::vector<uint8_t> known(values.size());
    for (size_t i = 0; i < values.size(); ++i) values[i] = value(random), known[i] = is_known(random);
    known.front() = 1;
    std::vector<float> filled = values;
    Membrane(width, height).fill(filled, known);
    for (size_t i = 0; i < values.size(); ++i) {
      if (known[i] != 0) {
        EXPECT_EQ(filled[i], values[i]);
      }
      EXPECT_GE(filled[i], -2);
      EXPECT_LE(filled[i], 3);
    }
  }
}

TEST_F(MembraneTest, NothingKnownNothingChanged) {
  std::vector<float> values{1, 2, 3, 4};
  Membrane(2, 2).fill(values, std::vector<uint8_t>(4));
  EXPECT_EQ(values, (std::vector<float>{1, 2, 3, 4}));
}

}  // namespace
}  // namespace palpate
