// Verdict on a force calibration: what is fit for use and what is not, and why.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "capture/calibrate/force/force.h"
#include "engine/measure/force.h"
#include "palpate/error.h"

namespace palpate {
namespace {

/// One recording of presses to 10 N, 40 frames each, gray = 1000 F with a relative scatter.
GaugedRecording recording(int presses, double scatter, uint32_t seed = 5) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  GaugedRecording r;
  r.input = "made up";
  for (int p = 0; p < presses; ++p)
    for (int i = 0; i < 50; ++i) {
      GaugedFrame f;
      f.touch.sequence = r.frames.size();
      f.time_s = 0.05 * static_cast<double>(r.frames.size());
      f.touch.contact = i < 40;
      f.force_N = f.touch.contact ? 10 * std::sin(0.08 * i) : 0;
      f.touch.gray_sum = std::max(1000 * f.force_N * (1 + scatter * normal(random)), 0.0);
      f.touch.area_px = static_cast<uint64_t>(f.touch.gray_sum / 10) + 1;
      r.frames.push_back(f);
    }
  return r;
}

ForceOutcome calibrate(GaugedRecording r) {
  return calibrate_force({std::move(r)}, {ForceSignal::GraySum, {}, {}});
}

TEST(ForceVerdict, GoodReadingsAreFitForUse) {
  const ForceOutcome o = calibrate(recording(5, 0.01));
  const ForceVerdict v = verdict_of(o);
  EXPECT_TRUE(v.fit_for_use) << v.line;
  EXPECT_TRUE(o.choice.calibration.fit_for_use);
  EXPECT_EQ(v.presses, 5u);
  EXPECT_LT(v.interval_fraction, 0.06);
  EXPECT_EQ(v.line.rfind("good to", 0), 0u) << v.line;
  EXPECT_EQ(v.line.find("one press"), std::string::npos) << v.line;
  EXPECT_EQ(describe(o).rfind(v.line, 0), 0u);
}

TEST(ForceVerdict, OnePressSaysSo) {
  const ForceVerdict v = verdict_of(calibrate(recording(1, 0.01)));
  EXPECT_TRUE(v.fit_for_use) << v.line;
  EXPECT_NE(v.line.find("judged within one press"), std::string::npos) << v.line;
}

TEST(ForceVerdict, OneObjectOnAGelSaysSo) {
  const auto on_gel = [](uint32_t seed) {
    GaugedRecording r = recording(5, 0.01, seed);
    for (GaugedFrame& f : r.frames) f.touch.gradient_sum = 2 * f.touch.gray_sum;
    return r;
  };
  const auto warns = [](std::vector<GaugedRecording> recordings) {
    const ForceOutcome o = calibrate_force(std::move(recordings), {ForceSignal::GraySum, {}, {}});
    const ForceVerdict v = verdict_of(o);
    EXPECT_TRUE(v.fit_for_use) << v.line;
    const ForceCalibration& c = o.choice.calibration;
    EXPECT_EQ(c.shapes_judged, v.shapes_judged);
    // A reading inside the range says so; one beyond it says that, which is graver.
    EXPECT_EQ(force_from_gray(c, 0.5 * (c.gray_min + c.gray_max), true).validity,
              c.shapes_judged ? Validity::Valid : Validity::ShapeUnjudged);
    EXPECT_EQ(force_from_gray(c, 2 * c.gray_max, true).validity, Validity::AboveRange);
    EXPECT_EQ(v.shapes_judged, v.line.find("on a gel") == std::string::npos) << v.line;
    return v.line.find("on a gel") != std::string::npos;
  };
  EXPECT_TRUE(warns({on_gel(5)}));
  EXPECT_FALSE(warns({on_gel(5), on_gel(6), on_gel(7)}));
  EXPECT_FALSE(warns({recording(5, 0.01)}));
}

TEST(ForceVerdict, WideIntervalIsNotFitForUse) {
  const ForceOutcome o = calibrate(recording(5, 0.5));
  const ForceVerdict v = verdict_of(o);
  EXPECT_FALSE(v.fit_for_use) << v.line;
  EXPECT_FALSE(o.choice.calibration.fit_for_use);
  EXPECT_GT(v.interval_fraction, ForceVerdict::kWorstInterval);
  EXPECT_NE(v.line.find("of full scale"), std::string::npos) << v.line;
  EXPECT_NE(o.choice.calibration.origin.note.find("not fit for use"), std::string::npos);
}

TEST(ForceVerdict, WhatTheBorderTakesAwayIsNamed) {
  GaugedRecording r = recording(3, 0.01);
  for (GaugedFrame& f : r.frames) f.touch.at_border = f.force_N > 2;
  const ForceVerdict v = verdict_of(calibrate(std::move(r)));
  EXPECT_FALSE(v.fit_for_use) << v.line;
  EXPECT_LT(v.reach, 0.25);
  EXPECT_NE(v.line.find("--keep-border"), std::string::npos) << v.line;
  EXPECT_NE(v.line.find("N pressed"), std::string::npos) << v.line;
}

TEST(ForceVerdict, WhatWasLeftOutIsStatedAndJudged) {
  GaugedRecording border = recording(5, 0.01);
  for (size_t i = 0; i < border.frames.size(); ++i) border.frames[i].touch.at_border = i % 5 != 0;
  const ForceVerdict some = verdict_of(calibrate(std::move(border)));
  EXPECT_TRUE(some.fit_for_use) << some.line;
  EXPECT_NE(some.line.find("of 200 touched frames alone"), std::string::npos) << some.line;
  EXPECT_NE(some.line.find("at the border"), std::string::npos) << some.line;
  const ForceVerdict all = verdict_of(calibrate(recording(5, 0.01)));
  EXPECT_EQ(all.line.find("alone"), std::string::npos) << all.line;
  // Readings that contradict the rest are left out of the error, and the verdict is against it.
  ForceOutcome o = calibrate(recording(5, 0.01));
  for (size_t i = 0; i < o.samples.size(); i += 3) o.samples[i].left_out = LeftOut::Outlier;
  o.choice.readings = o.samples.size() - (o.samples.size() + 2) / 3;
  const ForceVerdict contradicted = verdict_of(o);
  EXPECT_FALSE(contradicted.fit_for_use);
  EXPECT_NE(contradicted.line.find("contradict the rest"), std::string::npos) << contradicted.line;
}

TEST(ForceVerdict, EveryForceOfAPoorCalibrationSaysSo) {
  ForceCalibration c = calibrate(recording(5, 0.5)).choice.calibration;
  const Estimate force = force_from_gray(c, 5000, true);
  EXPECT_EQ(force.validity, Validity::Unfit);
  EXPECT_GT(force.value, 0);
  EXPECT_EQ(force_from_gray(c, 5000, true, 1).validity, Validity::Unfit);
  EXPECT_EQ(force_from_gray(c, 0, false).validity, Validity::NoContact);
  c.fit_for_use = true;
  EXPECT_EQ(force_from_gray(c, 5000, true).validity, Validity::Valid);
}

TEST(ForceVerdict, IsKeptInTheSensorFile) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "palpate_unfit.json";
  Sensor sensor;
  sensor.pitch_mm_per_px = 0.05;
  sensor.force = calibrate(recording(5, 0.5)).choice.calibration;
  save_sensor(sensor, file);
  EXPECT_FALSE(load_sensor(file).force->fit_for_use);
  sensor.force->fit_for_use = true;
  save_sensor(sensor, file);
  EXPECT_TRUE(load_sensor(file).force->fit_for_use);
  std::filesystem::remove(file);
}

// A pad that gives way while it is held reads more on the way back: the layer's force has two scales, which
// the sensor file knows by the history of the press; the wrench, which does not, has the gap in its error.
TEST(ForceVerdict, LayersForceIsToldApartByItsHistory) {
  const auto gives_way = [](double back, double scatter) {
    GaugedRecording r = recording(6, scatter);
    for (size_t i = 0; i < r.frames.size(); ++i) {
      TractionSummary& t = r.frames[i].touch.traction.emplace();
      const double gain = i % 50 < 20 ? 0.5 : 0.5 * back;  // 10 sin(0.08 i) turns at 20
      t.fz_N = {gain * r.frames[i].touch.gray_sum / 1000, 0.01, Validity::Valid};
    }
    return r;
  };
  const ForceChoiceOptions by_layer{ForceSignal::Layer, {}, {}};
  const ForceOutcome apart = calibrate_force({gives_way(1.15, 0.01)}, by_layer);
  ASSERT_TRUE(apart.choice.calibration.loading) << to_string(apart.choice.chosen.candidate);
  Sensor sensor;
  sensor.layer = LayerCalibration{.young_MPa = 0.1, .thickness_mm = 4};
  set_force(sensor, apart.choice.calibration);
  const double young_MPa = sensor.layer->young_MPa;
  EXPECT_NEAR(sensor.force->loading->c1 * young_MPa, 0.1 * 2, 0.01);
  EXPECT_NEAR(sensor.force->unloading->c1 * young_MPa, 0.1 * 2 / 1.15, 0.01);
  EXPECT_GT(sensor.layer->relative_sd, 0.06);
  EXPECT_LT(sensor.layer->relative_sd, 0.12);
  // Another press, up and down, read by the mended layer.
  ForceHistory history;
  for (int i = 1; i < 39; ++i) {
    const double force_N = 10 * std::sin(0.08 * i);
    ForceFeatures read;
    read.contact = read.has_layer = true;
    read.layer_validity = Validity::Valid;
    read.layer_N = (i < 20 ? 0.5 : 0.5 * 1.15) * force_N * young_MPa / 0.1;
    const Estimate e = history.update(*sensor.force, read);
    if (i < 18 || i > 28) {  // until it has turned for certain
      EXPECT_NEAR(e.value, force_N, 0.03 * force_N) << i;
    }
  }
  // One that does not stays one number.
  EXPECT_FALSE(calibrate_force({gives_way(1, 0.01)}, by_layer).choice.calibration.loading);
}

// Two recordings in each of two folders, of which the second reads a tenth more: two thirds of that are
// missed where recordings are left out one by one, all of it where their folder is left out too.
TEST(ForceVerdict, DaysAreLeftOut) {
  std::vector<GaugedRecording> recordings;
  for (const char* input : {"monday/a.avi", "monday/b.avi", "friday/a.avi", "friday/b.avi"}) {
    GaugedRecording& r =
        recordings.emplace_back(recording(3, 0.001, static_cast<uint32_t>(recordings.size())));
    r.input = input;
    if (recordings.size() <= 2) continue;
    for (GaugedFrame& f : r.frames) f.touch.gray_sum *= 1.1;
  }
  const ForceChoiceOptions line{ForceSignal::GraySum, ForceModel::Line, false};
  const auto error_N = [&] { return calibrate_force(recordings, line).choice.chosen.error_N; };
  const ForceOutcome days = calibrate_force(recordings, line);
  EXPECT_NEAR(days.choice.chosen.error_N, 0.1 * 6.4, 0.1) << "of forces of 6.4 N in the mean";
  EXPECT_NE(describe(days).find("objects and days (folders) that the fits had not seen"), std::string::npos);
  EXPECT_EQ(to_json(days, "").at("days_left_out"), true);
  for (GaugedRecording& r : recordings) r.input = r.input.substr(r.input.find('/') + 1);
  EXPECT_GT(days.choice.chosen.error_N, 1.3 * error_N());
  EXPECT_EQ(to_json(calibrate_force(recordings, line), "").at("days_left_out"), false);
}

// What was judged is said, and what reads these presses better but may not be taken unasked.
TEST(ForceVerdict, SaysWhatItWasJudgedOn) {
  std::vector<GaugedRecording> recordings;
  const double off[] = {0.1, -0.08, 0.05, -0.1};
  for (uint32_t i = 0; i < 4; ++i) {
    GaugedRecording& r = recordings.emplace_back(recording(3, 0.001, i));
    for (GaugedFrame& f : r.frames) {
      f.touch.gradient_sum = 2 * f.touch.gray_sum;
      TractionSummary& t = f.touch.traction.emplace();
      t.fz_N = {(1 + off[i]) * f.force_N, 0.01, Validity::Valid};
    }
  }
  const std::string unnamed = describe(calibrate_force(recordings, {}));
  EXPECT_NE(unnamed.find("recordings, each taken as an object of its own"), std::string::npos) << unnamed;
  EXPECT_NE(unnamed.find("days (folders) that they had"), std::string::npos) << unnamed;
  EXPECT_NE(unnamed.find("goes with the light"), std::string::npos) << unnamed;
  EXPECT_NE(unnamed.find("--signal gradient takes it"), std::string::npos) << unnamed;
  for (GaugedRecording& r : recordings) r.object = "ball";
  const std::string one = describe(calibrate_force(recordings, {}));
  EXPECT_NE(one.find("objects that the fits had seen: others may read differently"), std::string::npos)
      << one;
  EXPECT_NE(one.find("goes with the object's shape"), std::string::npos) << one;
  EXPECT_EQ(calibrate_force(recordings, {}).choice.calibration.signal, ForceSignal::Layer);
  EXPECT_THROW(named_objects({"ball", "cube"}, 3), Error);
  EXPECT_THROW(named_objects({"ball", "", "cube"}, 3), Error);
  EXPECT_EQ(named_objects({}, 2), std::vector<std::string>(2));
}

TEST(ForceVerdict, DriftNeedsTime) {
  EXPECT_FALSE(std::isfinite(calibrate(recording(3, 0.01)).choice.drift_sd_N_per_min));  // 7.5 s
  EXPECT_TRUE(std::isfinite(calibrate(recording(6, 0.01)).choice.drift_sd_N_per_min));   // 15 s
}

}  // namespace
}  // namespace palpate
