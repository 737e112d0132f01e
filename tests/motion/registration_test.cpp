#include "engine/motion/registration.h"

#include <gtest/gtest.h>

#include <cmath>

#include "palpate/error.h"
#include "perf/motion/moved_object.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

using namespace scenes;

constexpr std::pair<DepthNoise, const char*> kNoises[] = {{DepthNoise::None, "no noise"},
                                                          {DepthNoise::White, "white"},
                                                          {DepthNoise::Reach3, "reach 3 px"},
                                                          {DepthNoise::Integrated, "integrated"}};

struct Trial {
  Registration found;
  Vector6d error;  ///< seen at found.at_mm, of the truth that differs by what is unknown and turns least
};
/// Two frames of an object that moves by up to half a millimetre and three degrees.
Trial trial(const SolidObject& object, DepthNoise kind, std::mt19937& random, const PadView& pad = {},
            const RegistrationOptions& options = {}) {
  std::uniform_real_distribution<double> any(-1, 1);
  Vector6d twist;
  for (int k = 0; k < 6; ++k)
    twist[k] = any(random) * (k < 2 ? 0.5 : k == 2 ? 0.05 : (k < 5 ? 1 : 3) * kDegree);
  const RigidMotion truth = motion_about(Eigen::Vector3d::Zero(), twist);
  const PressedMap before = pressed(object, {}, pad, 0.002, kind, random);
  const PressedMap after = pressed(object, truth, pad, 0.002, kind, random);
  Trial out;
  out.found = register_surface(ContactSurface(before.map()), ContactSurface(after.map()), {}, options);
  out.error = twist_between(out.found.motion, out.found.freedom.least_turn(truth), out.found.at_mm);
  return out;
}

/// How often each component's interval of 95 % held the truth.
struct Held {
  int of[6] = {}, known[6] = {};
  double share() const {
    return double(of[0] + of[1] + of[2] + of[3] + of[4] + of[5]) /
           (known[0] + known[1] + known[2] + known[3] + known[4] + known[5]);
  }
  void add(const Trial& t) {
    for (int c = 0; c < 6; ++c) {
      if (!t.found.freedom.determined(c)) continue;
      ++known[c];
      of[c] += std::abs(t.error[c]) < 1.96 * std::sqrt(t.found.covariance(c, c)) ? 1 : 0;
    }
  }
};

// Depths with 0.002 mm of noise: the motion to a fiftieth of a pixel, and intervals that hold it.
TEST(Registration, IntervalsHoldTheTruthUnderEachNoise) {
  constexpr int kTrials = 25;
  for (const auto& [kind, noise] : kNoises) {
    if (kind == DepthNoise::None) continue;
    Held held;
    for (const SolidObject& object : {textured_dome(), key_relief(), coin()}) {
      std::mt19937 random(11);
      double squares[6] = {};
      for (int k = 0; k < kTrials; ++k) {
        const Trial t = trial(object, kind, random);
        ASSERT_TRUE(t.found.found && t.found.converged) << object.name << " " << noise << " " << k;
        held.add(t);
        for (int c = 0; c < 6; ++c) squares[c] += t.error[c] * t.error[c] / kTrials;
      }
      std::printf("%-13s %-10s RMS", object.name.c_str(), noise);
      for (int c = 0; c < 6; ++c)
        std::printf(c < 3 ? " %.5f" : " %.4f", std::sqrt(squares[c]) / (c < 3 ? 1 : kDegree));
      std::printf(" mm, degrees\n");
      for (int c = 0; c < 6; ++c)
        EXPECT_LT(std::sqrt(squares[c]), c < 3 ? 0.003 : 0.1 * kDegree) << object.name << c;
    }
    std::printf("%-10s held %.3f:", noise, held.share());
    for (int c = 0; c < 6; ++c) std::printf(" %d/%d", held.of[c], held.known[c]);
    std::printf("\n");
    EXPECT_GE(held.share(), 0.90) << noise;
    EXPECT_LE(held.share(), 0.985) << noise;
  }
}

/// Waves on a steep ball, at another place of them each time.
SolidObject rough_ball(double radius_mm, double deep_mm, double place_mm) {
  return {"rough ball", [=, waves = textured_plane()](double x, double y) {
            const double square = radius_mm * radius_mm - x * x - y * y;
            const double relief = 0.5 * (waves.depth_mm(x + place_mm, y - 2 * place_mm) - 0.45);
            return square > 0 ? std::sqrt(square) - radius_mm + relief + deep_mm : -radius_mm;
          }};
}

// The skin smooths depth along the pad, so that a surface that tilts is another one: a steep ball that rolls
// seems to slip as it does. What it is said to smooth by takes that away.
TEST(Registration, WhatTheSkinSmoothsIsNoMotion) {
  constexpr double kRadius_mm = 3, kDeep_mm = 0.7;
  const PadView pad{.width = 200, .height = 160, .pitch_mm = 0.05, .skin_px = 2.4};
  const double smoothed_mm2 = std::pow(pad.skin_px * pad.pitch_mm, 2) / 2;
  const SurfaceOptions inner{.border_px = 8};  // at the rim the skin spans
  std::mt19937 random(3);
  double unsaid_mm = 0, said_mm = 0;  // along the way it rolls, means
  constexpr int kPlaces = 6;
  for (int place = 0; place < kPlaces; ++place) {
    const double turn_deg = place % 2 == 0 ? 8 : -8;
    const SolidObject object = rough_ball(kRadius_mm, kDeep_mm, 0.7 * place);
    Vector6d twist = Vector6d::Zero();
    twist[4] = turn_deg * kDegree;
    const RigidMotion truth = motion_about({0, 0, kDeep_mm - kRadius_mm}, twist);
    const PressedMap before = pressed(object, {}, pad, 0, DepthNoise::None, random);
    const PressedMap after = pressed(object, truth, pad, 0, DepthNoise::None, random);
    const auto error_mm = [&](double smoothing_mm2) {
      RegistrationOptions options;
      options.skin_smoothing_mm2 = smoothing_mm2;
      const Registration found = register_surface(ContactSurface(before.map(), inner),
                                                  ContactSurface(after.map(), inner), truth, options);
      return twist_between(truth, found.motion, found.at_mm)[0] * (turn_deg > 0 ? 1 : -1);
    };
    const double one_mm = error_mm(0), other_mm = error_mm(smoothed_mm2);
    std::printf("turn %.0f degrees: %.4f mm, and %.4f mm\n", turn_deg, one_mm, other_mm);
    unsaid_mm += one_mm / kPlaces;
    said_mm += other_mm / kPlaces;
  }
  std::printf("mean: %.4f mm, and %.4f mm\n", unsaid_mm, said_mm);
  EXPECT_LT(unsaid_mm, -0.0005);
  EXPECT_LT(std::abs(said_mm), 0.5 * std::abs(unsaid_mm));
}

// What slides along itself is named, with its axis, and is never called determined.
TEST(Registration, NamesWhatASurfaceDoesNotDetermine) {
  const int trials = of_sweep(40, 8);
  const std::tuple<SolidObject, Slippage, const char*> cases[] = {
      {ball(), Slippage::Ball, "--+---"},          {plane(), Slippage::Plane, "--+++-"},
      {cylinder(), Slippage::Cylinder, "--+--+"},  {screw(), Slippage::Screw, "--+-++"},
      {textured_dome(), Slippage::None, "++++++"}, {key_relief(), Slippage::None, "++++++"},
      {coin(), Slippage::None, "++++++"}};
  for (const auto& [object, wanted, states] : cases)
    for (const auto& [kind, noise] : kNoises) {
      std::mt19937 random(5);
      // Without noise, what sampling leaves at edges decides of a coin's turning.
      if (kind == DepthNoise::None && wanted == Slippage::None) continue;
      for (int k = 0; k < trials; ++k) {
        const Trial t = trial(object, kind, random);
        const Freedom& freedom = t.found.freedom;
        std::string marks;
        for (int c = 0; c < 6; ++c) marks += freedom.determined(c) ? '+' : '-';
        EXPECT_STREQ(to_string(freedom.kind), to_string(wanted)) << object.name << " " << noise << " " << k;
        EXPECT_EQ(marks, states) << object.name << " " << noise << " " << k << " " << to_string(freedom.kind);
        if (wanted == Slippage::Plane) {
          EXPECT_GT(std::abs(freedom.axis[2]), 0.99);
        }
        if (wanted == Slippage::Cylinder) {
          EXPECT_GT(std::abs(freedom.axis[0] * 0.8 + freedom.axis[1] * 0.6), 0.99);
        }
        if (wanted == Slippage::Screw) {
          EXPECT_GT(std::abs(freedom.axis[0]), 0.99);
        }
        if (wanted == Slippage::Ball) {
          EXPECT_NEAR(freedom.pivot_mm[2], 0.7 - 8, 0.4);
        }
      }
    }
}

// What an unknown turn makes of a component grows with the way that the object may have rolled, and is the
// same about the normal.
TEST(Freedom, UnknownTurnsCountAsFarAsABodyRolls) {
  Freedom rolls{.radius_mm = 2}, spins{.radius_mm = 2}, slides{.radius_mm = 2};
  for (Freedom* of : {&rolls, &spins, &slides}) of->unknown = Eigen::MatrixXd::Zero(6, 1);
  rolls.unknown.col(0) << 0.1, 0, 0, 0, std::sqrt(0.99), 0;
  spins.unknown.col(0) << 0.1, 0, 0, 0, 0, std::sqrt(0.99);
  slides.unknown.col(0) << 1, 0, 0, 0, 0, 0;
  EXPECT_NEAR(rolls.unknown_sd(0, 0.01), 2 * 0.1 * 0.01, 1e-5);
  EXPECT_NEAR(rolls.unknown_sd(0, 0.1), 2 * 0.1 * 0.1, 2e-4);
  EXPECT_NEAR(rolls.unknown_sd(4, 0.1), 0.1, 0.001);
  EXPECT_EQ(rolls.unknown_sd(1, 0.1), 0);
  EXPECT_NEAR(spins.unknown_sd(0, 0.01), 2 * 0.1 * 0.5, 0.002);
  EXPECT_EQ(spins.unknown_sd(0, 0.01), spins.unknown_sd(0, 1));
  EXPECT_NEAR(slides.unknown_sd(0, 0.01), 2, 1e-9);
}

// An ellipsoid is nearly a surface of revolution: whatever is called determined is right.
TEST(Registration, WhatIsCalledDeterminedIsRight) {
  for (const auto& [kind, noise] : kNoises) {
    std::mt19937 random(3);
    for (int k = 0; k < 10; ++k) {
      const Trial t = trial(ellipsoid(), kind, random);
      for (int c = 0; c < 6; ++c)
        if (t.found.freedom.determined(c)) {
          EXPECT_LT(std::abs(t.error[c]), 4 * std::sqrt(t.found.covariance(c, c)) +
                                              3 * t.found.freedom.unknown_sd(c, 1) +
                                              (c < 3 ? 0.002 : 0.02 * kDegree))
              << noise << " " << k << " component " << c;
        }
    }
  }
}

// A sixth of the contact lifts between two frames of a slow motion: those pixels do not move the rest.
TEST(Registration, StrangersDoNotMoveIt) {
  std::mt19937 random(2);
  const PadView pad;
  Vector6d twist;
  twist << 0.1, -0.05, 0.02, 0, 0.005, 0.01;
  const RigidMotion truth = motion_about(Eigen::Vector3d::Zero(), twist);
  const PressedMap before = pressed(textured_dome(), {}, pad, 0.002, DepthNoise::White, random);
  PressedMap after = pressed(textured_dome(), truth, pad, 0.002, DepthNoise::White, random);
  size_t strangers = 0, all = 0;
  for (size_t i = 0; i < after.depth.size(); ++i) {
    all += after.contact[i];
    if (after.contact[i] == 0 || i % pad.width < 98) continue;
    after.depth[i] -= 0.05f + 0.01f * static_cast<float>(i % pad.width - 98);
    ++strangers;
  }
  EXPECT_GT(double(strangers), 0.15 * double(all));
  const Registration found = register_surface(ContactSurface(before.map()), ContactSurface(after.map()), {});
  const Vector6d error = twist_between(found.motion, truth, found.at_mm);
  EXPECT_LT(error.head<3>().norm(), 0.003);
  EXPECT_LT(error.tail<3>().norm(), 0.05 * kDegree);
  EXPECT_LT(found.fitting, 0.9);
}

// A pad's own errors stay where they are while the object slides: they are no texture of it, and are in the
// error.
TEST(Registration, WhatStaysWithThePadIsNoTexture) {
  for (const double slope_error : of_sweep<std::vector<double>>({0.01, 0.03}, {0.03})) {
    Held without, with;
    int claims_without = 0, claims = 0, wrong_names = 0;
    const PadView pad{.slope_error = slope_error};
    RegistrationOptions told;
    told.pad_slope_sd = slope_error;
    std::mt19937 random(21);
    for (int k = 0; k < of_sweep(40, 12); ++k) {
      const Trial blind = trial(textured_dome(), DepthNoise::White, random, pad, {});
      const Trial seen = trial(textured_dome(), DepthNoise::White, random, pad, told);
      without.add(blind);
      with.add(seen);
      const Trial ball_blind = trial(ball(), DepthNoise::White, random, pad, {});
      const Trial ball_seen = trial(ball(), DepthNoise::White, random, pad, told);
      wrong_names += ball_seen.found.freedom.kind != Slippage::Ball;
      for (const int c : {0, 1, 3, 4, 5}) {
        claims_without += ball_blind.found.freedom.determined(c);
        claims += ball_seen.found.freedom.determined(c);
      }
    }
    std::printf(
        "slopes wrong by %.2f: intervals held %.3f, untold %.3f; a ball's turns called %d, untold %d\n",
        slope_error, with.share(), without.share(), claims, claims_without);
    EXPECT_GE(with.share(), 0.90);
    EXPECT_LT(without.share(), with.share());
    if (slope_error > 0.02) {
      EXPECT_GT(claims_without, 10);
    }
    EXPECT_EQ(claims, 0);
    EXPECT_EQ(wrong_names, 0);
  }
}

// A map's level that is wrong by a known error is in the depth's interval, and in no other.
TEST(Registration, LevelErrorIsOfDepthAlone) {
  std::mt19937 random(3);
  PressedMap before = pressed(textured_dome(), {}, {}, 0.002, DepthNoise::White, random);
  PressedMap after = before;
  for (float& depth : after.depth) depth += 0.05f;
  const auto found = [&](double level_sd_mm) {
    HeightMap one = before.map(), two = after.map();
    one.level_sd_mm = two.level_sd_mm = level_sd_mm;
    return register_surface(ContactSurface(one), ContactSurface(two), {});
  };
  const Matrix6d more = found(0.03).covariance - found(0).covariance;
  EXPECT_NEAR(found(0).motion.shift_mm[2], 0.05, 1e-4);
  EXPECT_NEAR(more(2, 2), 2 * 0.03 * 0.03, 1e-9);
  EXPECT_NEAR(more.cwiseAbs().sum(), more(2, 2), 1e-12);
  const auto tilted = [&](double tilt_sd_rad) {
    HeightMap one = before.map(), two = after.map();
    one.tilt_sd_rad = two.tilt_sd_rad = tilt_sd_rad;
    return register_surface(ContactSurface(one), ContactSurface(two), {}).covariance;
  };
  const Matrix6d of_tilt = tilted(0.01) - tilted(0);
  for (const int k : {3, 4}) EXPECT_NEAR(of_tilt(k, k), 2e-4, 1e-9);
  EXPECT_NEAR(of_tilt.cwiseAbs().sum(), 4e-4, 1e-9);
}

TEST(Registration, RefusesMapsThatDoNotFit) {
  std::mt19937 random(1);
  PressedMap map = pressed(ball(), {}, {}, 0, DepthNoise::None, random);
  map.contact.pop_back();
  EXPECT_THROW(ContactSurface(map.map()), Error);
}

TEST(Registration, TellsThatThereIsNoContact) {
  std::mt19937 random(1);
  const PressedMap map = pressed(ball(8, -0.5), {}, {}, 0, DepthNoise::None, random);
  const ContactSurface nothing(map.map());
  EXPECT_EQ(nothing.count(), 0u);
  EXPECT_FALSE(register_surface(nothing, nothing, {}).found);
}

}  // namespace
}  // namespace palpate
