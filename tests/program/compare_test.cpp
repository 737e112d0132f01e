// palpate compare: differences of simulated recordings whose forces are known.
#include "capture/run/compare/compare_recordings.h"

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

/// A press that begins at `begin_s`, rises over 1 s to `force_N` and stays.
RecordingCurve press(double begin_s, double force_N, double sd_N = 0.01) {
  RecordingCurve curve;
  curve.input = "a press";
  curve.sensor.pitch_mm_per_px = 0.05;
  curve.rate_Hz = 50;
  for (int i = 0; i < 250; ++i) {
    CurvePoint point;
    point.time_s = 3 + 0.02 * i;
    const double rise = std::clamp(point.time_s - 3 - begin_s, 0.0, 1.0);
    point.contact = rise > 0;
    point.force_N = {rise * force_N, sd_N, rise > 0 ? Validity::Valid : Validity::NoContact};
    point.depth_mm = {0.5 * rise * force_N, 0.003, point.force_N.validity};
    point.area_mm2 = 20 * rise;
    curve.points.push_back(point);
  }
  return curve;
}

TEST(CompareRecordings, DifferencesHaveTheErrorsOfBoth) {
  const RecordingCurve a = press(0.5, 0.8, 0.03), b = press(1.5, 1.1, 0.04);
  const std::vector<ComparedValue> values = compare_largest(a, b);
  ASSERT_EQ(values.size(), 3u);
  EXPECT_EQ(values[0].name, "largest force");
  EXPECT_NEAR(values[0].difference.value, 0.3, 1e-9);
  EXPECT_NEAR(values[0].difference.standard_error, 0.05, 1e-9);
  EXPECT_NEAR(*values[0].a_time_s, 4.5, 0.021);
  EXPECT_NEAR(*values[0].b_time_s, 5.5, 0.021);
  EXPECT_NEAR(values[1].difference.value, 0.15, 1e-9);
  EXPECT_FALSE(values[2].has_error);
  EXPECT_EQ(headline_of(values), "B presses 0.300 \xc2\xb1 0.050 N harder (+38 %)");
  EXPECT_EQ(headline_of(compare_largest(b, a)), "B presses 0.300 \xc2\xb1 0.050 N less (-27 %)");
  EXPECT_TRUE(headline_of(compare_largest(a, press(0, 0.81, 0.03))).starts_with("No difference"));
}

TEST(CompareRecordings, AreAlignedByWhatBothHave) {
  RecordingCurve a = press(0.5, 0.8), b = press(1.5, 0.8);
  const SharedTime start(a, b, Alignment::Start, ""), touch(a, b, Alignment::Touch, ""),
      largest(a, b, Alignment::Largest, ""), moved(a, b, Alignment::Touch, "", 0.2);
  EXPECT_EQ(start.b_s - start.a_s, 0);
  EXPECT_NEAR(touch.b_s - touch.a_s, 1, 1e-9);
  EXPECT_NEAR(largest.b_s - largest.a_s, 1, 1e-9);
  EXPECT_NEAR(moved.b_s - touch.b_s, -0.2, 1e-9) << "B's moments come later";
  EXPECT_NEAR(*force_rms_N(a, b, touch), 0, 1e-9);
  EXPECT_GT(*force_rms_N(a, b, start), 0.1);
  EXPECT_NEAR(compare_at(a, b, touch, 0.5)[0].difference.value, 0, 1e-9);
  EXPECT_NEAR(compare_at(a, b, start, 1)[0].a.value, 0.4, 0.01);
  EXPECT_EQ(compare_at(a, b, start, 1)[0].b.validity, Validity::NoContact);
  a.events = {{0, 3.7, "mark", "1"}, {0, 4.2, "mark", "pressed"}};
  b.events = {{0, 4.6, "mark", "pressed"}};
  const SharedTime first(a, b, Alignment::Mark, ""), named(a, b, Alignment::Mark, "pressed");
  EXPECT_NEAR(first.b_s - first.a_s, 0.9, 1e-9);
  EXPECT_NEAR(named.b_s - named.a_s, 0.4, 1e-9);
  EXPECT_THROW(SharedTime(a, b, Alignment::Mark, "other"), Error);
  for (CurvePoint& point : b.points) point.contact = false;
  EXPECT_THROW(SharedTime(a, b, Alignment::Touch, ""), Error);
  EXPECT_FALSE(largest_frame(b));
}

TEST(CompareRecordings, WhatIsInDoubtIsSaid) {
  RecordingCurve a = press(0, 0.8), b = press(0, 1.1);
  for (CurvePoint& point : b.points)
    if (point.force_N.value > 1) point.force_N.validity = Validity::AboveRange;
  const ComparedValue force = compare_largest(a, b)[0];
  EXPECT_LE(force.b.value, 1) << "a valid one goes before a larger one that is not";
  EXPECT_EQ(force.doubt, std::string("B reaches 1.100 \xc2\xb1 0.010 N, ") + to_string(Validity::AboveRange));
  EXPECT_EQ(deserved_places(2.268, 3), 1);
  EXPECT_EQ(deserved_places(18.3, 3), 0);
  EXPECT_EQ(deserved_places(0.0004, 3), 3);
  for (CurvePoint& point : b.points) point.force_N.validity = Validity::AboveRange;
  const ComparedValue doubtful = compare_largest(a, b)[0];
  EXPECT_EQ(doubtful.difference.validity, Validity::AboveRange);
  EXPECT_NE(value_words(doubtful.difference, "N", true).find(to_string(Validity::AboveRange)),
            std::string::npos);
  for (CurvePoint& point : b.points) point.force_N = {};
  EXPECT_EQ(value_words(compare_largest(a, b)[0].difference, "N", true), "-");
  EXPECT_EQ(headline_of(compare_largest(a, b)).find("presses"), std::string::npos);
}

class CompareCommand : public Program {};

TEST_F(CompareCommand, FindsTheKnownDifferenceOfSimulatedPresses) {
  const fs::path out = folder_ / "out";
  const Ended done = run({"compare", "synthetic:press?size=320x240&force=0.8",
                          "synthetic:press?size=320x240&force=1.1&seed=7", "--out", out, "--json"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const Json json = parse_json(done.out);
  const Json& force = json["values"][0];
  const double sd = force["difference"]["sd"];
  EXPECT_NEAR(force["difference"]["value"].get<double>(), 0.3, 3 * sd);
  EXPECT_LT(sd, 0.02);
  EXPECT_NEAR(json["a_zero_s"].get<double>(), json["b_zero_s"].get<double>(), 0.1) << "one script";
  const Table table(slurp(out / "comparison.csv"));
  table.expect_whole();
  ASSERT_EQ(table.rows.size(), 3u);
  EXPECT_EQ(table.at(0, "quantity"), "largest force");
  EXPECT_EQ(table.at(2, "difference_sd"), "");
  const cv::Mat picture = cv::imread(out / "comparison.png");
  EXPECT_EQ(picture.cols, 1280);
  EXPECT_EQ(picture.rows, 720);
}

TEST_F(CompareCommand, RefusesWhatCannotBeCompared) {
  const fs::path rec = recording(3);
  expect_refusal({"compare", rec / "frames", rec / "frames", "--out", folder_ / "out"}, 2,
                 {"whose frames have times", "--rate"});
  expect_refusal({"compare", "synthetic:still?size=160x120&repeat=1", "synthetic:still?size=160x120&repeat=1",
                  "--out", folder_ / "out", "--frames", "5"},
                 2, {"first touch", "--align-by start"});
}

}  // namespace
}  // namespace palpate
