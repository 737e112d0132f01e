// A block pressed to forces, starting from another grid's answer.
#include "engine/fem/large_strain/grid_press.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/numeric/through_origin.h"

namespace palpate {
namespace {

fem::PressedState linear_state(const std::array<uint32_t, 3>& cells) {
  fem::PressedState state{2, {}, {}};
  for (int c = 0; c < 3; ++c)
    for (uint32_t k = 0; k <= cells[2]; ++k)
      for (uint32_t j = 0; j <= cells[1]; ++j)
        for (uint32_t i = 0; i <= cells[0]; ++i)
          state.displacement.push_back(c + 1.0 * i / cells[0] - 2.0 * j / cells[1] + 0.5 * k / cells[2]);
  for (uint32_t k = 0; k < cells[2]; ++k)
    for (uint32_t j = 0; j < cells[1]; ++j)
      for (uint32_t i = 0; i < cells[0]; ++i) state.pressure.push_back(i * 4 / cells[0] + 10.0 * k);
  return state;
}

TEST(PressedState, LinearFieldsAreTheSameOnOtherCells) {
  const std::array<uint32_t, 3> from = {8, 4, 4}, to = {12, 6, 6};
  const fem::PressedState there = on_cells(linear_state(from), from, to), wanted = linear_state(to);
  ASSERT_EQ(there.displacement.size(), wanted.displacement.size());
  for (size_t n = 0; n < wanted.displacement.size(); ++n)
    ASSERT_NEAR(there.displacement[n], wanted.displacement[n], 1e-12);
  ASSERT_EQ(there.pressure.size(), wanted.pressure.size());
  EXPECT_EQ(there.pressure.front(), 0);
  EXPECT_EQ(there.pressure.back(), 3 + 10 * 3);
}

class PressedToForces : public testing::Test {
 protected:
  PressedToForces() : team_(1) {
    options_.residual = 1e-6;
    options_.step_mm = 2;
  }

  fem::GridPress press(uint32_t cells, const fem::GridPress* near) {
    scene_.cells = {cells, cells, cells / 2};
    fem::LargeStrainModel model(scene_, options_, team_);
    reported_ = {};
    return press_to_forces(scene_, model, options_, forces_N_, near, reported_).value();
  }

  static constexpr double kLast_N = 1.5;
  fem::Scene scene_;
  fem::LargeStrainOptions options_;
  fem::LargeStrainResult reported_;
  const std::vector<double> forces_N_ = {0.5, 1, kLast_N};
  WorkTeam team_;
};

TEST_F(PressedToForces, FromACoarserGridWithFewerRounds) {
  const fem::GridPress coarse = press(16, nullptr), rest = press(32, nullptr);
  const uint32_t rounds = reported_.newton_rounds;
  const fem::GridPress near = press(32, &coarse);
  EXPECT_LT(reported_.newton_rounds, rounds / 2 + 1);
  for (size_t l = 0; l < forces_N_.size(); ++l) {
    EXPECT_NEAR(rest.force_N[l] / forces_N_[l], 1, 1e-5);
    EXPECT_NEAR(near.force_N[l] / forces_N_[l], 1, fem::force_tolerance(3));
    // The maps between which one interpolates are those at the forces themselves.
    const std::vector<double> factors = weights_through_origin(near.force_N, forces_N_[l]);
    double largest = 0, off = 0;
    for (size_t n = 0; n < rest.surfaces[l].force_N.size(); ++n) {
      double force = 0;
      for (size_t k = 0; k < factors.size(); ++k) force += factors[k] * near.surfaces[k].force_N[n];
      largest = std::max(largest, rest.surfaces[l].force_N[n]);
      off = std::max(off, std::abs(force - rest.surfaces[l].force_N[n]));
    }
    EXPECT_LT(off, 2e-4 * largest);
  }
}

TEST_F(PressedToForces, AStateOfAnotherPartOfTheBlockIsOfNoUse) {
  fem::GridPress quarter = press(16, nullptr);
  ASSERT_TRUE(quarter.quarter);
  options_.quarter = false;
  const fem::GridPress whole = press(16, &quarter);
  EXPECT_FALSE(whole.quarter);
  EXPECT_NEAR(whole.force_N.back() / kLast_N, 1, 1e-5);  // from rest, to the force itself
}

}  // namespace
}  // namespace palpate
