// What the emulator is off by: nothing on blocks of its own making, as much as these are changed otherwise.
#include "perf/lab/study/emulator_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "engine/lump/network/model.h"

namespace palpate {
namespace {

constexpr double kYoung_Pa = 5000;

/// A block whose pressure is what the emulator says, its bump `higher` times as high.
lump::Example emulated(const lump::Model& model, double higher) {
  lump::Example e;
  e.size_mm = 8;
  e.depth_mm = 4;
  e.stiffness_ratio = 6;
  e.offset_mm = {2, -1};
  e.young_Pa = kYoung_Pa;
  const lump::Guess guess{e.shape, std::log(e.size_mm), std::log(e.depth_mm), std::log(e.stiffness_ratio)};
  const lump::Setting setting{e.block_mm[2], 2, 1, model.cell_mm};
  const std::vector<double> loads = {0.1, 0.2};
  const Eigen::MatrixXd factors = higher * bump_factors(model, guess, setting, loads, -1);
  Eigen::VectorXf fields(model.patch.count());
  for (size_t k = 0; k < loads.size(); ++k) {
    const Eigen::VectorXf quarter = model.base.quarter(e.block_mm[2], loads[k]);
    PressureMap map;
    map.width = map.height = 33;
    map.pitch_mm = {1.25, 1.25};
    for (int j = -16; j <= 16; ++j)
      for (int i = -16; i <= 16; ++i) {
        // Mirrored as the model has it: the block's middle lies to the left of the patch and above.
        const double x = 1.25 * i, y = 1.25 * j, u = x - 2, v = -(y + 1);
        double value = model.base.at(quarter, x, y);
        if (std::max(std::abs(u), std::abs(v)) <= model.patch.reach_mm()) {
          model.patch.at(u, v, fields.data());
          value += fields.cast<double>().dot(factors.col(static_cast<Eigen::Index>(k)));
        }
        map.values.push_back(static_cast<float>(kYoung_Pa * value));
      }
    e.pressure_Pa.push_back(map);
    e.force_N.push_back(loads[k] * kYoung_Pa * e.block_mm[0] * e.block_mm[1] * 1e-6);
  }
  return e;
}

TEST(EmulatorErrors, AreThoseOfTheBump) {
  const lump::Network& network = lump::Network::built_in();
  const auto errors = emulator_errors(network, {emulated(network.model(), 1), emulated(network.model(), 1.2),
                                                emulated(network.model(), 1.5)});
  ASSERT_EQ(errors.size(), 3u);
  // Nodes are means of the map's values, which takes 1.3 % off the bump.
  EXPECT_LT(errors[0].of_bump, 0.02);
  EXPECT_NEAR(errors[1].of_bump, 0.2 / 1.2, 0.02);
  EXPECT_NEAR(errors[2].of_bump, 0.5 / 1.5, 0.02);
  EXPECT_LT(errors[2].fields, 0.1 * errors[2].fraction);
  const std::string text = emulator_errors_text(errors);
  EXPECT_NE(text.find("all lumps                        3"), std::string::npos) << text;
  EXPECT_EQ(text.find("stiff and shallow"), std::string::npos) << text;
}

TEST(EmulatorErrors, LeaveOutWhatTheModelDoesNotKnow) {
  const lump::Network& network = lump::Network::built_in();
  lump::Example thick = emulated(network.model(), 1);
  thick.block_mm[2] = 60;
  EXPECT_TRUE(emulator_errors(network, {thick}).empty());
}

}  // namespace
}  // namespace palpate
