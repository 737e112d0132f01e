// What two pads hold: known truth, frames of the gripper, errors by Monte Carlo.
#include "engine/grip/grip.h"

#include <gtest/gtest.h>

#include <random>

namespace palpate {
namespace {

/// Pads that face each other along x; the right camera is upside down against the left one.
GripGeometry facing() {
  GripGeometry g;
  g.pads[0].rotation = {{{0, 0, -1}, {1, 0, 0}, {0, -1, 0}}};
  g.pads[1].rotation = {{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}};
  return g;
}

Estimate valid(double value, double sd = 0) {
  return {value, sd, Validity::Valid};
}

Touch touching(double force_N, double shear_x_N, double shear_y_N, double depth_mm) {
  Touch t;
  t.contact = true;
  t.force_N = valid(force_N);
  t.shear_x_N = valid(shear_x_N);
  t.shear_y_N = valid(shear_y_N);
  t.slip = Slip::Stick;
  t.surface.emplace();
  t.surface->validity = Validity::Valid;
  t.surface->depth_max_mm = depth_mm;
  return t;
}

TEST(Grip, LoadIsThatOfTheWeightInTheGrippersFrame) {
  // A weight of 1 N hangs between the pads: 0.5 N down on each, in the pictures down left and up right.
  GripMeter meter(facing());
  const Grip grip = meter.add(touching(2, 0.1, 0.5, 0), touching(2.2, -0.1, -0.5, 0), valid(10));
  EXPECT_NEAR(grip.force_N.value, 2.1, 1e-12);
  EXPECT_NEAR(grip.imbalance_N.value, 0.2, 1e-12);
  EXPECT_NEAR(grip.load_x_N.value, 0, 1e-12);
  EXPECT_NEAR(grip.load_y_N.value, 0, 1e-12);
  EXPECT_NEAR(grip.load_z_N.value, -1, 1e-12);
  EXPECT_TRUE(grip.load_z_N.valid());
}

TEST(Grip, BothPadsSeeOneTurnOfTheObject) {
  // Turned right-handed about x: the left camera, which looks along it, sees it against its own normal.
  Touch left = touching(1, 0, 0, 0), right = left;
  left.skin.emplace().torsion_rad = valid(-0.10, 0.01);
  right.skin.emplace().torsion_rad = valid(0.13, 0.02);
  GripMeter meter(facing());
  const Grip grip = meter.add(left, right, {});
  EXPECT_NEAR(grip.turn_rad.value, 0.106, 1e-12);
  EXPECT_NEAR(grip.turn_rad.standard_error, std::sqrt(1 / (1e4 + 2.5e3)), 1e-12);
  right.skin.reset();
  EXPECT_NEAR(meter.add(left, right, {}).turn_rad.value, 0.10, 1e-12);
  left.skin.reset();
  EXPECT_EQ(meter.add(left, right, {}).turn_rad.validity, Validity::NotCalibrated);
}

TEST(Grip, ThicknessIsTheOpeningAndBothDents) {
  GripGeometry geometry = facing();
  geometry.pads[0].translation_mm = {-1, 5, 0};
  geometry.pads[1].translation_mm = {2, 5, 0};
  Touch left = touching(1, 0, 0, 0.4), right = touching(1, 0, 0, 0.5);
  left.surface->depth_sd_mm = 0.03;
  right.surface->depth_sd_mm = 0.04;
  GripMeter meter(geometry);
  const Grip grip = meter.add(left, right, valid(20, 0.12));
  EXPECT_NEAR(grip.thickness_mm.value, 23.9, 1e-12);
  EXPECT_NEAR(grip.thickness_mm.standard_error, 0.13, 1e-12);
  EXPECT_EQ(meter.add(left, right, {}).stiffness, StiffnessState::NoThickness);
}

TEST(Grip, TheWorsePartGivesTheState) {
  GripMeter meter(facing());
  Touch left = touching(1, 0, 0, 0), right = left;
  right.slip = Slip::Slip;
  EXPECT_EQ(meter.add(left, right, {}).slip, Slip::Slip);
  left.slip = Slip::Incipient;
  right.slip = Slip::Stick;
  right.shear_x_N.validity = Validity::OnsetUnseen;
  right.force_N.validity = Validity::AboveRange;
  const Grip grip = meter.add(left, right, {});
  EXPECT_EQ(grip.slip, Slip::Incipient);
  EXPECT_EQ(grip.force_N.validity, Validity::AboveRange);
  EXPECT_EQ(grip.load_y_N.validity, Validity::OnsetUnseen);
  Touch nothing;
  nothing.force_N.validity = Validity::NoContact;
  const Grip open = meter.add(left, nothing, {});
  EXPECT_EQ(open.force_N.validity, Validity::NoContact);
  EXPECT_EQ(open.thickness_mm.validity, Validity::NoContact);
  EXPECT_EQ(open.stiffness, StiffnessState::NotGripped);
}

/// An object of `stiffness` is squeezed; each finger has errors of its calibration and of each frame.
struct Squeeze {
  double stiffness_N_per_mm = 2, largest_N = 2, relative_force = 0.02, relative_depth = 0.02,
         opening_sd_mm = 0.005, frame_noise = 0.002;
  int frames = 60;

  /// Of the last frame; `hold`: as it was at the largest force.
  Grip grip(std::mt19937& random) const {
    std::normal_distribution<double> normal;
    GripMeter meter(facing());
    const double force_error[] = {normal(random) * relative_force, normal(random) * relative_force};
    const double depth_error[] = {normal(random) * relative_depth, normal(random) * relative_depth};
    const double opening_error = normal(random) * opening_sd_mm;
    Grip last;
    for (int k = 1; k <= frames; ++k) {
      const double force = largest_N * k / frames, depth = 0.4 * std::pow(force, 0.7);
      Touch touches[2];
      for (int i = 0; i < 2; ++i) {
        const double noise = frame_noise * normal(random);
        touches[i] = touching(force * (1 + force_error[i]) + noise, 0.05, 0.1,
                              depth * (1 + depth_error[i]) + frame_noise * normal(random));
        touches[i].force_N.standard_error = std::hypot(relative_force * force, frame_noise);
        touches[i].surface->depth_sd_mm = std::hypot(relative_depth * depth, frame_noise);
      }
      const double thickness = 30 - force / stiffness_N_per_mm;
      last = meter.add(touches[0], touches[1], valid(thickness - 2 * depth + opening_error, opening_sd_mm));
    }
    return last;
  }
};

TEST(Grip, IntervalsHoldWhatTheyPromise) {
  for (const double stiffness : {0.5, 2.0, 8.0}) {
    Squeeze squeeze;
    squeeze.stiffness_N_per_mm = stiffness;
    std::mt19937 random(5);
    int force = 0, imbalance = 0, thickness = 0, slope = 0;
    constexpr int kTrials = 2000;
    const auto holds = [](const Estimate& e, double truth) {
      return e.valid() && std::abs(e.value - truth) <= 1.96 * e.standard_error;
    };
    for (int trial = 0; trial < kTrials; ++trial) {
      const Grip grip = squeeze.grip(random);
      ASSERT_EQ(grip.stiffness, StiffnessState::Known);
      force += holds(grip.force_N, squeeze.largest_N);
      imbalance += holds(grip.imbalance_N, 0);
      thickness += holds(grip.thickness_mm, 30 - squeeze.largest_N / stiffness);
      slope += holds(grip.stiffness_N_per_mm, stiffness);
    }
    for (const int held : {force, imbalance, thickness, slope}) {
      EXPECT_GE(held, 0.90 * kTrials) << stiffness;
      EXPECT_LE(held, 0.98 * kTrials) << stiffness;
    }
  }
}

TEST(Grip, ErrorsOfTheLoadHold) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  // Pads that stand askew, so that each axis of the load has parts of all four shears.
  GripGeometry geometry;
  const double c = std::cos(0.5), s = std::sin(0.5);
  geometry.pads[0].rotation = {{{c, s, 0}, {-s, c, 0}, {0, 0, 1}}};
  geometry.pads[1].rotation = {{{c, 0, s}, {0, 1, 0}, {-s, 0, c}}};
  const double shears[] = {0.3, -0.2, 0.1, 0.4}, sds[] = {0.01, 0.03, 0.02, 0.05};
  const Vector3 truth = {c * 0.3 + s * -0.2 + c * 0.1, -s * 0.3 + c * -0.2 + 0.4, -s * 0.1};
  std::array<int, 3> held{};
  constexpr int kTrials = 4000;
  for (int trial = 0; trial < kTrials; ++trial) {
    Touch touches[] = {touching(1, 0, 0, 0), touching(1, 0, 0, 0)};
    const auto drawn = [&](int i) { return valid(shears[i] + sds[i] * normal(random), sds[i]); };
    touches[0].shear_x_N = drawn(0);
    touches[0].shear_y_N = drawn(1);
    touches[1].shear_x_N = drawn(2);
    touches[1].shear_y_N = drawn(3);
    const Grip grip = GripMeter(geometry).add(touches[0], touches[1], {});
    const Estimate load[] = {grip.load_x_N, grip.load_y_N, grip.load_z_N};
    for (size_t i = 0; i < 3; ++i)
      held[i] += std::abs(load[i].value - truth[i]) <= 1.96 * load[i].standard_error;
  }
  for (const int n : held) {
    EXPECT_GE(n, 0.93 * kTrials);
    EXPECT_LE(n, 0.97 * kTrials);
  }
}

TEST(Grip, AnObjectThatDoesNotGiveHasNoStiffness) {
  Squeeze squeeze;
  squeeze.stiffness_N_per_mm = 1000;
  std::mt19937 random(1);
  const Grip grip = squeeze.grip(random);
  EXPECT_EQ(grip.stiffness, StiffnessState::NotIdentifiable);
  EXPECT_FALSE(grip.stiffness_N_per_mm.valid());
  // Nor has a soft one after a few frames.
  squeeze.stiffness_N_per_mm = 1;
  squeeze.frames = 4;
  EXPECT_EQ(squeeze.grip(random).stiffness, StiffnessState::NotIdentifiable);
}

TEST(Grip, AStiffnessByDoubtfulForcesSaysSo) {
  const auto squeezed = [](const auto& validity_at) {
    GripMeter meter(facing());
    Grip grip;
    for (int k = 0; k < 40; ++k) {
      const double force_N = 0.1 * (k + 1);
      Touch left = touching(force_N, 0, 0, 0.1), right = left;
      right.force_N = {force_N, 0.05 * force_N, validity_at(k)};
      left.surface->depth_sd_mm = 0.01;
      grip = meter.add(left, right, valid(20 - force_N / 2.5, 0.02));
    }
    return grip;
  };
  for (const Validity doubt : {Validity::Unfit, Validity::AtBorder}) {
    const Grip all = squeezed([&](int) { return doubt; });
    EXPECT_NEAR(all.stiffness_N_per_mm.value, 2.5, 0.2);
    EXPECT_EQ(all.stiffness_N_per_mm.validity, doubt);
    EXPECT_STREQ(to_string(all.stiffness), "force in doubt");
    // Valid forces are enough, and then alone.
    const Grip half = squeezed([&](int k) { return k % 2 ? doubt : Validity::Valid; });
    EXPECT_EQ(half.stiffness, StiffnessState::Known);
    EXPECT_TRUE(half.stiffness_N_per_mm.valid());
  }
  EXPECT_EQ(squeezed([](int) { return Validity::NotCalibrated; }).stiffness, StiffnessState::NotIdentifiable);
}

}  // namespace
}  // namespace palpate
