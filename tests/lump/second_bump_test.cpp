// Detection of two lumps: two are reported, one lump of any shape and noise are not.
#include "engine/lump/network/second_bump.h"
#include "engine/fem/solve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/fem/large_strain/extrapolation.h"
#include "engine/lump/network/network.h"
#include "engine/lump/network/view.h"
#include "engine/lump/observation/sensor_model.h"

namespace palpate {
namespace {

fem::Inclusion lump_at(double x_mm, double y_mm, double size_mm = 8, double depth_mm = 5) {
  fem::Inclusion lump;
  lump.size_mm = {size_mm, size_mm, size_mm};
  lump.depth_mm = depth_mm;
  lump.stiffness_ratio = 6;
  lump.offset_mm = {x_mm, y_mm};
  return lump;
}

fem::Result solved(const std::vector<fem::Inclusion>& lumps) {
  fem::Scene scene;
  scene.cells = {32, 32, 16};
  scene.press_mm.reset();
  scene.force_N = 1;
  scene.inclusion.reset();
  if (!lumps.empty()) {
    scene.inclusion = lumps.front();
    scene.others.assign(lumps.begin() + 1, lumps.end());
  }
  return fem::solve(scene);
}

/// Pressure that the lumps add to that of the block alone, with noise that is a fraction of the peak.
lump::PressedNodes nodes_of(const std::vector<fem::Inclusion>& lumps, double noise_fraction,
                            uint64_t seed = 1) {
  static const PressureMap alone = solved({}).stress_Pa;
  const PressureMap map = solved(lumps).stress_Pa;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> deviate;
  lump::PressedNodes nodes;
  std::vector<double> values;
  double peak = 0;
  for (uint32_t j = 1; j + 1 < map.height; ++j)
    for (uint32_t i = 1; i + 1 < map.width; ++i) {
      nodes.x_mm.push_back((i - (map.width - 1) / 2.0) * map.pitch_mm[0]);
      nodes.y_mm.push_back((j - (map.height - 1) / 2.0) * map.pitch_mm[1]);
      values.push_back(static_cast<double>(map.at(i, j)) - static_cast<double>(alone.at(i, j)));
      peak = std::max(peak, static_cast<double>(map.at(i, j)));
    }
  nodes.noise = noise_fraction * peak / 4000;
  nodes.loads = {0.15};
  nodes.rest.resize(static_cast<Eigen::Index>(values.size()), 1);
  for (size_t n = 0; n < values.size(); ++n)
    nodes.rest(static_cast<Eigen::Index>(n), 0) = values[n] / 4000 + nodes.noise * deviate(random);
  return nodes;
}

bool told(const lump::PressedNodes& nodes) {
  const auto bump = find_second_bump(nodes);
  return bump && reports_two(*bump);
}

TEST(SecondBump, TwoLumpsAreToldWithTheirPlaces) {
  for (const double apart : {10.0, 16.0, 24.0}) {
    const auto bump = find_second_bump(nodes_of({lump_at(-apart / 2, 3), lump_at(apart / 2, 3, 7.5)}, 0.01));
    ASSERT_TRUE(bump && reports_two(*bump)) << apart;
    EXPECT_NEAR(bump->distance_mm, apart, 2) << apart;
    EXPECT_NEAR(bump->place_mm[0][0], -apart / 2, 1.5) << "the larger one is the higher one";
    EXPECT_NEAR(bump->place_mm[1][0], apart / 2, 1.5);
    EXPECT_NEAR(bump->place_mm[1][1], 3, 1.5);
  }
  EXPECT_TRUE(told(nodes_of({lump_at(-6, -6), lump_at(5, 6, 6, 6)}, 0.01))) << "unequal ones, diagonal";
}

TEST(SecondBump, OneLumpOfAnyShapeIsOne) {
  EXPECT_FALSE(told(nodes_of({lump_at(6, -5, 5, 2)}, 0.002)));
  for (const InclusionShape shape :
       {InclusionShape::Ellipsoid, InclusionShape::Cylinder, InclusionShape::LyingCylinder})
    for (const double ratio : {2.0, 40.0}) {
      fem::Inclusion lump = lump_at(0, 0, 10, 2);
      lump.shape = shape;
      lump.stiffness_ratio = ratio;
      if (shape == InclusionShape::Ellipsoid) lump.size_mm[0] = 15;
      if (shape == InclusionShape::LyingCylinder) lump.size_mm[0] = 25;
      EXPECT_FALSE(told(nodes_of({lump}, 0.002))) << static_cast<int>(shape) << " " << ratio;
    }
}

TEST(SecondBump, NoiseIsNone) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    EXPECT_FALSE(told(nodes_of({lump_at(0, 0)}, 0.1, seed))) << seed;
    EXPECT_FALSE(told(nodes_of({}, 0.02, seed))) << seed;
  }
}

TEST(SecondBump, ANodeThatIsMissedDoesNotMatter) {
  lump::PressedNodes nodes = nodes_of({lump_at(-8, 0), lump_at(8, 0)}, 0.005);
  const lump::PressedNodes whole = nodes;
  std::vector<Eigen::Index> kept;
  nodes.x_mm.clear();
  nodes.y_mm.clear();
  for (size_t n = 0; n < whole.x_mm.size(); ++n) {
    if (n % 17 == 3) continue;
    kept.push_back(static_cast<Eigen::Index>(n));
    nodes.x_mm.push_back(whole.x_mm[n]);
    nodes.y_mm.push_back(whole.y_mm[n]);
  }
  nodes.rest = whole.rest(kept, Eigen::all).eval();
  const auto bump = find_second_bump(nodes);
  ASSERT_TRUE(bump && reports_two(*bump));
  EXPECT_NEAR(bump->distance_mm, 16, 2);
}

/// Large strain through a sensor, as the network gets it.
lump::Observation observation_of(const fem::Scene& scene) {
  fem::LargeStrainOptions options;
  options.residual = 1e-4;
  options.step_mm = 2;
  options.map_nodes = {33, 33};
  const fem::LargeStrainResult pressed =
      solve_extrapolated(scene, {16, 16, 8}, {{2, std::nullopt}, {3.5, std::nullopt}}, options);
  EXPECT_TRUE(pressed.converged);
  lump::PalpationSensor sensor;
  sensor.size_px = {160, 120};
  return sensor_observation({pressed.loads.at(0).pressure_Pa, pressed.loads.at(1).pressure_Pa},
                            {pressed.loads[0].force_N, pressed.loads[1].force_N}, scene.block_mm,
                            scene.young_Pa, sensor, 1);
}

TEST(SecondBump, TheNetworkSaysSoAndTellsNoNumbersAsFound) {
  fem::Scene scene;
  scene.cells = {24, 24, 12};
  scene.inclusion = lump_at(-8, 0);
  const lump::Estimate one = lump::Network::built_in().estimate(observation_of(scene));
  EXPECT_NE(one.verdict, lump::Status::SeveralLumps);
  EXPECT_TRUE(one.bumps_mm.empty());
  scene.others = {lump_at(8, 0)};
  const lump::Estimate two = lump::Network::built_in().estimate(observation_of(scene));
  EXPECT_EQ(two.verdict, lump::Status::SeveralLumps);
  EXPECT_FALSE(reports_numbers(two.verdict));
  ASSERT_EQ(two.bumps_mm.size(), 2u);
  EXPECT_NEAR(std::abs(two.bumps_mm[0][0] - two.bumps_mm[1][0]), 16, 2);
  ASSERT_FALSE(two.reasons.empty());
  EXPECT_NE(two.reasons.front().find("two bumps"), std::string::npos) << two.reasons.front();
}

}  // namespace
}  // namespace palpate
