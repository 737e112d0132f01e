#include "engine/lump/tissue/relaxation.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate::lump {
namespace {

constexpr double kInfinity_s = 1e9;

Relaxation two_times() {
  Relaxation relaxation;
  relaxation.terms = {{0.2, 3}, {0.1, 30}};
  relaxation.move_s = 1;
  relaxation.rest_s = 4;
  return relaxation;
}

/// A press at four loads: maps of 2 x 1 nodes that do not grow alike.
Observation press() {
  Observation o;
  for (int k = 1; k <= 4; ++k) {
    o.pressure_Pa.push_back(
        {2, 1, {1, 1}, {100.0f * static_cast<float>(k), 30.0f * static_cast<float>(k * k)}});
    o.force_N.push_back(0.5 * k);
  }
  o.noise_Pa = 1;
  return o;
}

TEST(Relaxation, ModulusFallsAsItsSeriesSays) {
  const Relaxation relaxation = two_times();
  EXPECT_DOUBLE_EQ(modulus_after(relaxation, 0, 0), 1);
  EXPECT_NEAR(modulus_after(relaxation, 3, 0), 1 - 0.2 * (1 - std::exp(-1)) - 0.1 * (1 - std::exp(-0.1)),
              1e-12);
  EXPECT_NEAR(modulus_after(relaxation, kInfinity_s, 0), 0.7, 1e-12);
  // A ramp is the mean of steps made at all its times.
  double mean = 0;
  constexpr int kSteps = 10000;
  for (int i = 0; i < kSteps; ++i) mean += modulus_after(relaxation, 2 + 5 * (i + 0.5) / kSteps, 0) / kSteps;
  EXPECT_NEAR(modulus_after(relaxation, 2, 5), mean, 1e-8);
}

// Against the hereditary integral of a way in ramps and rests, added up in small steps.
TEST(Relaxation, IsTheHereditaryIntegral) {
  const Relaxation relaxation = two_times();
  const Observation elastic = press();
  std::vector<PressureMap> maps = elastic.pressure_Pa;
  std::vector<double> forces = elastic.force_N;
  relax(relaxation, maps, forces);
  constexpr double kPeriod_s = 5;
  for (size_t k = 0; k < 4; ++k) {
    const double read_s = kPeriod_s * static_cast<double>(k + 1);
    double force = 0;
    constexpr int kSteps = 4000;
    for (size_t step = 0; step <= k; ++step) {
      const double change = elastic.force_N[step] - (step > 0 ? elastic.force_N[step - 1] : 0);
      for (int i = 0; i < kSteps; ++i) {
        const double at_s = kPeriod_s * static_cast<double>(step) + relaxation.move_s * (i + 0.5) / kSteps;
        force += modulus_after(relaxation, read_s - at_s, 0) * change / kSteps;
      }
    }
    EXPECT_NEAR(forces[k], force, 1e-7) << k;
    EXPECT_NEAR(double{maps[k].values[0]} / 200, forces[k], 1e-4) << "grows as the force does";
  }
  EXPECT_LT(forces[3] / elastic.force_N[3], 0.9);
}

TEST(Relaxation, IsTakenBack) {
  Observation read = press();
  relax(two_times(), read.pressure_Pa, read.force_N);
  read.relaxation = two_times();
  const Observation elastic = without_relaxation(read), truth = press();
  EXPECT_FALSE(elastic.relaxation);
  for (size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(elastic.force_N[k], truth.force_N[k], 1e-12);
    for (size_t n = 0; n < 2; ++n)
      EXPECT_NEAR(elastic.pressure_Pa[k].values[n], truth.pressure_Pa[k].values[n], 1e-3);
  }
  EXPECT_GT(elastic.noise_Pa, 1.1);
  EXPECT_LT(elastic.noise_Pa, 1.5);
  // None of it: as it was read.
  EXPECT_NEAR(without_relaxation(read, 0).force_N[3], read.force_N[3], 1e-12);
  read.pressure_Pa[1].values[0] = std::nanf("");
  EXPECT_FALSE(std::isnan(without_relaxation(read).pressure_Pa[0].values[0]));
  EXPECT_TRUE(std::isnan(without_relaxation(read).pressure_Pa[3].values[0]));
}

// Long rests leave the same share everywhere: the modulus of slow presses.
TEST(Relaxation, LongRestsLeaveTheSlowModulus) {
  Relaxation relaxation = two_times();
  relaxation.rest_s = kInfinity_s;
  Observation read = press();
  relax(relaxation, read.pressure_Pa, read.force_N);
  for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(read.force_N[k], 0.7 * press().force_N[k], 1e-9);
}

}  // namespace
}  // namespace palpate::lump
