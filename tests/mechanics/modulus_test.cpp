// Young's modulus from presses: observations by finite elements, and observations without information.
#include "engine/elasticity/modulus/modulus.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "capture/synthetic/modulus_press.h"
#include "engine/elasticity/modulus/press_truth.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kPad_MPa = 0.2;

ModulusSetup setup_for(SampleShape shape) {
  ModulusSetup s;
  s.pad = {{kPad_MPa, 0.5}, 6, Base::Bonded};
  s.sample = usual_sample(shape);
  s.pad_relative_sd = s.force_relative_sd = 0.01;
  return s;
}

const ModulusEstimate& way(const ModulusAnswer& a, ModulusMethod w) {
  return a.methods[static_cast<size_t>(w)];
}

/// Readings of presses by finite elements: of a ball the radius is what the model says, since nodes tell it
/// only to their distance.
std::vector<PressFrame> true_presses(const ModulusSetup& s, double young_MPa, int count, double zero_mm = 0) {
  const PressModel model(s.pad, s.sample);
  const PressTruth truth(s.pad, s.sample, 40);
  const double most = usual_force_N(model, young_MPa, kPad_MPa);
  std::vector<PressFrame> frames;
  for (int i = 0; i < count; ++i) {
    const double force_N = most * (0.4 + 0.6 * i / (count - 1));
    const TruePress t = truth.press(force_N, young_MPa, kPad_MPa);
    PressFrame f;
    f.force_N = force_N;
    f.radius_mm = {s.sample.flat() ? t.r_mm.back() : model.at_force(force_N, young_MPa, kPad_MPa).radius_mm,
                   0.002};
    f.depth_mm = {t.depth_mm, 0.0005};
    if (s.sample.flat()) f.mean_depth_mm = {t.mean_depth_mm, 0.0005};
    f.approach_mm = {t.approach_mm + zero_mm, 0.002};
    frames.push_back(f);
  }
  return frames;
}

TEST(Modulus, EveryWayFindsWhatFiniteElementsWereGiven) {
  for (const SampleShape shape : {SampleShape::Cylinder, SampleShape::Sphere})
    for (const double young : {0.02, 0.5}) {
      const ModulusSetup s = setup_for(shape);
      const ModulusAnswer a = estimate_modulus(true_presses(s, young, 4, 0.2), s);
      for (const ModulusMethod w : {ModulusMethod::StressStrain, ModulusMethod::DisplacementRatio,
                                    ModulusMethod::Hertz, ModulusMethod::Joint}) {
        const ModulusEstimate& e = way(a, w);
        if ((w == ModulusMethod::Hertz && s.sample.flat()) ||
            (w == ModulusMethod::StressStrain && !s.sample.flat())) {
          EXPECT_EQ(e.state, ModulusState::NotApplicable);
          EXPECT_FALSE(e.reason.empty());
          continue;
        }
        ASSERT_EQ(e.state, ModulusState::Valid) << to_string(shape) << " " << to_string(w) << " " << e.reason;
        EXPECT_NEAR(e.young_MPa, young, 0.03 * young) << to_string(shape) << " " << to_string(w);
        EXPECT_LT(e.low_MPa, young);
        EXPECT_GT(e.high_MPa, young);
      }
      EXPECT_EQ(a.chosen, ModulusMethod::Joint);
    }
}

TEST(Modulus, CubeByItsEdgeAlone) {
  const ModulusSetup s = setup_for(SampleShape::Cube);
  std::vector<PressFrame> frames = true_presses(s, 0.103, 2);
  for (PressFrame& f : frames) f.approach_mm = {};
  const ModulusAnswer a = estimate_modulus(frames, s);
  EXPECT_EQ(a.best().state, ModulusState::Valid) << a.best().reason;
  EXPECT_NEAR(a.best().young_MPa, 0.103, 0.03 * 0.103);
}

// A stage whose travel is read 40 % too large: of a ball only the joint fit uses it, and rejects the
// readings. What a way says that does not use it is no answer either, for nobody knows which reading is
// wrong.
TEST(Modulus, NoValueIsGivenThatTheJointFitRejects) {
  const ModulusSetup s = setup_for(SampleShape::Sphere);
  std::vector<PressFrame> frames = true_presses(s, 0.03, 6);
  ASSERT_EQ(estimate_modulus(frames, s).best().state, ModulusState::Valid);
  for (PressFrame& f : frames) f.approach_mm.value *= 1.4;
  const ModulusAnswer a = estimate_modulus(frames, s);
  EXPECT_EQ(way(a, ModulusMethod::Hertz).state, ModulusState::Valid);
  EXPECT_EQ(a.chosen, ModulusMethod::Joint);
  EXPECT_EQ(a.best().state, ModulusState::DoesNotFit) << a.best().reason;
  EXPECT_FALSE(a.best().has_value());
  EXPECT_FALSE(a.best().has_bounds());
}

TEST(Modulus, ForceAndDepthAloneAreThePads) {
  const ModulusSetup s = setup_for(SampleShape::Cube);
  std::vector<PressFrame> frames = true_presses(s, 0.103, 3);
  for (PressFrame& f : frames) f.approach_mm = f.radius_mm = {};
  const ModulusAnswer a = estimate_modulus(frames, s);
  for (const ModulusEstimate& e : a.methods) {
    EXPECT_EQ(e.state, ModulusState::NotApplicable);
    EXPECT_EQ(e.young_MPa, 0);
  }
}

TEST(Modulus, HalfSpaceStressOverStrainOfABall) {
  // Eq. 79 for a ball holds on a deep pad: Hertz's own numbers give its modulus back.
  ModulusSetup s = setup_for(SampleShape::Sphere);
  s.pad.thickness_mm = 200;
  std::vector<PressFrame> frames;
  const double modulus = effective_modulus_MPa({0.1, 0.5}, {kPad_MPa, 0.5});
  for (const double force : {0.001, 0.002, 0.003, 0.004})
    frames.push_back({force, 0, {hertz_contact(force, modulus, 8).radius_mm, 0.002}, {}, {}, {}});
  const ModulusAnswer a = estimate_modulus(frames, s);
  EXPECT_NEAR(way(a, ModulusMethod::StressStrain).young_MPa, 0.1, 1e-5);
  EXPECT_NEAR(way(a, ModulusMethod::Hertz).young_MPa, 0.1, 0.002);
}

TEST(Modulus, RubberLawTakesOutWhatStrainDoes) {
  ModulusSetup s = setup_for(SampleShape::Cube);
  s.law = MaterialLaw::Rubber;
  const PressModel model(s.pad, s.sample);
  const double young = 0.05, face = s.sample.face_mm2();
  std::vector<PressFrame> frames;
  for (const double length : {0.95, 0.9, 0.8, 0.7}) {
    // The closed form: nominal stress E/3 (1/l^2 - l).
    const double force = young * face / 3 * (1 / (length * length) - length);
    const double spread = 1 / std::sqrt(length),
                 mean = force / kPad_MPa * model.mean_depth_per_force(young / kPad_MPa, spread);
    PressFrame f;
    f.force_N = force;
    f.mean_depth_mm = {mean, 0.001};
    f.approach_mm = {mean + 10 * (1 - length), 0.005};
    frames.push_back(f);
  }
  const ModulusAnswer rubber = estimate_modulus(frames, s);
  EXPECT_NEAR(way(rubber, ModulusMethod::StressStrain).young_MPa, young, 0.002 * young);
  EXPECT_NEAR(rubber.best().young_MPa, young, 0.01 * young);
  s.law = MaterialLaw::Linear;
  const ModulusAnswer linear = estimate_modulus(frames, s);
  EXPECT_NE(linear.best().state, ModulusState::Valid);  // 30 % is not a small strain
  EXPECT_FALSE(linear.best().reason.empty());
}

TEST(Modulus, ManyRatiosAreAStateAndNeverAWrongNumber) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (const SampleShape shape : {SampleShape::Cube, SampleShape::Sphere}) {
    const ModulusSetup s = setup_for(shape);
    const PressModel model(s.pad, s.sample);
    for (int decade = -3; decade <= 5; decade += shape == SampleShape::Cube ? 1 : 2) {
      const double young = kPad_MPa * std::pow(10, decade);
      const double most = usual_force_N(model, young, kPad_MPa);
      std::vector<PressFrame> frames;
      for (int i = 1; i <= 6; ++i) {
        const PressSight seen = model.at_force(most * i / 6, young, kPad_MPa);
        PressFrame f;
        f.force_N = most * i / 6;
        f.radius_mm = {seen.radius_mm + 0.003 * normal(random), 0.003};
        f.depth_mm = {seen.depth_mm + 1e-4 * normal(random), 1e-4};
        f.approach_mm = {seen.approach_mm + 0.005 * normal(random), 0.005};
        frames.push_back(f);
      }
      const ModulusEstimate e = estimate_modulus(frames, s).best();
      if (e.state == ModulusState::Valid) {
        EXPECT_LT(std::abs(std::log(e.young_MPa / young)), 1.2 * std::log(e.high_MPa / e.young_MPa) + 0.02)
            << to_string(shape) << " 1e" << decade;
      } else {
        EXPECT_FALSE(e.reason.empty());
        EXPECT_EQ(e.young_MPa, 0) << "a value with " << to_string(e.state);
      }
      if (decade >= 3) {
        EXPECT_EQ(e.state, ModulusState::PadLimited) << to_string(shape) << " 1e" << decade;
        EXPECT_LT(e.low_MPa, young);
      }
      if (decade >= -2 && decade <= 0) {
        EXPECT_EQ(e.state, ModulusState::Valid) << to_string(shape) << decade;
      }
    }
  }
}

TEST(Modulus, StrainsFromNothingToHalf) {
  const ModulusSetup s = setup_for(SampleShape::Cylinder);
  const PressModel model(s.pad, s.sample);
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  for (const double strain : {1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5}) {
    const double young = 0.1, most = strain * young * s.sample.face_mm2();
    std::vector<PressFrame> frames;
    for (int i = 1; i <= 6; ++i) {
      const PressSight seen = model.at_force(most * i / 6, young, kPad_MPa);
      PressFrame f;
      f.force_N = most * i / 6;
      f.radius_mm = {seen.radius_mm + 0.003 * normal(random), 0.003};
      f.mean_depth_mm = {seen.mean_depth_mm + 0.001 * normal(random), 0.001};
      f.approach_mm = {seen.approach_mm + 0.005 * normal(random), 0.005};
      frames.push_back(f);
    }
    const ModulusEstimate e = estimate_modulus(frames, s).best();
    if (strain <= 1e-4 || strain > 0.4) {
      EXPECT_NE(e.state, ModulusState::Valid) << strain;
    } else if (e.state == ModulusState::Valid) {
      EXPECT_LT(std::abs(std::log(e.young_MPa / young)), 1.2 * std::log(e.high_MPa / e.young_MPa)) << strain;
    }
    if (strain == 1e-2 || strain == 0.1) {
      EXPECT_EQ(e.state, ModulusState::Valid) << strain;
    }
  }
}

TEST(Modulus, ReadingsThatContradictEachOtherAreSaid) {
  const ModulusSetup s = setup_for(SampleShape::Cylinder);
  std::vector<PressFrame> frames = true_presses(s, 0.103, 4);
  frames[1].approach_mm.value += 0.3;  // a slipped stage
  EXPECT_EQ(estimate_modulus(frames, s).best().state, ModulusState::DoesNotFit);
}

TEST(Modulus, TooFewReadingsAndNonsense) {
  const ModulusSetup s = setup_for(SampleShape::Cylinder);
  EXPECT_EQ(estimate_modulus({}, s).best().state, ModulusState::TooFew);
  PressFrame one;
  one.force_N = 0.5;
  one.approach_mm = {1, 0.005};
  EXPECT_EQ(estimate_modulus({one}, s).best().state, ModulusState::TooFew);
  one.force_N = -1;
  EXPECT_THROW(estimate_modulus({one}, s), Error);
  one.force_N = 1;
  one.radius_mm.value = std::numeric_limits<double>::infinity();
  EXPECT_THROW(estimate_modulus({one}, s), Error);
  ModulusSetup bad = s;
  bad.replicates = 1;
  EXPECT_THROW(estimate_modulus({}, bad), Error);
}

TEST(Modulus, SameSeedSameInterval) {
  ModulusSetup s = setup_for(SampleShape::Cylinder);
  const std::vector<PressFrame> frames = true_presses(s, 0.103, 8);
  const ModulusAnswer a = estimate_modulus(frames, s), b = estimate_modulus(frames, s);
  EXPECT_EQ(a.best().low_MPa, b.best().low_MPa);
  s.seed = 2;
  EXPECT_NE(estimate_modulus(frames, s).best().low_MPa, a.best().low_MPa);
}

}  // namespace
}  // namespace palpate
