// Traction of frames: the wrench of simulated presses against their truth, and the states that it ends in.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>

#include "capture/open_source.h"
#include "capture/synthetic/synthetic.h"
#include "palpate/error.h"
#include "palpate/pipeline.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

constexpr Outputs kTractionOutputs = Output::Force | Output::Contacts | Output::Surface | Output::Traction;

class TractionTest : public GpuTest {
 protected:
  struct Press {
    Result result;
    std::optional<Truth> truth;
  };
  /// Every `step`-th frame of a scene through one pipeline, each result with its truth to `with`.
  template <typename With>
  static void run(const std::string& scene, const Sensor& sensor, const PipelineOptions& options,
                  uint64_t step, const With& with) {
    const std::unique_ptr<Source> source = open_source(scene, sensor);
    Pipeline pipeline(context(), sensor, source->format(), options);
    pipeline.set_background(load_background(scene, sensor, *source));
    Frame frame;
    for (uint64_t i = 0; source->next(frame); ++i) {
      if (i % step != 0) continue;
      ASSERT_TRUE(pipeline.submit(frame));
      const std::optional<Result> result = pipeline.wait();
      with(*result, source->truth(frame.sequence).value());
    }
  }
  static Sensor sensor_of(const std::string& scene) { return synthetic_sensor(parse_synthetic(scene)); }
};

double sum_N(const TractionMaps& maps, double pitch_mm) {
  const double cell_mm = maps.cell_px * pitch_mm;
  return 1e-3 * cell_mm * cell_mm * std::accumulate(maps.pressure_kPa.begin(), maps.pressure_kPa.end(), 0.0);
}

// A gel's slopes and the layer alone, without any calibration of force: within 3 % of what presses.
TEST_F(TractionTest, ForceOfAGelWithinThreePerCent) {
  const std::string scene = "synthetic:palpation?mode=gel&size=320x240";
  const Sensor sensor = sensor_of(scene);
  ASSERT_TRUE(sensor.layer.has_value());
  size_t readings = 0, held = 0;
  double worst = 0;
  run(scene, sensor, {.outputs = kTractionOutputs}, 6, [&](const Result& result, const Truth& truth) {
    const Touch& touch = result.touch;
    ASSERT_TRUE(touch.traction.has_value());
    const Estimate& force = touch.traction->fz_N;
    if (!touch.contact) {
      EXPECT_EQ(force.validity, Validity::NoContact);
      EXPECT_EQ(force.value, 0);
      EXPECT_TRUE(result.traction.pressure_kPa.empty());
      return;
    }
    EXPECT_NEAR(sum_N(result.traction, sensor.pitch_mm_per_px), force.value, 1e-4 + 1e-3 * force.value);
    EXPECT_EQ(touch.traction->fx_N.validity, Validity::NotCalibrated);
    if (truth.force_N < 0.3 || force.validity != Validity::Valid) return;
    ++readings;
    worst = std::max(worst, std::abs(force.value / truth.force_N - 1));
    held += std::abs(force.value - truth.force_N) <= 1.96 * force.standard_error;
    const double x_mm = (truth.center_x_px - 0.5 * (result.traction.width * result.traction.cell_px - 1)) *
                        sensor.pitch_mm_per_px;
    EXPECT_NEAR(touch.traction->my_Nmm.value, -x_mm * truth.force_N, 0.15 * truth.force_N);
  });
  std::printf("%zu readings, the worst %.2f %% off, %zu intervals of 95 %% hold\n", readings, 100 * worst,
              held);
  EXPECT_GT(readings, 10u);
  EXPECT_LT(worst, 0.03);
  EXPECT_GE(held, readings * 9 / 10);
}

// Contacts that were not asked for are found all the same: the force is the same.
// So large and smooth that noise hides its outline: what it dents is not at rest.
TEST_F(TractionTest, WideSmoothBall) {
  const std::string scene = "synthetic:press?mode=gel&size=320x240&radius=25&force=8";
  size_t pressed = 0;
  run(scene, sensor_of(scene), {.outputs = kTractionOutputs}, 6,
      [&](const Result& result, const Truth& truth) {
        if (truth.force_N < 0.5) return;
        ++pressed;
        ASSERT_TRUE(result.touch.contact) << truth.force_N;
        const double deepest_mm = double{*std::ranges::max_element(truth.depth_mm)};
        EXPECT_NEAR(result.touch.surface->depth_max_mm, deepest_mm, 0.15 * deepest_mm);
        const Estimate& force = result.touch.traction->fz_N;
        EXPECT_NEAR(force.value, truth.force_N, 3 * force.standard_error);
        EXPECT_LT(force.standard_error, 0.3 * truth.force_N);
      });
  EXPECT_GT(pressed, 20u);
}

TEST_F(TractionTest, FindsItsContacts) {
  const std::string scene = "synthetic:press?mode=gel&size=320x240";
  std::vector<double> force;
  for (const Outputs outputs : {kTractionOutputs, Output::Force | Output::Surface | Output::Traction})
    run(scene, sensor_of(scene), {.outputs = outputs}, 110,
        [&](const Result& result, const Truth&) { force.push_back(result.touch.traction->fz_N.value); });
  ASSERT_EQ(force.size() % 2, 0u);
  const size_t half = force.size() / 2;
  ASSERT_GT(*std::ranges::max_element(force), 0.5);
  for (size_t i = 0; i < half; ++i) EXPECT_EQ(force[i], force[half + i]);
}

// Host and device solve the same problem.
TEST_F(TractionTest, DeviceAndHostAgree) {
  const std::string scene = "synthetic:press?mode=gel&size=320x240";
  const Sensor sensor = sensor_of(scene);
  std::vector<double> force[2], moment[2], sd[2];
  for (const SolveBy by : {SolveBy::Host, SolveBy::Device})
    run(scene, sensor, {.outputs = kTractionOutputs, .solve_by = by}, 15,
        [&](const Result& result, const Truth&) {
          const size_t k = by == SolveBy::Device;
          force[k].push_back(result.touch.traction->fz_N.value);
          sd[k].push_back(result.touch.traction->fz_N.standard_error);
          moment[k].push_back(result.touch.traction->mx_Nmm.value);
        });
  ASSERT_EQ(force[0].size(), force[1].size());
  ASSERT_GT(*std::max_element(force[0].begin(), force[0].end()), 1);
  for (size_t i = 0; i < force[0].size(); ++i) {
    EXPECT_NEAR(force[1][i], force[0][i], 2e-3 + 5e-3 * force[0][i]);
    EXPECT_NEAR(moment[1][i], moment[0][i], 5e-3 + 1e-2 * std::abs(moment[0][i]));
    EXPECT_NEAR(sd[1][i], sd[0][i], 0.05 * sd[0][i] + 1e-4);
  }
}

// The bending of a gel rises with what presses, and hardly knows of a light that comes up while it presses;
// no other sensor has one.
TEST_F(TractionTest, BendingGoesWithThePressAndNotWithTheLight) {
  const std::string scene = "synthetic:press?mode=gel&size=320x240";
  const Sensor sensor = sensor_of(scene);
  const std::unique_ptr<Source> source = open_source(scene, sensor);
  Pipeline steady(context(), sensor, source->format(), {.outputs = kTractionOutputs, .fixed_light = true}),
      brighter(context(), sensor, source->format(), {.outputs = kTractionOutputs, .fixed_light = true});
  for (Pipeline* one : {&steady, &brighter}) one->set_background(load_background(scene, sensor, *source));
  std::vector<double> bending_mm, force_N;
  Frame frame;
  for (uint64_t i = 0; source->next(frame); ++i) {
    if (i % 15 != 0) continue;
    const Touch touch = steady.process(frame).touch;
    const double true_N = source->truth(frame.sequence)->force_N;
    ASSERT_EQ(touch.traction->bending_mm.has_value(), touch.contact);
    if (!touch.contact || true_N < 0.2) continue;
    force_N.push_back(true_N);
    bending_mm.push_back(*touch.traction->bending_mm);
    for (uint8_t& pixel : frame.bytes) pixel = static_cast<uint8_t>(std::min(pixel + 12, 255));
    const Touch lit = brighter.process(frame).touch;
    ASSERT_TRUE(lit.traction->bending_mm.has_value());
    EXPECT_NEAR(*lit.traction->bending_mm, bending_mm.back(), 0.05 * bending_mm.back() + 0.02) << true_N;
  }
  ASSERT_GT(force_N.size(), 8u);
  const auto most = std::ranges::max_element(force_N) - force_N.begin();
  const auto least = std::ranges::min_element(force_N) - force_N.begin();
  std::printf("bending %.3g mm at %.3g N, %.3g mm at %.3g N\n", bending_mm[least], force_N[least],
              bending_mm[most], force_N[most]);
  EXPECT_GT(bending_mm[most], 1.5 * bending_mm[least]);
  for (size_t i = 0; i < force_N.size(); ++i)
    for (size_t k = 0; k < force_N.size(); ++k)
      if (force_N[i] > 1.3 * force_N[k]) {
        EXPECT_GT(bending_mm[i], bending_mm[k]) << force_N[i] << " " << force_N[k];
      }
}

// A waveguide's pixels are pressures: their sum is the force, and goes back through the same layer.
TEST_F(TractionTest, WaveguideSumsItsPressures) {
  const std::string scene = "synthetic:press?size=320x240";
  const Sensor sensor = sensor_of(scene);
  ASSERT_EQ(sensor.reading, SurfaceReading::Elastic);
  run(scene, sensor, {.outputs = kTractionOutputs}, 30, [&](const Result& result, const Truth& truth) {
    if (truth.force_N < 0.3) return;
    const TractionSummary& t = *result.touch.traction;
    EXPECT_FALSE(t.bending_mm.has_value());
    EXPECT_NEAR(t.fz_N.value, truth.force_N, 0.02 * truth.force_N);
    EXPECT_EQ(t.fz_N.validity, Validity::Valid);
    EXPECT_NEAR(sum_N(result.traction, sensor.pitch_mm_per_px), t.fz_N.value, 1e-3);
  });
}

// The skin's motion under a drag: shear on the way of the drag, in part at the friction limit once it slips.
TEST_F(TractionTest, ShearOfADrag) {
  const std::string scene = "synthetic:drag?skin=texture&size=640x480";
  const Sensor sensor = sensor_of(scene);
  std::vector<double> wrench_N, true_N;
  double stuck = 0, slid = 0, stuck_frames = 0, slid_frames = 0;
  run(scene, sensor, {.outputs = kTractionOutputs | Output::Skin}, 12,
      [&](const Result& result, const Truth& truth) {
        const TractionSummary& t = *result.touch.traction;
        if (!result.touch.contact || truth.force_N < 0.5 || t.fx_N.validity == Validity::NotCalibrated)
          return;
        ASSERT_FALSE(result.traction.shear_x_kPa.empty());
        EXPECT_GT(t.fx_N.standard_error, 0);
        wrench_N.push_back(t.fx_N.value);
        true_N.push_back(truth.shear_x_N);
        ASSERT_TRUE(t.slipping_fraction.has_value());
        (truth.slipping ? slid : stuck) += *t.slipping_fraction;
        (truth.slipping ? slid_frames : stuck_frames) += 1;
      });
  ASSERT_GT(wrench_N.size(), 10u);
  double products = 0, squares = 0, wrench = 0;
  for (size_t i = 0; i < wrench_N.size(); ++i) {
    products += wrench_N[i] * true_N[i];
    squares += true_N[i] * true_N[i];
    wrench += wrench_N[i] * wrench_N[i];
  }
  const double scale = products / squares, correlation = products / std::sqrt(squares * wrench);
  std::printf(
      "shear by the layer %.2f of the simulator's, correlation %.3f; at the friction limit %.0f %% of the "
      "contact while it sticks, %.0f %% while it slips\n",
      scale, correlation, 100 * stuck / stuck_frames, 100 * slid / slid_frames);
  // The simulator moves the skin by a spring, not by this layer: its stiffness is another one.
  EXPECT_GT(correlation, 0.97);
  EXPECT_GT(scale, 0.5);
  EXPECT_LT(scale, 1.5);
  EXPECT_GT(slid / slid_frames, stuck / stuck_frames);
}

TEST_F(TractionTest, StatesAreSaid) {
  const std::string scene = "synthetic:press?mode=gel&size=320x240";
  // The force ends at two thirds of the thickness, the depth at the thickness; up to there its error grows.
  // The solve of a layer this thin may end before its tolerance, a card's own always: the graver state.
  const Validity wanted = context().is_software() ? Validity::TooDeep : Validity::NotConverged;
  size_t shallow = 0, mended = 0, deep = 0, through = 0;
  for (const double thickness_mm : {0.3, 0.6, 1.2}) {
    Sensor thin = sensor_of(scene);
    thin.layer->thickness_mm = thickness_mm;
    run(scene, thin, {.outputs = kTractionOutputs}, 15, [&](const Result& result, const Truth&) {
      const Estimate& force = result.touch.traction->fz_N;
      const double depth = result.touch.surface->depth_max_mm / thickness_mm;
      if (!result.touch.contact) return;
      EXPECT_EQ(depth > 1, result.touch.surface->validity == Validity::TooDeep) << depth;
      through += depth > 1;
      if (depth > 2.0 / 3) {
        EXPECT_TRUE(force.validity == Validity::TooDeep || force.validity == Validity::NotConverged) << depth;
        deep += force.validity == wanted;
        return;
      }
      if (!force.valid()) return;
      const double own_sd = std::hypot(thin.layer->relative_sd, 0.06);
      (depth > 1.0 / 3 ? mended : shallow) += 1;
      if (depth > 1.0 / 3) {
        EXPECT_GT(force.standard_error, own_sd * force.value) << depth;
      }
    });
  }
  EXPECT_GT(shallow, 0u);
  EXPECT_TRUE(mended > 0 || !context().is_software());
  EXPECT_GT(deep, 0u);
  EXPECT_GT(through, 0u);
  // Not asked for: not there.
  run(scene, sensor_of(scene), {.outputs = Output::Force | Output::Surface}, 60,
      [&](const Result& result, const Truth&) { EXPECT_FALSE(result.touch.traction.has_value()); });
  Sensor none = sensor_of(scene);
  none.layer.reset();
  EXPECT_THROW(Pipeline(context(), none, {320, 240, 3, 8}, {.outputs = kTractionOutputs}), Error);
  EXPECT_THROW(
      Pipeline(context(), sensor_of(scene), {320, 240, 3, 8}, {.outputs = Output::Force | Output::Traction}),
      Error);
}

TEST(LayerInSensorFile, BadNumbersAreRefused) {
  Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:press?mode=gel"));
  const std::string good = sensor_text(sensor);
  const Sensor back = sensor_from_text(good, "pad.json");
  ASSERT_TRUE(back.layer.has_value());
  EXPECT_EQ(back.layer->thickness_mm, sensor.layer->thickness_mm);
  const auto refusal = [&](auto change) {
    Sensor bad = sensor;
    change(*bad.layer);
    try {
      sensor_from_text(sensor_text(bad), "pad.json");
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refusal([](LayerCalibration& l) { l.thickness_mm *= 1e-3; }).find("would fit in m"),
            std::string::npos);
  EXPECT_NE(refusal([](LayerCalibration& l) { l.young_MPa = 0; }).find("young_MPa"), std::string::npos);
  EXPECT_NE(refusal([](LayerCalibration& l) { l.poisson = 0.51; }).find("poisson"), std::string::npos);
  // Incompressible is a layer as any other.
  EXPECT_EQ(refusal([](LayerCalibration& l) { l.poisson = 0.5; }), "");
}

}  // namespace
}  // namespace palpate
