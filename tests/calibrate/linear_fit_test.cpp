// The line from gray sum to force, and from shift to shear, against lines that are known.
#include "engine/calibrate/linear_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "palpate/error.h"

namespace palpate {
namespace {

TEST(ForceFit, ExactLineIsFoundToTheLastDigits) {
  // The paper's line, Eq. 80, at its magnitude of G.
  std::vector<double> gray, force;
  for (int i = 0; i < 20; ++i) {
    gray.push_back(4e7 + 3e6 * i);
    force.push_back(1.75e-8 * gray.back() - 0.11456);
  }
  const ForceFit fit = fit_force(gray, force);
  EXPECT_NEAR(fit.calibration.c1_N_per_gray, 1.75e-8, 1e-18);
  EXPECT_NEAR(fit.calibration.c0_N, -0.11456, 1e-11);
  EXPECT_NEAR(fit.r_squared, 1, 1e-12);
  EXPECT_LT(fit.largest_residual_N, 1e-12);
  EXPECT_EQ(fit.calibration.gray_min, 4e7);
  EXPECT_EQ(fit.calibration.gray_max, 4e7 + 57e6);
}

TEST(ForceFit, StatedErrorsAreTheErrorsThatHappen) {
  constexpr int kTrials = 2000, kReadings = 25;
  constexpr double kSlope = 2e-6, kOffset = 0.05, kNoise_N = 0.01, kAt = 4e5;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, kNoise_N);
  double squares = 0, stated = 0, sd = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<double> gray, force;
    for (int i = 0; i < kReadings; ++i) {
      gray.push_back(4e4 * i);
      force.push_back(kSlope * gray.back() + kOffset + noise(random));
    }
    const ForceCalibration c = fit_force(gray, force).calibration;
    const double error = c.c1_N_per_gray * kAt + c.c0_N - (kSlope * kAt + kOffset);
    squares += error * error;
    stated += c.covariance[0] + 2 * kAt * c.covariance[1] + kAt * kAt * c.covariance[2];
    sd += c.residual_sd_N;
  }
  EXPECT_NEAR(squares / stated, 1, 0.1) << "variance of the line at G = 4e5";
  EXPECT_NEAR(sd / kTrials, kNoise_N, 0.02 * kNoise_N);
}

TEST(ForceFit, ReadingsThatSayNothingAreRefused) {
  const std::vector<double> two = {1, 2}, flat = {5, 5, 5}, up = {1, 2, 3}, down = {3, 2, 1};
  EXPECT_THROW(fit_force(two, two), Error);
  EXPECT_THROW(fit_force(flat, up), Error);
  EXPECT_THROW(fit_force(up, flat), Error);
  EXPECT_THROW(fit_force(up, down), Error);
}

TEST(StiffnessFit, LineThroughTheOrigin) {
  std::vector<double> shift, force;
  for (int i = -5; i <= 5; ++i) {
    shift.push_back(0.1 * i);
    force.push_back(2.5 * shift.back());
  }
  const StiffnessFit fit = fit_stiffness(shift, force);
  EXPECT_NEAR(fit.k_N_per_mm, 2.5, 1e-12);
  EXPECT_LT(fit.relative_sd, 1e-9);
  const std::vector<double> still(4, 0.0), pull = {1, 1, 1, 1};
  EXPECT_THROW(fit_stiffness(still, pull), Error);
}

}  // namespace
}  // namespace palpate
