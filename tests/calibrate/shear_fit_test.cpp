// Stiffness and friction from pulls with a gauge: a spring that slides at a known limit.
#include "engine/calibrate/shear_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kStiffness_N_per_mm = 1.2, kNormal_N = 1.5, kFriction = 0.4, kNoise_mm = 1e-3;

/// A contact is pulled `travel_mm` along `angle_rad` and back, as Coulomb has it.
void pull(std::vector<ShearSample>& samples, uint32_t contact, double travel_mm, double angle_rad,
          int frames) {
  std::mt19937 random(contact);
  std::normal_distribution<double> noise(0, kNoise_mm);
  double foot_mm = 0;
  for (int i = 0; i <= frames; ++i) {
    const double place_mm = travel_mm * std::sin(std::numbers::pi * i / frames);
    double force_N = kStiffness_N_per_mm * (place_mm - foot_mm);
    const double limit_N = kFriction * kNormal_N;
    if (std::abs(force_N) > limit_N) {
      force_N = std::copysign(limit_N, force_N);
      foot_mm = place_mm - force_N / kStiffness_N_per_mm;
    }
    const double c = std::cos(angle_rad), s = std::sin(angle_rad);
    samples.push_back({.ux_mm = c * place_mm + noise(random),
                       .uy_mm = s * place_mm + noise(random),
                       .fx_N = c * force_N,
                       .fy_N = s * force_N,
                       .normal_N = kNormal_N,
                       .contact = contact});
  }
}

void expect_the_spring(const ShearFit& fit) {
  for (const Stiffness& k : {fit.x, fit.y}) {
    EXPECT_NEAR(k.k_N_per_mm, kStiffness_N_per_mm, 0.02 * kStiffness_N_per_mm);
    EXPECT_GT(k.r_squared, 0.99);
  }
}

TEST(ShearFit, SpringThatNeverSlips) {
  std::vector<ShearSample> samples;
  pull(samples, 0, 0.4, 0.3, 60);
  pull(samples, 1, -0.4, 1.2, 60);
  const ShearFit fit = fit_shear(samples, kNoise_mm);
  expect_the_spring(fit);
  EXPECT_FALSE(fit.has_friction);
  for (const ShearSample& s : samples) EXPECT_EQ(s.phase, ShearSample::Phase::Sticks);
}

// Slides many times as long as the spring stretches must not pass for a soft spring.
TEST(ShearFit, LongSlidesAreNoSpring) {
  for (const double travel_mm : {1.0, 3.0, 8.0, 20.0}) {
    std::vector<ShearSample> samples;
    pull(samples, 0, travel_mm, 0.4, 600);
    pull(samples, 1, travel_mm, 1.9, 600);
    const ShearFit fit = fit_shear(samples, kNoise_mm);
    SCOPED_TRACE(travel_mm);
    expect_the_spring(fit);
    EXPECT_TRUE(fit.has_friction);
    EXPECT_NEAR(fit.friction, kFriction, 0.01);
    EXPECT_LE(fit.x.shift_max_mm, 1.3 * kFriction * kNormal_N / kStiffness_N_per_mm);
  }
}

TEST(ShearFit, ForceThatDoesNotFollowTheShiftIsRefused) {
  std::vector<ShearSample> samples;
  std::mt19937 random(5);
  std::normal_distribution<double> any(0, 1);
  for (int i = 0; i < 200; ++i)
    samples.push_back({.ux_mm = any(random),
                       .uy_mm = any(random),
                       .fx_N = any(random),
                       .fy_N = any(random),
                       .normal_N = 3});
  EXPECT_THROW(fit_shear(samples, kNoise_mm), Error);
}

TEST(ShearFit, DirectionWithoutPullIsRefused) {
  std::vector<ShearSample> samples;
  pull(samples, 0, 0.4, 0, 60);
  try {
    fit_shear(samples, kNoise_mm);
    FAIL() << "no refusal";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("none along y"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace palpate
