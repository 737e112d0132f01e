// Thickness of a pad from presses of known force: found where contacts are wide and small, refused where they
// are alike.
#include "engine/calibrate/force/thickness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "engine/pad/traction.h"
#include "tests/support/pressed_surface.h"

namespace palpate {
namespace {

constexpr double kTrue_mm = 6, kTrueModulus_MPa = 0.2, kPoisson = 0.485;
constexpr TractionGrid kGrid{80, 60, 0.348};

/// Balls pressed on a pad of kTrue_mm, and what layers about the stated thickness and modulus read of its
/// surface.
class ThicknessTest : public testing::Test {
 protected:
  static constexpr double kStatedModulus_MPa = 0.15;

  struct Presses {
    std::vector<ForceSample> samples;
    std::vector<ThicknessForces> layer_N;
  };
  /// Each ball of these radii to a depth of `deepest_mm` in four steps; `errs`: relative error that readings
  /// of a ball share.
  static Presses press(double stated_mm, const std::vector<double>& radii_mm, double deepest_mm,
                       double errs = 0) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal(0, 1);
    Presses presses;
    const Layer pad({kTrueModulus_MPa, kPoisson}, kTrue_mm);
    std::vector<std::unique_ptr<TractionSolver>> solvers;
    solvers.reserve(kThicknesses.size());
    for (const double factor : kThicknesses)
      solvers.push_back(
          std::make_unique<TractionSolver>(Pad{{kStatedModulus_MPa, kPoisson}, factor * stated_mm}, kGrid,
                                           TractionOptions{.slope_sd = 0.01, .errors = false}));
    for (size_t ball = 0; ball < radii_mm.size(); ++ball) {
      const double gain = 1 + errs * normal(random);
      for (int step = 1; step <= 4; ++step) {
        const double contact_mm = std::sqrt(radii_mm[ball] * deepest_mm * step / 4);
        const LayerContact contact = pad.press_sphere_to_radius(contact_mm, radii_mm[ball]);
        PressedSurface surface(kGrid);
        surface.add(contact, 0.4, -0.3);
        ForceSample sample;
        sample.force_N = contact.summary().force_N;
        sample.recording = static_cast<uint32_t>(ball);
        presses.samples.push_back(sample);
        ThicknessForces forces{};
        for (size_t i = 0; i < forces.size(); ++i) {
          solvers[i]->forget();
          forces[i] = gain * solvers[i]->solve(surface.input()).wrench.force_N[2];
        }
        presses.layer_N.push_back(forces);
      }
    }
    return presses;
  }
};

TEST_F(ThicknessTest, WrongByAFifthIsFound) {
  for (const double stated_mm : {4.8, 6.0, 7.5}) {
    const Presses presses = press(stated_mm, {2, 5, 12, 30}, 1.2);
    const ThicknessChoice found = choose_thickness(presses.samples, presses.layer_N);
    std::printf("stated %g mm: %s\n", stated_mm, found.line().c_str());
    EXPECT_NEAR(found.factor * stated_mm, kTrue_mm, 0.05 * kTrue_mm);
    // A thickness that is right already stays.
    EXPECT_EQ(found.decided, stated_mm != kTrue_mm) << found.line();
    EXPECT_LT(found.error_N, 0.5 * found.stated_error_N + 0.02);
  }
}

TEST_F(ThicknessTest, IsFoundThroughErrorsOfTheObjects) {
  const Presses presses = press(7.5, {2, 4, 8, 12, 20, 30}, 1.2, 0.02);
  const ThicknessChoice found = choose_thickness(presses.samples, presses.layer_N);
  std::printf("%s\n", found.line().c_str());
  EXPECT_TRUE(found.decided);
  EXPECT_NEAR(found.factor * 7.5, kTrue_mm,
              std::max(2 * found.relative_sd * found.factor * 7.5, 0.05 * kTrue_mm));
}

// Balls that are alike differ by errors that no thickness explains.
TEST_F(ThicknessTest, PressesThatAreAlikeDecideNothing) {
  const Presses presses = press(7.5, {4, 4, 4, 4}, 0.8, 0.05);
  const ThicknessChoice found = choose_thickness(presses.samples, presses.layer_N);
  EXPECT_FALSE(found.decided) << found.line();
  EXPECT_NE(found.line().find("do not decide"), std::string::npos);
  const Presses two = press(7.5, {2, 30}, 1.2);
  EXPECT_FALSE(choose_thickness(two.samples, two.layer_N).decided);
}

TEST_F(ThicknessTest, WhatIsNotUsedOrNotThereDoesNotCount) {
  Presses presses = press(7.5, {2, 5, 12, 30}, 1.2);
  const ThicknessChoice found = choose_thickness(presses.samples, presses.layer_N);
  for (const bool finite : {true, false}) {
    ForceSample wrong = presses.samples.front();
    wrong.force_N = 1e3;
    if (finite) wrong.left_out = LeftOut::Outlier;
    presses.samples.push_back(wrong);
    presses.layer_N.push_back(presses.layer_N.front());
    if (!finite) presses.layer_N.back()[1] = std::numeric_limits<double>::quiet_NaN();
  }
  EXPECT_EQ(choose_thickness(presses.samples, presses.layer_N).factor, found.factor);
}

}  // namespace
}  // namespace palpate
