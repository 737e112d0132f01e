// The shear tracker on scripted contacts: stick is a spring, slip is Coulomb's limit, and nothing grows
// without bound.
#include "engine/measure/motion/shear.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace palpate {
namespace {

constexpr double kShearPitch_mm = 0.05;

ShearCalibration springs() {
  ShearCalibration c;
  c.kx_N_per_mm = 2;
  c.ky_N_per_mm = 3;
  c.friction = 0.5;
  c.relative_sd = 0.02;
  return c;
}

Touch at(double x_mm, double y_mm, double force_N = 1) {
  Touch t;
  t.contact = true;
  t.centroid_x_px = x_mm / kShearPitch_mm;
  t.centroid_y_px = y_mm / kShearPitch_mm;
  t.force_N = {force_N, 0.01, Validity::Valid};
  return t;
}

Touch nothing() {
  Touch t;
  t.centroid_x_px = t.centroid_y_px = NAN;
  t.force_N.validity = Validity::NoContact;
  return t;
}

class Shear : public testing::Test {
 protected:
  Touch see(Touch touch) {
    tracker_.update(calibrated_ ? &calibration_ : nullptr, touch);
    return touch;
  }
  ShearCalibration calibration_ = springs();
  bool calibrated_ = true;
  ShearTracker tracker_{kShearPitch_mm};
};

TEST_F(Shear, SticksAsASpring) {
  EXPECT_EQ(see(at(3, 4)).slip, Slip::Stick);
  for (int i = -10; i <= 10; ++i) {
    const double u = 0.01 * i, v = -0.008 * i;
    const Touch t = see(at(3 + u, 4 + v));
    EXPECT_NE(t.slip, Slip::Slip);
    EXPECT_NEAR(t.shear_x_N.value, 2 * u, 1e-12);
    EXPECT_NEAR(t.shear_y_N.value, 3 * v, 1e-12);
    EXPECT_NEAR(t.shift_x_mm, u, 1e-12);
    EXPECT_NEAR(t.shift_y_mm, v, 1e-12);
    EXPECT_EQ(t.shear_x_N.validity, Validity::Valid);
    EXPECT_EQ(t.shear_y_N.validity, Validity::Valid);
    // The error includes the stiffness's part and is never less than the centroid's.
    EXPECT_GE(t.shear_x_N.standard_error, std::abs(0.02 * t.shear_x_N.value));
    EXPECT_GT(t.shear_x_N.standard_error, 0);
  }
}

TEST_F(Shear, SlipsAtTheFrictionLimitAndNeverPassesIt) {
  see(at(0, 0));
  for (int i = 1; i <= 500; ++i) {
    const double u = 0.02 * i;
    const double force_N = 1 + 0.5 * std::sin(0.1 * i);
    const Touch t = see(at(u, 0.5 * u, force_N));
    const double shear_N = std::hypot(t.shear_x_N.value, t.shear_y_N.value);
    EXPECT_LE(shear_N, 0.5 * force_N * (1 + 1e-12)) << "frame " << i;
    if (t.slip == Slip::Slip) {
      EXPECT_NEAR(shear_N, 0.5 * force_N, 1e-12) << "frame " << i;
      // At the limit the normal force's error counts too.
      EXPECT_GE(t.shear_x_N.standard_error, 0.5 * t.force_N.standard_error);
    }
    EXPECT_NEAR(t.shift_x_mm, u, 1e-9) << "the shift is that since onset, slip or not";
  }
}

// Friction turns with the motion: a long straight slip pulls along its direction, whatever came before.
TEST_F(Shear, LongSlipPullsAlongTheMotion) {
  calibration_.ky_N_per_mm = calibration_.kx_N_per_mm;
  see(at(0, 0));
  double x_mm = 0, y_mm = 0;
  for (int i = 0; i < 300; ++i) see(at(x_mm += 0.02, y_mm));
  Touch t;
  for (int i = 0; i < 300; ++i) t = see(at(x_mm, y_mm += 0.02));
  EXPECT_EQ(t.slip, Slip::Slip);
  EXPECT_NEAR(t.shear_x_N.value, 0, 0.01);
  EXPECT_NEAR(t.shear_y_N.value, 0.5, 0.01);
}

TEST_F(Shear, ReversalUnloadsAtOnce) {
  see(at(0, 0));
  for (int i = 1; i <= 100; ++i) see(at(0.05 * i, 0));
  // The spring is 0.25 mm long at the limit. Turning back it shortens from there, not from where it started.
  for (int i = 1; i <= 9; ++i) {
    const Touch t = see(at(5 - 0.05 * i, 0));
    // Its rim slips at more than 0.39 of the limit, 1 - 0.85^3.
    EXPECT_EQ(t.slip, i == 4 || i == 5 || i == 6 ? Slip::Stick : Slip::Incipient) << "frame " << i;
    EXPECT_NEAR(t.shear_x_N.value, 0.5 - 0.1 * i, 1e-9) << "frame " << i;
  }
  for (int i = 11; i <= 40; ++i) {
    const Touch t = see(at(5 - 0.05 * i, 0));
    EXPECT_EQ(t.slip, Slip::Slip) << "frame " << i;
    EXPECT_NEAR(t.shear_x_N.value, -0.5, 1e-9) << "frame " << i;
  }
}

TEST_F(Shear, NewContactIsANewOnset) {
  see(at(0, 0));
  EXPECT_NEAR(see(at(0.1, 0)).shear_x_N.value, 0.2, 1e-12);
  const Touch gone = see(nothing());
  EXPECT_EQ(gone.slip, Slip::NoContact);
  EXPECT_EQ(gone.shear_x_N.validity, Validity::NoContact);
  EXPECT_EQ(gone.shear_x_N.value, 0);
  EXPECT_EQ(gone.shift_x_mm, 0);
  const Touch back = see(at(7, -3));
  EXPECT_EQ(back.shear_x_N.value, 0);
  EXPECT_EQ(back.shear_y_N.value, 0);
  EXPECT_EQ(back.shift_x_mm, 0);
  EXPECT_NEAR(see(at(7.1, -3)).shear_x_N.value, 0.2, 1e-12);
}

TEST_F(Shear, UncalibratedKnowsOnlyTheShift) {
  calibrated_ = false;
  EXPECT_EQ(see(nothing()).slip, Slip::NotCalibrated);
  see(at(0, 0));
  const Touch t = see(at(0.3, -0.4));
  EXPECT_NEAR(t.shift_x_mm, 0.3, 1e-12);
  EXPECT_NEAR(t.shift_y_mm, -0.4, 1e-12);
  EXPECT_EQ(t.slip, Slip::NotCalibrated);
  EXPECT_EQ(t.shear_x_N.validity, Validity::NotCalibrated);
  EXPECT_EQ(t.shear_x_N.value, 0);
}

// Springs without a calibrated normal force: K u is known, stick and slip are not, and no number is called
// valid.
TEST_F(Shear, WithoutNormalForceSlipIsNotJudged) {
  const auto unknown_force = [](double x_mm) {
    Touch t = at(x_mm, 0);
    t.force_N = {};
    return t;
  };
  see(unknown_force(0));
  const Touch t = see(unknown_force(0.4));
  EXPECT_EQ(t.slip, Slip::NotCalibrated);
  EXPECT_NEAR(t.shear_x_N.value, 0.8, 1e-12);
  EXPECT_EQ(t.shear_x_N.validity, Validity::NotCalibrated);
}

// Clipped light: the friction limit is a lower bound, so a shear held at it is one too; one below it is
// sound.
TEST_F(Shear, LimitFromClippedLightIsMarked) {
  const auto clipped = [](double x_mm) {
    Touch t = at(x_mm, 0);
    t.force_N.validity = Validity::Saturated;
    return t;
  };
  see(clipped(0));
  EXPECT_EQ(see(clipped(0.1)).shear_x_N.validity, Validity::Valid);
  const Touch t = see(clipped(0.4));
  EXPECT_EQ(t.slip, Slip::Slip);
  EXPECT_EQ(t.shear_x_N.validity, Validity::Saturated);
  EXPECT_EQ(t.shear_y_N.validity, Validity::Saturated);
}

// A calibration with a negative c0 can say less than 0 N of a light touch: no friction, never a negative
// limit, and nothing known of a slide.
TEST_F(Shear, NegativeForceHoldsNothing) {
  see(at(0, 0, -0.1));
  const Touch t = see(at(0.2, 0.1, -0.1));
  EXPECT_EQ(t.slip, Slip::Stick);
  EXPECT_EQ(t.shear_x_N.value, 0);
  EXPECT_EQ(t.shear_y_N.value, 0);
}

TEST_F(Shear, AContactThatBeganUnseenSaysSoUntilItEnds) {
  see(at(1, 1));
  EXPECT_EQ(see(at(1.1, 1)).shear_x_N.validity, Validity::Valid);
  tracker_.interrupt();
  const Touch first = see(at(1.4, 1));
  EXPECT_EQ(first.shear_x_N.validity, Validity::OnsetUnseen);
  EXPECT_EQ(first.shear_x_N.value, 0);  // counts from here
  const Touch next = see(at(1.5, 1));
  EXPECT_EQ(next.shear_y_N.validity, Validity::OnsetUnseen);
  EXPECT_NEAR(next.shear_x_N.value, 2 * 0.1, 1e-12);
  see(nothing());
  EXPECT_EQ(see(at(1.5, 1)).shear_x_N.validity, Validity::Valid);  // this onset was seen
}

TEST_F(Shear, AnInterruptionWithoutContactChangesNothing) {
  tracker_.interrupt();
  see(nothing());
  EXPECT_EQ(see(at(1, 1)).shear_x_N.validity, Validity::Valid);
}

}  // namespace
}  // namespace palpate
