// One press has one interval, whoever asks; and the centre's holds on scans whose stage errs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "capture/synthetic/tissue.h"
#include "engine/base/normal.h"
#include "engine/fem/large_strain/extrapolation.h"
#include "engine/lump/estimator.h"
#include "engine/palpation/press_monitor.h"
#include "engine/palpation/scan.h"

namespace palpate {
namespace {

/// A press of the synthetic block as it is recorded, and as an observation of the loads that it is read at.
struct RecordedBlock {
  explicit RecordedBlock(const std::string& tissue)
      : options(parse_tissue(tissue)),
        source(options),
        nodes(tissue_sensor(options), *source.own_background(), 1.25) {
    setup.block = {options.scene.block_mm, options.scene.young_Pa, {options.x_mm, options.y_mm}};
    Frame frame;
    for (uint64_t i = 0; i < *source.frame_count() && source.next(frame); ++i) {
      frames.force_N.push_back(source.block_force_N(i));
      frames.nodes.push_back(nodes.read(frame));
    }
  }
  lump::Observation observation() const {
    const double top_N = 0.995 * *std::max_element(frames.force_N.begin(), frames.force_N.end());
    std::vector<LoadSums> loads;
    for (const double at_N : even_loads(top_N, setup.loads)) {
      LoadSums load;
      const std::vector<size_t> near = frames_near(frames.force_N, at_N, top_N);
      for (const size_t i : near) {
        load.nodes.add(frames.nodes[i]);
        load.force_N += frames.force_N[i] / static_cast<double>(near.size());
      }
      loads.push_back(std::move(load));
    }
    return press_observation(nodes, loads, setup.block);
  }

  TissueOptions options;
  TissueSensor source;
  PressureNodes nodes;
  PressSetup setup;
  PressFrames frames;
};

void expect_same(const lump::Value& one, const lump::Value& other, double tolerance, const char* what) {
  for (const auto part : {&lump::Value::value, &lump::Value::low, &lump::Value::high})
    EXPECT_NEAR(one.*part, other.*part, tolerance * (std::abs(one.*part) + 0.1)) << what;
}
void expect_same(const lump::Estimate& one, const lump::Estimate& other, double tolerance) {
  ASSERT_EQ(one.verdict, other.verdict);
  expect_same(one.size_mm, other.size_mm, tolerance, "size");
  expect_same(one.depth_mm, other.depth_mm, tolerance, "depth");
  expect_same(one.stiffness_ratio, other.stiffness_ratio, tolerance, "ratio");
  expect_same(one.x_mm, other.x_mm, tolerance, "x");
  expect_same(one.y_mm, other.y_mm, tolerance, "y");
}

TEST(OneInterval, EstimateMonitorAndScanOfOnePress) {
  const RecordedBlock press("synthetic:tissue?size=320x240&cells=16&rate=15&force=1.6&d=10&h=3&ratio=5");
  PressAnswer live;
  read_press(press.nodes, press.frames, press.setup, live);
  ASSERT_TRUE(live.estimate) << live.trouble;
  ASSERT_TRUE(reports_numbers(live.estimate->verdict)) << lump::status_text(live.estimate->verdict);
  EXPECT_EQ(live.estimate->input_effects.size(), 4u);
  const lump::Observation observation = press.observation();
  // As lump estimate and Python have it.
  const lump::Estimator estimator = lump::named_estimator("refined", lump::load_network(""), {});
  expect_same(*live.estimate, estimator(observation), 1e-9);
  // A scan of this press alone: the same values on the block's grid, but for rounding.
  const ScanAnswer scan = evaluate_scan({{"press", observation}}, {}, estimator);
  ASSERT_TRUE(scan.estimate);
  expect_same(*live.estimate, *scan.estimate, 2e-3);
  // Wider than the maps' noise alone makes it.
  const lump::Estimate exact =
      lump::named_estimator("refined", lump::load_network(""), lump::ErrorSources::none())(observation);
  EXPECT_LT(live.estimate->stiffness_ratio.low, exact.stiffness_ratio.low);
  EXPECT_GT(live.estimate->x_mm.high, exact.x_mm.value + kNormal90 * observation.place_sd_mm);
}

TEST(OneInterval, TheCentreOfAScanWhoseStageErrs) {
  ScanPlan plan;
  plan.scene.cells = {16, 16, 8};
  plan.scene.inclusion->size_mm = {12, 12, 12};
  plan.scene.inclusion->depth_mm = 3;
  plan.scene.inclusion->stiffness_ratio = 4;
  plan.sensor.size_px = {200, 150};
  plan.loads = 2;
  plan.stage_sd_mm = 0.2;
  std::optional<fem::LargeStrainResult> pressed;  // once: seeds differ in stage and noise
  const fem::PressSolver solver = [&](const fem::Scene& scene, const std::vector<fem::PressLoad>& loads) {
    if (!pressed) pressed = solve_extrapolated(scene, loads, {});
    return *pressed;
  };
  const lump::Estimator estimator =
      lump::named_estimator("network", lump::load_network(""),
                            {.young = 0, .thickness = 0, .pitch = 0, .light = false, .place = true});
  int asked = 0, held = 0, held_without_place = 0, felt = 0, felt_held = 0;
  for (plan.seed = 101; plan.seed <= 116; ++plan.seed) {
    const ScanAnswer answer = evaluate_scan(simulate_scan(plan, solver), {}, estimator, plan.seed);
    ASSERT_TRUE(answer.estimate);
    ASSERT_TRUE(answer.outline.found);
    for (const lump::Value& v : {answer.outline.x_mm, answer.outline.y_mm}) {
      ++felt;
      felt_held += v.low <= 0 && 0 <= v.high;
    }
    if (!reports_numbers(answer.estimate->verdict)) continue;
    for (const lump::Value& v : {answer.estimate->x_mm, answer.estimate->y_mm}) {
      ++asked;
      held += v.low <= 0 && 0 <= v.high;
      const double place_mm = kNormal90 * answer.map.observation.place_sd_mm, half_mm = (v.high - v.low) / 2;
      held_without_place +=
          std::abs(v.value) <= std::sqrt(std::max(0.0, half_mm * half_mm - place_mm * place_mm));
    }
  }
  ASSERT_GE(asked, 24);
  // Nine of ten are promised.
  EXPECT_GE(held, asked * 8 / 10) << held << " of " << asked;
  EXPECT_GE(felt_held, felt * 8 / 10) << felt_held << " of " << felt << " centres of the bump";
  EXPECT_LT(held_without_place, asked * 8 / 10) << "the noise of the maps alone would do";
}

}  // namespace
}  // namespace palpate
