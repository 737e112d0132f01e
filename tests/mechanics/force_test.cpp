// Gray sum to newtons: the line, its stated error, and the state beyond the line's range.
#include "engine/measure/force.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "engine/calibrate/force/fit.h"

namespace palpate {
namespace {

// The paper's waveguide: F[mN] = 1.75e-5 G - 114.56, images at 537 to 1503 mN.
ForceCalibration paper() {
  ForceCalibration c;
  c.c1_N_per_gray = 1.75e-8;
  c.c0_N = -0.11456;
  c.residual_sd_N = 0.005;
  c.gray_min = (0.537 - c.c0_N) / c.c1_N_per_gray;
  c.gray_max = (1.503 - c.c0_N) / c.c1_N_per_gray;
  return c;
}

TEST(Force, PaperLine) {
  const ForceCalibration c = paper();
  for (const double force_N : {0.537, 0.966, 1.503}) {
    const double gray_sum = (force_N - c.c0_N) / c.c1_N_per_gray;
    const Estimate force = force_from_gray(c, gray_sum, true);
    EXPECT_NEAR(force.value, force_N, 1e-12);
    EXPECT_DOUBLE_EQ(force.standard_error, 0.005);
  }
}

TEST(Force, RangeAndDoubtsAreStated) {
  const ForceCalibration c = paper();
  const auto validity = [&](double gray_sum, bool contact = true, bool saturated = false) {
    return force_from_gray(c, gray_sum, contact, saturated ? 1 : 0).validity;
  };
  EXPECT_EQ(validity(c.gray_min), Validity::Valid);
  EXPECT_EQ(validity(c.gray_max), Validity::Valid);
  EXPECT_EQ(validity(std::nextafter(c.gray_min, 0)), Validity::BelowRange);
  EXPECT_EQ(validity(std::nextafter(c.gray_max, INFINITY)), Validity::AboveRange);
  // Clipped light makes every other statement doubtful, so it is the one that is shown.
  EXPECT_EQ(validity(c.gray_min, true, true), Validity::Saturated);
  EXPECT_EQ(validity(2 * c.gray_max, true, true), Validity::Saturated);
  // Without contact there is no force to doubt.
  for (const bool saturated : {false, true}) {
    const Estimate none = force_from_gray(c, 0, false, saturated ? 1 : 0);
    EXPECT_EQ(none.validity, Validity::NoContact);
    EXPECT_EQ(none.value, 0);
    EXPECT_EQ(none.standard_error, 0);
  }
}

TEST(Force, ErrorGrowsAwayFromTheReadings) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.01);
  std::vector<double> gray, force;
  for (int i = 0; i < 12; ++i) {
    gray.push_back(1e7 * (4 + i));
    force.push_back(2e-8 * gray.back() - 0.1 + noise(random));
  }
  const ForceCalibration c = line_calibration(gray, force);
  const auto error = [&](double g) { return force_from_gray(c, g, true).standard_error; };
  const double middle = 1e7 * (4 + 5.5);
  // At the mean of n readings a new one errs by s sqrt(1 + 1/n); elsewhere by more, alike on both sides.
  EXPECT_NEAR(error(middle), c.residual_sd_N * std::sqrt(1 + 1.0 / 12), 1e-9);
  EXPECT_NEAR(error(middle - 1e8), error(middle + 1e8), 1e-9);
  EXPECT_GT(error(middle + 1e8), 1.1 * error(middle));
  EXPECT_GT(error(middle + 2e8), error(middle + 1e8));
}

TEST(Force, BorderAndSaturationOutrankTheRange) {
  const ForceCalibration c = paper();
  ForceFeatures r;
  r.contact = r.at_border = true;
  for (const double gray : {0.5 * c.gray_min, c.gray_min, 2 * c.gray_max}) {
    r.gray_sum = gray;
    r.hidden_gray = 0;
    EXPECT_EQ(force_of(c, r).validity, Validity::AtBorder);
    r.hidden_gray = 1;
    EXPECT_EQ(force_of(c, r).validity, Validity::Saturated);
  }
}

TEST(Force, VolumeAndGradientNeedToBeMeasured) {
  ForceCalibration c{.c1_N_per_gray = 2, .gray_max = 10, .signal = ForceSignal::Volume};
  ForceFeatures r;
  r.contact = true;
  r.volume_mm3 = 3;
  EXPECT_EQ(force_of(c, r).validity, Validity::NotCalibrated);
  r.has_volume = true;
  EXPECT_EQ(force_of(c, r).value, 6);
  c.signal = ForceSignal::Area;
  r.area_px = 4;
  EXPECT_EQ(force_of(c, r).value, 8);
  c.signal = ForceSignal::Gradient;
  r.gradient_sum = 5;
  EXPECT_EQ(force_of(c, r).validity, Validity::NotCalibrated);
  r.has_gradient = true;
  EXPECT_EQ(force_of(c, r).value, 10);
  EXPECT_EQ(force_of(c, r).validity, Validity::Valid);
}

// The mean of two readings; what they differ by is in its error.
TEST(Force, LayerAndBending) {
  const ForceCalibration c{.c1_N_per_gray = 1.2,
                           .residual_sd_N = 0.3,
                           .gray_max = 100,
                           .signal = ForceSignal::LayerAndBending,
                           .model = ForceModel::Scale,
                           .residual_fraction = 0.1,
                           .bending_N_per_mm = 2};
  ForceFeatures r{.contact = true,
                  .layer_N = 10,
                  .layer_sd_N = 50,
                  .has_layer = true,
                  .layer_validity = Validity::AtBorder,
                  .bending_mm = 5};
  EXPECT_EQ(force_of(c, r).validity, Validity::NotCalibrated);
  r.has_bending = true;
  const Estimate agreed = force_of(c, r);
  EXPECT_DOUBLE_EQ(agreed.value, 12);
  EXPECT_NEAR(agreed.standard_error, std::hypot(0.3, 1.2), 1e-12);
  ForceCalibration ends = c;
  ends.residual_grows_to_N = 6;
  EXPECT_NEAR(force_of(ends, r).standard_error, std::hypot(0.3, 0.6), 1e-12);
  ends.residual_grows_to_N = 60;
  EXPECT_EQ(force_of(ends, r).standard_error, agreed.standard_error);
  EXPECT_EQ(agreed.validity, Validity::AtBorder);
  r.bending_mm = 2;
  EXPECT_DOUBLE_EQ(force_of(c, r).value, 1.2 * 7);
  EXPECT_NEAR(force_of(c, r).standard_error, 1.2 * 3, 1e-12);
  const ForceFeatures drawn = reading_at(c, 8);
  EXPECT_DOUBLE_EQ(signal_of(c, drawn), 8);
  EXPECT_DOUBLE_EQ(force_of(c, drawn).value, 9.6);
}

// Up the loading branch, back along the unloading one; between them just after a reversal, with an error that
// says so; noise does not swing it.
TEST(Force, FollowsTheBranches) {
  ForceCalibration c{.c1_N_per_gray = 1, .residual_sd_N = 0.01, .gray_max = 100};
  c.loading = ForceCurve{.c1 = 1, .residual_sd_N = 0.01};
  c.unloading = ForceCurve{.c1 = 0.5, .c0_N = 20, .residual_sd_N = 0.01};
  ForceHistory history;
  const auto at = [&](double gray) {
    ForceFeatures r;
    r.contact = true;
    r.gray_sum = gray;
    return history.update(c, r);
  };
  for (double g = 10; g <= 80; g += 10) EXPECT_DOUBLE_EQ(at(g).value, g);
  EXPECT_DOUBLE_EQ(at(80).standard_error, 0.01);
  const Estimate turning = at(77.5);  // half of the play of 5
  EXPECT_DOUBLE_EQ(turning.value, 0.5 * 77.5 + 0.5 * (0.5 * 77.5 + 20));
  EXPECT_NEAR(turning.standard_error, 0.5 * (77.5 - (0.5 * 77.5 + 20)), 0.01);
  for (const double g : {70.0, 50.0, 30.0}) EXPECT_DOUBLE_EQ(at(g).value, 0.5 * g + 20);
  EXPECT_NEAR(at(30.5).value, 0.5 * 30.5 + 20, 0.1 * std::abs(30.5 - 35.25) + 1e-9);  // noise
  EXPECT_DOUBLE_EQ(at(40).value, 40);                                                 // loading again
  ForceFeatures nothing;
  EXPECT_EQ(history.update(c, nothing).validity, Validity::NoContact);
  EXPECT_DOUBLE_EQ(at(60).value, 60);
  // First seen in the middle of a press: anywhere between the branches.
  history.interrupt();
  const Estimate unseen = at(60);
  EXPECT_DOUBLE_EQ(unseen.value, 55);
  EXPECT_GT(unseen.standard_error, 4.9);
}

TEST(Force, SplineIsMonotoneAndStaysAtItsEnds) {
  ForceCalibration c{.gray_min = 0, .gray_max = 30, .model = ForceModel::Spline};
  c.knots = {{0, 0}, {10, 1}, {12, 1}, {30, 4}};
  double last = -1;
  for (double s = -5; s < 40; s += 0.25) {
    const double f = force_at(c, s);
    EXPECT_GE(f, last) << s;
    last = f;
  }
  for (const auto& [s, f] : c.knots) EXPECT_DOUBLE_EQ(force_at(c, s), f);
  EXPECT_EQ(force_at(c, 11), 1) << "level between level knots";
  ForceFeatures r;
  r.contact = true;
  r.gray_sum = 50;
  EXPECT_EQ(force_of(c, r).value, 4);
  EXPECT_EQ(force_of(c, r).validity, Validity::AboveRange);
}

// Sensors calibrated with few noisy readings, then read: the truth lies within one stated error as often as
// Student's t says (0.667 for 16 degrees of freedom), inside and outside the calibrated range.
TEST(Force, StatedErrorCoversTheTruth) {
  std::mt19937 random(4);
  for (const double where : {0.5, 0.05, 0.95, 1.6}) {
    int inside = 0;
    constexpr int kSensors = 4000;
    for (int sensor = 0; sensor < kSensors; ++sensor) {
      constexpr double kSlope = 1.75e-8, kOffset = -0.1, kNoise_N = 0.02, kSpan = 9e7;
      std::normal_distribution<double> noise(0, kNoise_N);
      std::vector<double> gray, force;
      for (int i = 0; i < 18; ++i) {
        gray.push_back(1e7 + kSpan * i / 17);
        force.push_back(kSlope * gray.back() + kOffset + noise(random));
      }
      const ForceCalibration c = line_calibration(gray, force);
      const double g = 1e7 + kSpan * where;
      const Estimate estimate = force_from_gray(c, g, true);
      const double gauge_N = kSlope * g + kOffset + noise(random);
      inside += std::abs(estimate.value - gauge_N) <= estimate.standard_error;
    }
    EXPECT_NEAR(inside / double{kSensors}, 0.667, 0.03) << "at " << where << " of the range";
  }
}

}  // namespace
}  // namespace palpate
