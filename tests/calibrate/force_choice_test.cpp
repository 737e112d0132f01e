// Choice of the force curve: the curve, its report and its refusals, on observations of a known law.
#include "engine/calibrate/force/choice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <string>

#include "engine/calibrate/force/fit.h"
#include "engine/calibrate/force/scatter.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kGray_per_N = 1e6;

/// Presses to different heights, up and down, 40 readings each, 20 a second; `gray` of force and direction.
std::vector<ForceSample> presses(int count, double noise_N, uint32_t seed,
                                 const std::function<double(double, bool)>& gray) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  std::vector<ForceSample> samples;
  for (int p = 0; p < count; ++p) {
    const double height_N = 1.2 + 0.8 * p / std::max(count - 1, 1);
    for (int i = 0; i < 40; ++i) {
      const bool up = i < 20;
      const double force_N = height_N * (up ? 0.05 + 0.05 * i : 1 - 0.05 * (i - 20));
      ForceSample s;
      s.features.contact = true;
      s.features.gray_sum = gray(force_N, up);
      s.features.area_px = 3000 * std::sqrt(s.features.gray_sum / kGray_per_N);
      s.force_N = force_N + noise_N * normal(random);
      s.frame = 60 * static_cast<uint64_t>(p) + static_cast<uint64_t>(i);
      s.time_s = static_cast<double>(s.frame) / 20;
      s.press = static_cast<uint32_t>(p);
      samples.push_back(s);
    }
  }
  return samples;
}
double straight(double force_N, bool) {
  return kGray_per_N * (force_N + 0.1);
}

TEST(ForceFit, FindsEachLaw) {
  std::vector<double> s, f, w;
  for (int i = 0; i <= 60; ++i) {
    s.push_back(1e5 * i);
    f.push_back(3e-5 * std::pow(1e5 * i, 0.7) - 0.05);
  }
  const CurveFit power = fit_curve(ForceModel::Power, s, f);
  EXPECT_NEAR(power.curve.exponent, 0.7, 1e-4);
  EXPECT_NEAR(power.curve.c0_N, -0.05, 1e-4);
  EXPECT_LT(power.residual_sd_N, 1e-5);
  const CurveFit spline = fit_curve(ForceModel::Spline, s, f);
  for (const double at : {3.3e5, 1.71e6, 5.05e6})
    EXPECT_NEAR(force_at(ForceModel::Spline, spline.curve, at), 3e-5 * std::pow(at, 0.7) - 0.05, 0.02) << at;
  // Weights choose: half the readings are another line's.
  for (size_t i = 0; i < s.size(); ++i) {
    w.push_back(i % 2 ? 1 : 0);
    f[i] = i % 2 ? 2e-6 * s[i] + 0.1 : 77;
  }
  const CurveFit line = fit_curve(ForceModel::Line, s, f, w);
  EXPECT_NEAR(line.curve.c1, 2e-6, 1e-12);
  EXPECT_NEAR(line.curve.c0_N, 0.1, 1e-7);
}

TEST(ForceFit, ExactLineIsFoundToTheLastDigits) {
  // The paper's line, Eq. 80, at its magnitude of G.
  std::vector<double> gray, force;
  for (int i = 0; i < 20; ++i) {
    gray.push_back(4e7 + 3e6 * i);
    force.push_back(1.75e-8 * gray.back() - 0.11456);
  }
  const ForceCalibration fit = line_calibration(gray, force);
  EXPECT_NEAR(fit.c1_N_per_gray, 1.75e-8, 1e-18);
  EXPECT_NEAR(fit.c0_N, -0.11456, 1e-11);
  EXPECT_NEAR(fit.r_squared, 1, 1e-12);
  EXPECT_LT(fit.residual_sd_N, 1e-12);
  EXPECT_EQ(fit.gray_min, 4e7);
  EXPECT_EQ(fit.gray_max, 4e7 + 57e6);
}

TEST(ForceFit, StatedErrorsAreTheErrorsThatHappen) {
  constexpr int kTrials = 2000, kReadings = 25;
  constexpr double kSlope = 2e-6, kOffset = 0.05, kNoise_N = 0.01, kAt = 4e5;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, kNoise_N);
  double squares = 0, stated = 0, sd = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<double> gray, force;
    for (int i = 0; i < kReadings; ++i) {
      gray.push_back(4e4 * i);
      force.push_back(kSlope * gray.back() + kOffset + noise(random));
    }
    const ForceCalibration c = line_calibration(gray, force);
    const double error = c.c1_N_per_gray * kAt + c.c0_N - (kSlope * kAt + kOffset);
    squares += error * error;
    stated += c.covariance[0] + 2 * kAt * c.covariance[1] + kAt * kAt * c.covariance[2];
    sd += c.residual_sd_N;
  }
  EXPECT_NEAR(squares / stated, 1, 0.1) << "variance of the line at G = 4e5";
  EXPECT_NEAR(sd / kTrials, kNoise_N, 0.02 * kNoise_N);
}

TEST(ForceFit, ScaleGoesThroughTheOrigin) {
  std::vector<double> shift, force;
  for (int i = -5; i <= 5; ++i) {
    shift.push_back(0.1 * i);
    force.push_back(2.5 * shift.back());
  }
  const CurveFit fit = fit_curve(ForceModel::Scale, shift, force);
  EXPECT_NEAR(fit.curve.c1, 2.5, 1e-12);
  EXPECT_LT(std::sqrt(fit.covariance[2]), 1e-9);
  EXPECT_EQ(fit.curve.c0_N, 0);
  EXPECT_THROW(fit_curve(ForceModel::Scale, std::vector<double>(4, 0.0), std::vector<double>{1, 1, 1, 2}),
               Error);
}

TEST(ForceFit, SplineNeverFalls) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.3);
  for (int round = 0; round < 20; ++round) {
    std::vector<double> s, f;
    for (int i = 0; i < 80; ++i) {
      s.push_back(i + 0.1 * round);
      f.push_back(std::min(1.0, i / 30.0) + noise(random));
    }
    const ForceCurve curve = fit_curve(ForceModel::Spline, s, f).curve;
    double last = force_at(ForceModel::Spline, curve, -10);
    EXPECT_EQ(last, curve.knots.front()[1]);
    for (double x = -5; x < 90; x += 0.5) {
      const double now = force_at(ForceModel::Spline, curve, x);
      EXPECT_GE(now, last - 1e-12) << "round " << round << " at " << x;
      last = now;
    }
    EXPECT_EQ(last, curve.knots.back()[1]) << "level beyond the last knot";
  }
}

TEST(ForceFit, RefusesFewerReadingsThanUnknowns) {
  const std::vector<double> two{1, 2}, three{1, 2, 3}, four{1, 2, 3, 4}, flat{2, 2, 2}, down{3, 2, 1};
  EXPECT_THROW(fit_curve(ForceModel::Line, two, two), Error);
  EXPECT_NO_THROW(fit_curve(ForceModel::Line, three, three));
  EXPECT_THROW(fit_curve(ForceModel::Power, three, three), Error);
  EXPECT_THROW(fit_curve(ForceModel::Spline, four, four), Error);
  EXPECT_THROW(fit_curve(ForceModel::Line, flat, three), Error);
  EXPECT_THROW(fit_curve(ForceModel::Line, three, flat), Error);
  EXPECT_THROW(fit_curve(ForceModel::Line, three, down), Error);
}

TEST(ForceChoice, EndsWhenItIsStopped) {
  std::vector<ForceSample> samples = presses(8, 0.01, 1, straight);
  const size_t all = choose_force(samples, {}).scores.size();
  int asked = 0;
  const ForceChoice c = choose_force(samples, {.stopped = [&] { return ++asked > 20; }});
  EXPECT_TRUE(c.stopped);
  EXPECT_GT(c.scores.size(), 0u) << "the candidates that were tried";
  EXPECT_LT(c.scores.size(), all);
}

TEST(ForceChoice, TakesTheSimplestThatWillDo) {
  std::vector<ForceSample> samples = presses(8, 0.01, 1, straight);
  const ForceChoice c = choose_force(samples, {});
  EXPECT_EQ(to_string(c.chosen.candidate), "line of gray sum, together");
  EXPECT_STREQ(c.blocks_are, "presses");
  EXPECT_EQ(c.blocks, 8u);
  EXPECT_EQ(c.readings, 320u);
  EXPECT_NEAR(c.calibration.c1_N_per_gray, 1e-6, 1e-8);
  EXPECT_NEAR(c.calibration.c0_N, -0.1, 0.005);
  EXPECT_GT(c.calibration.r_squared, 0.999);
  EXPECT_LT(c.calibration.hysteresis, 0.005);
  EXPECT_LT(std::abs(c.calibration.drift_N_per_min), 4 * c.drift_sd_N_per_min);
  EXPECT_NEAR(c.calibration.residual_sd_N, 0.01, 0.002);
  EXPECT_NEAR(c.interval_coverage, 0.95, 0.03);

  samples = presses(8, 0.01, 2, [](double f, bool) { return kGray_per_N * std::pow(f, 1.6); });
  EXPECT_EQ(choose_force(samples, {.signal = ForceSignal::GraySum}).chosen.candidate.model,
            ForceModel::Power);
}

TEST(ForceChoice, TellsLoadingFromUnloading) {
  // Coming back the pad glows more: at equal gray the force is less, by up to 0.1 N of 2 N.
  const auto lossy = [](double f, bool up) { return kGray_per_N * (f + (up ? 0 : 0.2 * f * (2 - f))); };
  std::vector<ForceSample> samples = presses(8, 0.003, 3, lossy);
  for (ForceSample& s : samples) s.force_N *= 2 / 1.2 / (1 + 0.8 / 1.2 * s.press / 7);  // all to 2 N
  for (ForceSample& s : samples) {
    const bool up = s.frame % 60 < 20;
    s.features.gray_sum = lossy(s.force_N, up);
  }
  const ForceChoice c = choose_force(samples, {});
  EXPECT_TRUE(c.chosen.candidate.branches) << to_string(c.chosen.candidate);
  ASSERT_TRUE(c.has_hysteresis);
  // Largest at f = 1 of 2: 0.2 gray more, which reads as 0.2 / 1.0 N too much along the branch's slope of 1.
  EXPECT_NEAR(c.calibration.hysteresis, 0.085, 0.02);
  ASSERT_TRUE(c.loading && c.unloading);
  EXPECT_GT(c.loading->curve.c1, 0);
  // The evaluator follows the branches: a press that the fit did not see, up and down.
  ForceHistory history;
  double worst_N = 0;
  for (int i = 0; i <= 80; ++i) {
    const bool up = i <= 40;
    const double f = up ? 0.1 + 1.9 * i / 40 : 2 - 1.9 * (i - 40) / 40;
    ForceFeatures r;
    r.contact = true;
    r.gray_sum = lossy(f, up);
    r.area_px = 3000 * std::sqrt(r.gray_sum / kGray_per_N);
    const Estimate e = history.update(c.calibration, r);
    if (e.validity == Validity::Valid) worst_N = std::max(worst_N, std::abs(e.value - f));
  }
  EXPECT_LT(worst_N, 0.06);
}

TEST(ForceChoice, FindsDriftAndOutliers) {
  std::vector<ForceSample> samples = presses(10, 0.004, 4, straight);
  for (ForceSample& s : samples) s.force_N += 0.3 * s.time_s / 60;
  samples[57].force_N += 0.8;
  samples[301].features.gray_sum *= 0.4;
  samples[301].features.area_px *= 0.4;
  const ForceChoice c = choose_force(samples, {.model = ForceModel::Line, .branches = false});
  EXPECT_NEAR(c.calibration.drift_N_per_min, 0.3, 0.05);
  EXPECT_LT(c.drift_sd_N_per_min, 0.05);
  for (size_t i = 0; i < samples.size(); ++i)
    EXPECT_EQ(samples[i].left_out, i == 57 || i == 301 ? LeftOut::Outlier : LeftOut::Used) << i;
}

// Noise that grows with the force: the interval is wide where it must be and narrow where it may.
TEST(ForceChoice, IntervalHoldsWhatItSays) {
  int inside = 0, inside_low = 0, count = 0, count_low = 0;
  for (uint32_t seed = 0; seed < 6; ++seed) {
    std::mt19937 random(50 + seed);
    std::normal_distribution<double> normal(0, 1);
    std::vector<ForceSample> samples = presses(8, 0, seed, straight);
    for (ForceSample& s : samples) s.force_N *= 1 + 0.03 * normal(random);
    const ForceCalibration c = choose_force(samples, {.signal = ForceSignal::GraySum}).calibration;
    for (int i = 0; i < 400; ++i) {
      const double f = 0.1 + 1.8 * i / 400;
      ForceFeatures r;
      r.contact = true;
      r.gray_sum = straight(f, true);
      const Estimate e = force_of(c, r, 0);
      const bool in = std::abs(e.value - f * (1 + 0.03 * normal(random))) <= 1.96 * e.standard_error;
      inside += in;
      ++count;
      if (f > 0.5) continue;
      inside_low += in;
      ++count_low;
    }
  }
  EXPECT_NEAR(inside / double(count), 0.95, 0.03);
  EXPECT_GT(inside_low / double(count_low), 0.9);
}

// Where gradients were measured they compete without being asked for, also on one recording; where they do
// not follow the force, the gray sum is taken.
TEST(ForceChoice, GradientsOfAGel) {
  for (const bool follow : {true, false}) {
    std::vector<ForceSample> samples = presses(8, 0.01, 6, straight);
    std::mt19937 random(7);
    std::normal_distribution<double> drift(1, 0.2);
    double light = 1;
    for (size_t i = 0; i < samples.size(); ++i) {
      if (i % 40 == 0) light = drift(random);  // of a camera that sets its exposure by itself
      ForceFeatures& r = samples[i].features;
      r.has_gradient = true;
      r.gradient_sum = 5000 * samples[i].force_N * (follow ? 1 : light);
      if (follow) r.gray_sum *= light;
    }
    const ForceChoice c = choose_force(samples, {});
    EXPECT_EQ(to_string(c.chosen.candidate),
              follow ? "line of gradient, together" : "line of gray sum, together");
    EXPECT_EQ(c.calibration.signal, follow ? ForceSignal::Gradient : ForceSignal::GraySum);
    EXPECT_LT(c.chosen.error_N, 0.02);
  }
}

/// Recordings of an object each, of which the layer's force and the bending read some part too much.
std::vector<ForceSample> objects(const std::vector<double>& layer, const std::vector<double>& bending) {
  std::vector<ForceSample> samples;
  for (size_t object = 0; object < layer.size(); ++object)
    for (ForceSample s : presses(2, 0.005, static_cast<uint32_t>(object), straight)) {
      s.recording = static_cast<uint32_t>(object);
      s.press += static_cast<uint32_t>(2 * object);
      s.features.gray_sum *= object % 2 ? 3 : 0.3;
      s.features.area_px *= object % 3 ? 2 : 0.5;
      s.features.layer_N = 0.8 * layer[object] * s.force_N;
      s.features.bending_mm = 5 * bending[object] * s.force_N;
      s.features.has_layer = s.features.has_bending = true;
      samples.push_back(s);
    }
  return samples;
}

// Two readings that err apart are taken together; one that errs far more than the other is not.
TEST(ForceChoice, MeanOfLayerAndBending) {
  const std::vector<double> one{1.3, 0.8, 1.2, 0.75, 1, 1.1}, other{0.75, 1.1, 0.8, 1.3, 1.2, 0.85},
      wild{3, 0.4, 0.5, 2.5, 0.3, 2};
  std::vector<ForceSample> apart = objects(one, other), poor = objects(one, wild);
  const ForceChoice both = choose_force(apart, {.model = ForceModel::Scale});
  EXPECT_EQ(to_string(both.chosen.candidate), "scale of layer and bending, together");
  for (const CandidateScore& score : both.scores)
    if (score.candidate.signal == ForceSignal::Layer) {
      EXPECT_LT(both.chosen.error_N, 0.6 * score.error_N);
    }
  EXPECT_NEAR(both.calibration.bending_N_per_mm, 0.8 / 5, 0.03);
  EXPECT_NEAR(both.calibration.c1_N_per_gray, 1 / 0.8, 0.1);
  EXPECT_EQ(choose_force(poor, {.model = ForceModel::Scale}).calibration.signal, ForceSignal::Layer);
  // How bending goes with force is a matter of shape: two objects do not judge it, unless it is asked for.
  std::vector<ForceSample> two = objects({1.3, 0.8}, {0.75, 1.1});
  EXPECT_EQ(choose_force(two, {.model = ForceModel::Scale}).calibration.signal, ForceSignal::Layer);
  EXPECT_EQ(choose_force(two, {.signal = ForceSignal::LayerAndBending}).calibration.signal,
            ForceSignal::LayerAndBending);
  two[3].features.has_bending = false;
  EXPECT_THROW(choose_force(two, {.signal = ForceSignal::LayerAndBending}), Error);
}

/// Presses of objects on a gel with a layer, on days of different light: the layer reads them all to some
/// part of `layer_off`, the gradients each day to a tenth of that, other days with another factor.
std::vector<ForceSample> gel_on_days(int days, bool named, double layer_off = 0.1) {
  std::vector<ForceSample> samples;
  const std::vector<double> off{1, -0.8, 0.4, -0.9, 0.7};
  uint32_t recording = 0;
  for (int day = 0; day < days; ++day)
    for (uint32_t object = 0; object < off.size(); ++object, ++recording)
      for (ForceSample s : presses(2, 0.005, recording, straight)) {
        s.recording = recording;
        s.press += 2 * recording;
        s.day = static_cast<uint32_t>(day);
        if (named) s.object = object;
        s.features.layer_N = (1 + layer_off * off[object]) * s.force_N;
        s.features.gradient_sum = 1e4 * (1 + 0.01 * off[object]) * (1 + 0.5 * day) * s.force_N;
        s.features.gray_sum = 3 * s.features.gradient_sum;
        s.features.area_px *= object % 2 ? 2 : 0.5;
        s.features.has_layer = s.features.has_gradient = true;
        samples.push_back(s);
      }
  return samples;
}

// On one day the gradients read objects that they never saw ten times better, and the next day with half as
// much again: one day does not speak for them where a layer reads force as well.
TEST(ForceChoice, OneDayDoesNotJudgeTheLight) {
  for (const bool named : {false, true}) {
    std::vector<ForceSample> one_day = gel_on_days(1, named), two = gel_on_days(2, named);
    const ForceChoice c = choose_force(one_day, {});
    EXPECT_EQ(c.calibration.signal, ForceSignal::Layer) << to_string(c.chosen.candidate);
    EXPECT_TRUE(c.objects_left_out && !c.days_left_out);
    const auto gradient = std::ranges::find(c.scores, "line of gradient, together",
                                            [](auto& score) { return to_string(score.candidate); });
    ASSERT_NE(gradient, c.scores.end());
    EXPECT_FALSE(gradient->eligible);
    EXPECT_LT(gradient->error_N, 0.3 * c.chosen.error_N) << "what was to be had";
    EXPECT_EQ(choose_force(one_day, {.signal = ForceSignal::Gradient}).calibration.signal,
              ForceSignal::Gradient);
    EXPECT_EQ(choose_force(one_day, {.model = ForceModel::Line}).calibration.model, ForceModel::Line);
    const ForceChoice both = choose_force(two, {});
    EXPECT_EQ(both.calibration.signal, ForceSignal::Layer) << to_string(both.chosen.candidate);
    EXPECT_TRUE(both.days_left_out);
  }
  // Days of one light, judged as such, speak for the gradients.
  std::vector<ForceSample> steady = gel_on_days(2, true);
  for (ForceSample& s : steady) {
    s.features.gradient_sum /= 1 + 0.5 * s.day;
    s.features.gray_sum /= 1 + 0.5 * s.day;
  }
  EXPECT_EQ(choose_force(steady, {}).calibration.signal, ForceSignal::Gradient);
}

// Two trials of one object in which the pixels change by the same too much: left out one by one they praise
// each other, left out together they do not.
TEST(ForceChoice, TrialsOfAnObjectAreLeftOutTogether) {
  const auto trials = [](bool named) {
    std::vector<ForceSample> samples;
    const std::vector<double> shape{1, 1.6, 0.7};
    for (uint32_t recording = 0; recording < 6; ++recording)
      for (ForceSample s : presses(2, 0.005, recording, straight)) {
        s.recording = recording;
        s.press += 2 * recording;
        if (named) s.object = recording / 2;
        s.features.gray_sum *= shape[recording / 2];
        s.features.area_px = 0.003 * s.features.gray_sum;
        samples.push_back(s);
      }
    return samples;
  };
  std::vector<ForceSample> apart = trials(false), together = trials(true);
  const ForceChoiceOptions line{ForceSignal::GraySum, ForceModel::Line, false};
  const ForceChoice leaks = choose_force(apart, line), honest = choose_force(together, line);
  EXPECT_STREQ(leaks.blocks_are, "recordings, each taken as an object of its own");
  EXPECT_EQ(leaks.blocks, 6u);
  EXPECT_STREQ(honest.blocks_are, "objects");
  EXPECT_EQ(honest.blocks, 3u);
  EXPECT_GT(honest.chosen.error_N, 1.2 * leaks.chosen.error_N);
  EXPECT_GT(honest.interval_full_N, leaks.interval_full_N);
  // Two objects, whatever the number of their trials, are none that a fit did not see.
  for (ForceSample& s : together) s.object = *s.object % 2;
  const ForceChoice seen = choose_force(together, line);
  EXPECT_FALSE(seen.objects_left_out);
  EXPECT_STREQ(seen.blocks_are, "recordings");
}

// Folders that hold an object each are no days.
TEST(ForceChoice, FoldersOfOneObjectEachAreNoDays) {
  std::vector<ForceSample> samples = gel_on_days(1, true);
  for (ForceSample& s : samples) s.day = *s.object;
  const HoldOut held = hold_out(samples);
  EXPECT_TRUE(held.objects);
  EXPECT_FALSE(held.days);
  EXPECT_EQ(held.blocks, 5u);
  samples = gel_on_days(2, true);
  const HoldOut by_day = hold_out(samples);
  EXPECT_TRUE(by_day.days);
  EXPECT_EQ(by_day.blocks, 10u);
  for (size_t i = 0; i < samples.size(); i += 40)
    for (size_t k = 0; k < samples.size(); k += 40)
      EXPECT_EQ(by_day.teaches(k, by_day.block[i]),
                samples[i].object != samples[k].object && samples[i].day != samples[k].day);
}

// What is held out decides nothing: neither the force per signal nor the layer's force per bending.
TEST(ForceChoice, HeldOutObjectsDecideNothing) {
  std::vector<ForceSample> all = objects({1.3, 0.8, 1.2, 0.75}, {0.75, 1.1, 0.8, 9});
  const ForceChoiceOptions options{.signal = ForceSignal::LayerAndBending, .branches = false};
  const ForceChoice whole = choose_force(all, options);
  std::vector<ForceSample> others;
  for (const ForceSample& s : all)
    if (s.recording != 3) others.push_back(s);
  const ForceCalibration without = choose_force(others, options).calibration;
  for (size_t i = 0; i < all.size(); ++i) {
    if (all[i].recording != 3) continue;
    EXPECT_NEAR(whole.held_out_N[i], force_of(without, all[i].features).value, 1e-9) << i;
  }
  EXPECT_NE(whole.calibration.bending_N_per_mm, without.bending_N_per_mm);
}

TEST(ForceChoice, SaysWhatLeftTooLittle) {
  const auto said = [](std::vector<ForceSample> samples, const ForceChoiceOptions& options = {}) {
    try {
      choose_force(samples, options);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("not refused");
  };
  EXPECT_NE(said({}).find("something presses"), std::string::npos) << said({});
  std::vector<ForceSample> samples = presses(2, 0, 1, straight);
  EXPECT_NE(said(samples, {.signal = ForceSignal::Volume}).find("indented volume"), std::string::npos);
  EXPECT_NE(said(samples, {.signal = ForceSignal::Gradient}).find("sum of gradients"), std::string::npos);
  for (ForceSample& s : samples) s.left_out = LeftOut::Saturated;
  EXPECT_NE(said(samples).find("80 saturated"), std::string::npos) << said(samples);
  samples[0].left_out = samples[50].left_out = LeftOut::Used;
  EXPECT_NE(said(samples).find("2 of 80 (left out: 78 saturated)"), std::string::npos) << said(samples);
  samples = presses(4, 0, 1, straight);
  for (ForceSample& s : samples) s.force_N = -s.force_N;
  EXPECT_NE(said(samples).find("grows with force"), std::string::npos) << said(samples);
}

TEST(ForceScatter, ConstantAndGrowing) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal(0, 1);
  for (const auto& [still_N, fraction] : {std::pair{0.02, 0.0}, {0.01, 0.05}}) {
    std::vector<double> residual, force;
    for (int i = 0; i < 5000; ++i) {
      force.push_back(2.0 * i / 5000);
      residual.push_back(std::hypot(still_N, fraction * force.back()) * normal(random));
    }
    const Scatter scatter = fit_scatter(residual, force);
    EXPECT_NEAR(scatter.at(0), still_N, 0.15 * still_N + 0.001);
    EXPECT_NEAR(scatter.at(2), std::hypot(still_N, 2 * fraction), 0.1 * std::hypot(still_N, 2 * fraction));
    EXPECT_EQ(scatter.grows_to_N, 0);
    EXPECT_NEAR(widening(scatter, residual, force), 1, 0.05);
  }
}

// Scatter that grows up to a quarter of full scale and stays: without that end its interval is too wide at
// full scale and too narrow below.
TEST(ForceScatter, GrowthThatEnds) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal(0, 1);
  std::vector<double> residual, force;
  for (int i = 0; i < 800; ++i) {
    force.push_back(20.0 * i / 800);
    residual.push_back(std::hypot(0.1, 0.2 * std::min(force.back(), 5.0)) * normal(random));
  }
  const Scatter scatter = fit_scatter(residual, force);
  EXPECT_NEAR(scatter.grows_to_N, 5, 2.6);
  for (const double at : {2.0, 5.0, 10.0, 20.0})
    EXPECT_NEAR(scatter.at(at), std::hypot(0.1, 0.2 * std::min(at, 5.0)), 0.2 * scatter.at(at)) << at;
}

}  // namespace
}  // namespace palpate
