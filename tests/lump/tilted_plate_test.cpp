// A tilted plate by finite elements: how far the plate's model and what reads tilts are off.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/fem/large_strain/model.h"
#include "engine/lump/observation/pad_tilt.h"
#include "engine/palpation/hand/held_pad.h"
#include "engine/tissue/map_sampling.h"

namespace palpate {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::array<double, 2> kWindow_mm = {27.84, 20.88};

fem::Scene tissue_alone() {
  fem::Scene scene;
  scene.cells = {24, 24, 12};
  scene.inclusion.reset();
  return scene;
}

/// The block under plates tilted along x, at the same way of their middle.
class TiltedPlate : public testing::Test {
 protected:
  fem::Scene scene_ = tissue_alone();
  WorkTeam team_{2};
  fem::LargeStrainOptions options_ = [] {
    fem::LargeStrainOptions o;
    o.quarter = false;
    return o;
  }();
  fem::LargeStrainModel model_{scene_, options_, team_};
  fem::LargeStrainResult told_;

  void tilt(fem::LargeStrainModel& model, double x_deg, double y_deg) {
    model.tilt({std::tan(x_deg * kDegree), std::tan(y_deg * kDegree)});
    for (int round = 0; round < 2; ++round) ASSERT_TRUE(model.move_to(model.press_mm(), told_));
  }
  void press_to(double press_mm) {
    for (double way = model_.press_mm() + 0.5; way <= press_mm + 1e-9; way += 0.5)
      ASSERT_TRUE(model_.move_to(way, told_));
  }
  /// The plate's place follows the tissue, which moves with it: twice.
  fem::PressedBlock tilted(double x_deg, double y_deg) {
    tilt(model_, x_deg, y_deg);
    return model_.measure();
  }
};

PressureMap seen(const fem::PressedBlock& block, const std::array<double, 2>& at_mm = {0, 0}) {
  return node_means(block.pressure_Pa, at_mm, kWindow_mm, 1.25);
}

/// Blocks of a thickness that the spreading was not fitted on, and one that it was.
class TiltOfABlock : public testing::TestWithParam<double> {};

TEST_P(TiltOfABlock, IsToldAtEachLoad) {
  fem::Scene scene = tissue_alone();
  scene.block_mm[2] = GetParam();
  WorkTeam team(2);
  fem::LargeStrainOptions options;
  options.quarter = false;
  double largest = 0, square = 0, count = 0;
  for (const double compression : {0.07, 0.13, 0.20, 0.25}) {
    fem::LargeStrainModel model(scene, options, team);
    fem::LargeStrainResult told;
    const double press_mm = compression * scene.block_mm[2];
    while (model.press_mm() < press_mm - 1e-9)
      ASSERT_TRUE(model.move_to(std::min(press_mm, model.press_mm() + 0.5), told));
    for (const double degrees : {1.0, 2.0, 3.0}) {
      model.tilt({std::tan(degrees * kDegree), std::tan(-degrees / 2 * kDegree)});
      for (int round = 0; round < 2; ++round) ASSERT_TRUE(model.move_to(model.press_mm(), told));
    }
    const lump::PadTilt tilt = lump::pad_tilt(seen(model.measure()), {scene.young_Pa, scene.block_mm[2]});
    for (const double share : {tilt.x_deg / 3, tilt.y_deg / -1.5}) {
      largest = std::max(largest, std::abs(share - 1));
      square += (share - 1) * (share - 1);
      count += 1;
    }
    EXPECT_NEAR(tilt.x_deg, 3, 0.5 * tilt.x_sd_deg);
  }
  std::printf("%g mm thick: tilts of 3 and 1.5 degrees are told to %.1f %% (RMS), %.1f %% at most\n",
              GetParam(), 100 * std::sqrt(square / count), 100 * largest);
  EXPECT_LT(largest, 0.03);
}
INSTANTIATE_TEST_SUITE_P(Thickness, TiltOfABlock, testing::Values(18.0, 20.0, 22.0));

TEST_F(TiltedPlate, MomentsTellItsTilt) {
  press_to(3);
  double level_deg = 0;
  for (const double degrees : {0.0, 1.0, 2.0, 3.0, 4.0, 5.0}) {
    const fem::PressedBlock block = tilted(degrees, -degrees / 2);
    const lump::PadTilt tilt = lump::pad_tilt(seen(block), {scene_.young_Pa, scene_.block_mm[2]});
    std::printf("tilted %.0f, %.1f: read %.2f, %.2f +- %.2f degrees; %.2f N\n", degrees, -degrees / 2,
                tilt.x_deg, tilt.y_deg, tilt.x_sd_deg, block.force_N);
    if (degrees == 0) level_deg = tilt.x_deg;
    EXPECT_NEAR(tilt.x_deg, degrees, 2.5 * tilt.x_sd_deg);
    EXPECT_NEAR(tilt.y_deg, -degrees / 2, 2.5 * tilt.y_sd_deg);
    EXPECT_NEAR(tilt.x_deg, degrees, 0.02 + 0.03 * degrees);
  }
  EXPECT_NEAR(level_deg, 0, 0.05);
}

TEST_F(TiltedPlate, PressesAsALevelOneThatIsAsDeepThere) {
  PressedTissue tissue{scene_.block_mm, scene_.young_Pa, {}, {}, {}};
  for (const double press_mm : {1.0, 2.0, 3.0, 4.0, 5.0}) {
    press_to(press_mm);
    const fem::PressedBlock level = model_.measure();
    tissue.pressure_Pa.push_back(level.pressure_Pa);
    tissue.force_N.push_back(level.force_N);
    tissue.press_mm.push_back(level.press_mm);
  }
  fem::LargeStrainModel other(scene_, options_, team_);
  for (double way = 0.5; way < 3.1; way += 0.5) ASSERT_TRUE(other.move_to(way, told_));
  for (const double degrees : {1.0, 2.0, 3.0, 4.0, 5.0}) {
    tilt(other, degrees, 0);
    const fem::PressedBlock block = other.measure();
    const PressureMap model =
        pressure_under(tissue, {{0, 0}, 0, {degrees * kDegree, 0}}, block.force_N, kWindow_mm);
    const PressureMap truth = seen(block);
    double squares = 0, sum = 0, along = 0, second = 0;
    size_t count = 0;
    for (uint32_t j = 0; j < truth.height; ++j)
      for (uint32_t i = 0; i < truth.width; ++i) {
        const double x = (i - (truth.width - 1) / 2.0) * 1.25, y = (j - (truth.height - 1) / 2.0) * 1.25;
        const double off = map_at(model, x, y) - static_cast<double>(truth.at(i, j));
        squares += off * off;
        along += off * x;
        second += x * x;
        sum += static_cast<double>(truth.at(i, j));
        ++count;
      }
    const double mean = sum / static_cast<double>(count);
    std::printf(
        "tilted %.0f degrees: the model is %.1f %% of the mean pressure off (RMS), its rise %+.2f %% a mm\n",
        degrees, 100 * std::sqrt(squares / static_cast<double>(count)) / mean, 100 * along / second / mean);
    EXPECT_LT(std::sqrt(squares / static_cast<double>(count)) / mean, 0.06) << degrees;
  }
}

}  // namespace
}  // namespace palpate
