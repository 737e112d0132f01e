// The network that estimates lumps, its parts, and what it refuses.
#include "engine/lump/network/network.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <span>

#include "engine/lump/network/fit.h"
#include "engine/lump/network/model.h"
#include "engine/lump/observation/sensor_model.h"
#include "engine/numeric/mlp.h"
#include "palpate/error.h"
#include "tests/lump/formula_lump.h"

namespace palpate {
namespace {

TEST(SmallNetwork, DirectionsAreThoseOfFiniteDifferences) {
  const SmallNetwork network = SmallNetwork::random({3, 10, 8, 2}, 4);
  Eigen::MatrixXf in(3, 2), way(3, 2);
  in << 0.3F, -0.2F, 0.5F, 0.9F, -0.4F, 0.1F;
  way << 1, 0, 0.5F, -1, 0, 2;
  std::vector<Eigen::MatrixXf> changes;
  const Eigen::MatrixXf out = network.apply(in, {way}, changes);
  EXPECT_LT((out - network.apply(in)).norm(), 1e-6F);
  const Eigen::MatrixXf difference =
      (network.apply(in + 1e-2F * way) - network.apply(in - 1e-2F * way)) / 2e-2F;
  EXPECT_LT((changes.at(0) - difference).norm(), 2e-3F * difference.norm());
}

TEST(SmallNetwork, LearnsASmoothFunctionAndForgetsWeightlessSamples) {
  Eigen::MatrixXf in = Eigen::MatrixXf::Random(2, 400), wanted(1, 400),
                  weight = Eigen::MatrixXf::Ones(1, 400);
  for (int i = 0; i < 400; ++i) {
    wanted(0, i) = std::sin(2 * in(0, i)) * in(1, i);
    if (i % 4 == 0) {
      wanted(0, i) = 7;  // wrong, but of weight 0
      weight(0, i) = 0;
    }
  }
  SmallNetwork network = SmallNetwork::random({2, 16, 16, 1}, 1);
  NetworkTraining how;
  how.rounds = 200;
  how.batch = 32;
  train(network, in, wanted, weight, how);
  const Eigen::MatrixXf error = (network.apply(in) - wanted).array() * weight.array();
  EXPECT_LT(error.norm() / std::sqrt(300.0F), 0.02F);
}

TEST(SmallNetwork, LearnsAnyLossThatHasASlope) {
  // -log of a bell whose middle and width the network has to estimate: width grows with the input.
  Eigen::MatrixXf in = Eigen::MatrixXf::Random(1, 4000);
  std::mt19937_64 random(3);
  std::normal_distribution<float> normal;
  std::vector<float> seen;
  for (const float x : in.reshaped()) seen.push_back(x + std::exp(x - 1) * normal(random));
  const NetworkLoss loss = [&seen](const Eigen::MatrixXf& out, std::span<const Eigen::Index> samples,
                                   Eigen::MatrixXf& slope) {
    slope.resize(2, out.cols());
    double sum = 0;
    for (Eigen::Index b = 0; b < out.cols(); ++b) {
      const float sd = std::exp(out(1, b));
      const float z = (seen[static_cast<size_t>(samples[static_cast<size_t>(b)])] - out(0, b)) / sd;
      slope(0, b) = -z / sd;
      slope(1, b) = 1 - z * z;
      sum += static_cast<double>(out(1, b) + 0.5F * z * z);
    }
    return sum;
  };
  SmallNetwork network = SmallNetwork::random({1, 12, 2}, 1);
  NetworkTraining how;
  how.rounds = 60;
  double first = 0, last = 0;
  how.done = [&](uint32_t round, double mean) {
    (round == 0 ? first : last) = mean;
    return true;
  };
  train(network, in, loss, how);
  EXPECT_LT(last, first - 0.3);
  for (const float x : {-0.8F, 0.0F, 0.8F}) {
    const Eigen::MatrixXf out = network.apply(Eigen::MatrixXf::Constant(1, 1, x));
    EXPECT_NEAR(out(0, 0), x, 0.25 * std::exp(x - 1) + 0.02);
    EXPECT_NEAR(out(1, 0), x - 1, 0.2);
  }
}

TEST(LumpBell, HalvesMeetInTheMiddleAndHoldWhatTheyPromise) {
  const lump::SplitNormal bell{2, 0.5, 1.5};
  EXPECT_NEAR(bell.cdf(2), 0.25, 1e-12);  // narrower half, smaller share
  EXPECT_NEAR(bell.cdf(2 - 0.5 * 1.6449) / 0.25, 0.1, 1e-4);
  EXPECT_NEAR((1 - bell.cdf(2 + 1.5 * 1.6449)) / 0.75, 0.1, 1e-4);
  lump::Posterior posterior;
  lump::Posterior::Part part;
  part.weight = 0.5;
  part.marginals[lump::kSize] = bell;
  posterior.parts.push_back(part);
  part.marginals[lump::kSize] = {20, 0.1, 0.1};
  posterior.parts.push_back(part);
  EXPECT_NEAR(posterior.quantile(lump::kSize, 0.125), 2, 1e-6);
  EXPECT_NEAR(posterior.quantile(lump::kSize, 0.75), 20, 1e-6);
}

TEST(LumpEmulator, SlopesAreThoseOfFiniteDifferences) {
  const lump::Model& model = lump::Network::built_in().model();
  lump::Setting setting;
  setting.cell_mm = model.cell_mm;
  const std::vector<double> loads = {0.1, 0.25};
  const lump::Guess guess{InclusionShape::Cylinder, std::log(8.0), std::log(4.0), std::log(6.0)};
  std::array<Eigen::MatrixXd, 3> changes;
  bump_factors(model, guess, setting, loads, -1, &changes);
  for (size_t p = 0; p < 3; ++p) {
    lump::Guess up = guess, down = guess;
    for (const auto& [moved, step] : {std::pair{&up, 0.02}, {&down, -0.02}})
      (p == 0 ? moved->log_size : p == 1 ? moved->log_depth : moved->log_ratio) += step;
    const Eigen::MatrixXd difference =
        (bump_factors(model, up, setting, loads, -1) - bump_factors(model, down, setting, loads, -1)) / 0.04;
    EXPECT_LT((changes[p] - difference).norm(), 0.01 * difference.norm()) << p;
  }
}

TEST(LumpNetwork, RefusesNonsenseInOneLine) {
  const std::string good = lump::Network::built_in().bytes();
  const auto refused = [](const std::string& bytes, const std::string& word) {
    try {
      lump::Network::parse(bytes, "x.lump");
      ADD_FAILURE() << "taken: " << word;
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Input);
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  };
  refused("", "none");
  refused("hello", "none");
  refused(good.substr(0, good.size() / 2), "damaged");
  std::string other = good;
  other[good.size() / 2] = static_cast<char>(other[good.size() / 2] ^ 1);
  refused(other, "damaged");
  other = good;
  other[std::string("palpate lump network ").size()] = '1';
  refused(other, "another version");
}

TEST(LumpNetwork, RefusesReadingsWhosePartsDoNotFit) {
  const lump::Network& network = lump::Network::built_in();
  lump::Observation observation = read(formula_lump(1, true), 0.01, 1);
  lump::Observation wrong = observation;
  wrong.force_N.pop_back();
  EXPECT_THROW(network.estimate(wrong), Error);
  wrong = observation;
  wrong.force_N[1] = -1;
  EXPECT_THROW(network.estimate(wrong), Error);
  wrong = observation;
  wrong.young_Pa = std::nan("");
  EXPECT_THROW(network.estimate(wrong), Error);
  wrong = observation;
  for (float& value : wrong.pressure_Pa[2].values) value = std::nanf("");
  // One load that was not seen is left out, with a word; all of them are unusable.
  const lump::Estimate partly = network.estimate(wrong);
  EXPECT_TRUE(std::any_of(partly.reasons.begin(), partly.reasons.end(), [](const std::string& reason) {
    return reason.find("saturated") != std::string::npos;
  }));
  for (PressureMap& map : wrong.pressure_Pa)
    for (float& value : map.values) value = std::nanf("");
  EXPECT_EQ(network.estimate(wrong).verdict, lump::Status::Unusable);
}

TEST(SensorReading, KeepsPressureAddsNoiseAndFlagsSaturation) {
  const FormulaLump e = formula_lump(5, true);
  lump::PalpationSensor sensor;
  sensor.noise_fraction = 0;
  sensor.gauge_fraction = 0;
  const lump::Observation clean =
      sensor_observation(e.pressure_Pa, e.force_N, e.block_mm, e.young_Pa, sensor, 1);
  ASSERT_EQ(clean.pressure_Pa.size(), 4u);
  EXPECT_EQ(clean.pressure_Pa[3].width, 31u);   // cells of 1.25 mm that lie whole in 40 mm
  EXPECT_EQ(clean.pressure_Pa[3].height, 23u);  // and in 30 mm
  EXPECT_EQ(clean.force_N, e.force_N);
  EXPECT_EQ(clean.saturated_fraction, 0);
  const lump::Observation ideal =
      lump::ideal_observation(e.pressure_Pa, e.force_N, e.block_mm, e.young_Pa, 1.25);
  double worst = 0, peak = 0;
  for (uint32_t y = 0; y < 23; ++y)
    for (uint32_t x = 0; x < 31; ++x) {
      const auto truth = static_cast<double>(ideal.pressure_Pa[3].at(x, y + 4));
      worst = std::max(worst, std::abs(static_cast<double>(clean.pressure_Pa[3].at(x, y)) - truth));
      peak = std::max(peak, truth);
    }
  EXPECT_LT(worst, 0.003 * peak);  // pixels of a 200th, averaged

  sensor.noise_fraction = 0.02;
  sensor.gauge_fraction = 0.01;
  const lump::Observation noisy =
      sensor_observation(e.pressure_Pa, e.force_N, e.block_mm, e.young_Pa, sensor, 1);
  double squares = 0;
  for (size_t n = 0; n < noisy.pressure_Pa[1].values.size(); ++n)
    squares += std::pow(noisy.pressure_Pa[1].values[n] - clean.pressure_Pa[1].values[n], 2);
  const double sd = std::sqrt(squares / static_cast<double>(noisy.pressure_Pa[1].values.size()));
  EXPECT_NEAR(sd / noisy.noise_Pa, 1, 0.1);
  EXPECT_NE(noisy.force_N, e.force_N);

  sensor.full_scale_Pa = 0.7 * peak;
  const lump::Observation bright =
      sensor_observation(e.pressure_Pa, e.force_N, e.block_mm, e.young_Pa, sensor, 1);
  EXPECT_GT(bright.saturated_fraction, 0);
  size_t unseen = 0;
  for (const float value : bright.pressure_Pa[3].values) unseen += std::isnan(value);
  EXPECT_NEAR(static_cast<double>(unseen), bright.saturated_fraction * 31 * 23, 0.5);
  sensor.noise_fraction = 2;
  EXPECT_THROW(sensor_observation(e.pressure_Pa, e.force_N, e.block_mm, e.young_Pa, sensor, 1), Error);
}

}  // namespace
}  // namespace palpate
