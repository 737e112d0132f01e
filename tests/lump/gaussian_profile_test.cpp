// The Gaussian through a stress profile: the true parameters are recovered, with correct standard errors.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/lump/observation/gaussian_profile.h"
#include "palpate/error.h"

namespace palpate {
namespace {

lump::Profile gaussian(double a, double x0, double s, double offset, double noise, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> deviate(0, 1);
  lump::Profile profile;
  for (int i = 0; i <= 64; ++i) {
    const double x = (i - 32) * 0.5;
    profile.x_mm.push_back(x);
    profile.value.push_back(a * std::exp(-(x - x0) * (x - x0) / (2 * s * s)) + offset +
                            noise * deviate(random));
  }
  return profile;
}

TEST(LumpProfile, ExactGaussiansComeBack) {
  for (const double a : {240.0, -35.0, 1e-3})
    for (const double x0 : {0.0, -7.3, 5.0})
      for (const double s : {1.0, 3.1, 6.0}) {
        const lump::GaussianFit fit = lump::fit_gaussian(gaussian(a, x0, s, 200, 0, 1));
        EXPECT_TRUE(fit.found) << a << " " << x0 << " " << s;
        EXPECT_NEAR(fit.amplitude, a, 1e-6 * std::abs(a) + 1e-9);
        EXPECT_NEAR(fit.center_mm, x0, 1e-4);
        EXPECT_NEAR(fit.width_mm, s, 1e-4);
        EXPECT_NEAR(fit.offset, 200, 1e-6);
      }
}

// Over 300 noisy lines each parameter lies within one standard error about as often as it should.
TEST(LumpProfile, ErrorsCover) {
  const double truth[] = {100, 1.5, 3, 200};
  int within[4] = {};
  for (uint32_t seed = 0; seed < 300; ++seed) {
    const lump::GaussianFit fit =
        lump::fit_gaussian(gaussian(truth[0], truth[1], truth[2], truth[3], 5, seed));
    ASSERT_TRUE(fit.found);
    const double found[] = {fit.amplitude, fit.center_mm, fit.width_mm, fit.offset};
    for (int i = 0; i < 4; ++i) within[i] += std::abs(found[i] - truth[i]) < fit.sd[i];
    EXPECT_NEAR(fit.residual_rms, 5, 2);
  }
  for (const int count : within) EXPECT_NEAR(count / 300.0, 0.683, 0.09);
}

TEST(LumpProfile, FlatAndNoisyLinesHoldNoBump) {
  EXPECT_FALSE(lump::fit_gaussian(gaussian(0, 0, 3, 200, 0, 1)).found);
  int found = 0;
  for (uint32_t seed = 0; seed < 50; ++seed)
    found += lump::fit_gaussian(gaussian(0, 0, 3, 200, 5, seed)).found;
  EXPECT_LE(found, 20);  // the best of many places and widths passes three errors now and then
  lump::Profile slope = gaussian(0, 0, 3, 0, 0, 1);
  slope.value = slope.x_mm;
  EXPECT_FALSE(lump::fit_gaussian(slope).found);
}

TEST(LumpProfile, RefusesWhatIsNoProfile) {
  EXPECT_THROW(lump::fit_gaussian({{1, 2, 3}, {1, 2, 3}}), Error);
  lump::Profile bad = gaussian(1, 0, 3, 0, 0, 1);
  bad.value[7] = NAN;
  EXPECT_THROW(lump::fit_gaussian(bad), Error);
}

TEST(LumpProfile, LineThroughTheBump) {
  PressureMap map{41, 61, {0.5, 0.4}, {}};
  for (uint32_t j = 0; j < map.height; ++j)
    for (uint32_t i = 0; i < map.width; ++i) {
      const double x = (i - 20.0) * 0.5 - 2, y = (j - 30.0) * 0.4 + 3;
      map.values.push_back(static_cast<float>(10 + 5 * std::exp(-(x * x + y * y) / 4)));
    }
  const auto [x, y] = lump::bump_center_mm(map);
  EXPECT_NEAR(x, 2, 0.05);
  EXPECT_NEAR(y, -3, 0.1);
  const lump::GaussianFit fit = lump::fit_gaussian(lump::profile_along_x(map, y));
  EXPECT_TRUE(fit.found);
  EXPECT_NEAR(fit.amplitude, 5, 0.1);
  EXPECT_NEAR(fit.center_mm, 2, 0.01);
  EXPECT_NEAR(fit.width_mm, std::sqrt(2.0), 0.02);
  EXPECT_EQ(lump::inner_part(lump::profile_along_x(map, y), 5).x_mm.size(), 21u);
}

}  // namespace
}  // namespace palpate
