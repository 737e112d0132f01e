// The network that estimates lumps: trained on pressures of a formula, which it must then invert, with
// intervals that hold and with doubt where it is due.
#include "engine/lump/network/network.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <span>

#include "engine/lump/network/fit.h"
#include "engine/lump/network/model.h"
#include "engine/lump/observation/sensor_model.h"
#include "engine/lump/training/training.h"
#include "engine/numeric/mlp.h"
#include "palpate/error.h"

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
  const lump::Guess guess{fem::InclusionShape::Cylinder, std::log(8.0), std::log(4.0), std::log(6.0)};
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

/// Pressure over the tissue's modulus at a load, a formula with the features of the real one: wider and
/// fainter with depth, larger with size, and a stiff lump's share grows with the load.
double formula(const lump::Example& e, double load, double x, double y) {
  const double edge = 1 - 0.1 * std::pow(x / 20, 4) - 0.1 * std::pow(y / 20, 4);
  double p = load * edge * (1 + 0.2 * load + 0.01 * (e.block_mm[2] - 20));
  if (!e.lump) return p;
  const double contrast = (e.stiffness_ratio - 1) / (e.stiffness_ratio + 2);
  const double q = std::pow(e.size_mm / (e.size_mm + e.depth_mm), 2), w = 0.3 * e.size_mm + 0.7 * e.depth_mm;
  double u = x - e.offset_mm[0], v = y - e.offset_mm[1];
  if (e.along_y) std::swap(u, v);
  if (e.shape == fem::InclusionShape::LyingCylinder) u /= 2;
  p += 2 * load * contrast * q * (1 + 2.5 * load * std::log(e.stiffness_ratio)) *
       std::exp(-(u * u + v * v) / (2 * w * w));
  return p;
}

lump::Example example(uint64_t seed, bool lump) {
  std::mt19937_64 random(seed);
  // The query lies within the training range.
  const double edge = seed < 1000 ? 0 : 0.06;
  std::uniform_real_distribution<double> share(edge, 1 - edge);
  lump::Example e;
  e.lump = lump;
  e.shape = share(random) < 0.5 ? fem::InclusionShape::Sphere : fem::InclusionShape::LyingCylinder;
  e.along_y = e.shape == fem::InclusionShape::LyingCylinder && share(random) < 0.5;
  e.size_mm = 5 + 7 * share(random);
  e.depth_mm = 2 + 5 * share(random);
  e.stiffness_ratio = 1.5 * std::pow(20, share(random));
  e.offset_mm = {-4 + 8 * share(random), -4 + 8 * share(random)};
  e.block_mm = {40, 40, 18 + 4 * share(random)};
  e.young_Pa = 2000 * std::pow(10, share(random));
  const double most = 0.2 + 0.15 * share(random);
  for (int k = 1; k <= 4; ++k) {
    const double load = most * k / 4;
    fem::Map map;
    map.width = map.height = 33;
    map.pitch_mm = {1.25, 1.25};
    for (int j = 0; j < 33; ++j)
      for (int i = 0; i < 33; ++i)
        map.values.push_back(
            static_cast<float>(e.young_Pa * formula(e, load, (i - 16) * 1.25, (j - 16) * 1.25)));
    e.pressure_Pa.push_back(std::move(map));
    e.force_N.push_back(load * e.young_Pa * 1600e-6);
  }
  return e;
}

lump::Observation read(const lump::Example& e, double noise_fraction, uint64_t seed) {
  lump::PalpationSensor sensor;
  sensor.size_px = {160, 120};
  sensor.noise_fraction = noise_fraction;
  return sensor_observation(e.pressure_Pa, e.force_N, e.block_mm, e.young_Pa, sensor, seed);
}

lump::Network trained() {
  std::vector<lump::Example> examples;
  for (uint64_t i = 0; i < 220; ++i) examples.push_back(example(i, i % 5 != 0));
  lump::TrainingOptions options;
  options.ensemble = 2;
  options.hidden = 24;
  options.fields = 12;
  options.rounds = 100;
  options.observations = 20000;
  options.readers = 1;
  options.reader_hidden = 48;
  options.reader_rounds = 25;
  options.components = 20;
  options.trials = 30;
  lump::TrainingReport report;
  const lump::Network network = train_lumps(examples, options, report);
  EXPECT_EQ(report.no_lumps, 44u);
  EXPECT_LT(report.base_error, 1e-3);
  EXPECT_LT(report.network_error, 0.05);
  return network;
}

// One training serves several questions: it takes most of the time.
void expect_lumps_found(const lump::Network& network, lump::Method method) {
  int held = 0, asked = 0, right = 0, missed = 0;
  std::vector<double> errors;
  for (uint64_t i = 1000; i < 1040; ++i) {
    const lump::Example e = example(i, true);
    const lump::Estimate found = network.estimate(read(e, 0.002, i), method);
    if (found.detection_statistic < 1) {
      ++missed;
      continue;
    }
    const std::array<std::pair<double, lump::Value>, 3> pairs = {std::pair{e.size_mm, found.size_mm},
                                                                 {e.depth_mm, found.depth_mm},
                                                                 {e.stiffness_ratio, found.stiffness_ratio}};
    for (const auto& [truth, value] : pairs) {
      EXPECT_LE(value.low, value.value);
      EXPECT_LE(value.value, value.high);
      held += truth >= value.low && truth <= value.high;
      ++asked;
    }
    errors.push_back(std::abs(found.size_mm.value / e.size_mm - 1));
    right += found.shape == e.shape;
    EXPECT_NEAR(found.x_mm.value, e.offset_mm[0], 1) << i;
  }
  std::sort(errors.begin(), errors.end());
  ASSERT_LE(missed, 4);
  EXPECT_LT(errors[errors.size() / 2], 0.17);  // size and depth of the formula are hard to separate
  EXPECT_GE(right, 36);
  EXPECT_GE(held, 0.75 * asked);
}

TEST(LumpNetwork, FindsLumpsOfAFormulaWithIntervalsThatHoldAndDoubtsWhereTheyBelong) {
  const lump::Network network = trained();
  for (const lump::Method method : {lump::Method::Network, lump::Method::Refined}) {
    SCOPED_TRACE(method == lump::Method::Network ? "network" : "refined");
    expect_lumps_found(network, method);
  }

  // Noise widens, of most lumps.
  double widened = 0;
  for (uint64_t i = 1000; i < 1012; ++i) {
    const auto estimate = [&](double noise) {
      return network.estimate(read(example(i, true), noise, i), lump::Method::Network);
    };
    const lump::Estimate quiet = estimate(0.002), loud = estimate(0.1);
    if (quiet.detection_statistic < 1 || loud.detection_statistic < 1) continue;
    widened +=
        std::log(loud.depth_mm.high / loud.depth_mm.low) - std::log(quiet.depth_mm.high / quiet.depth_mm.low);
  }
  EXPECT_GT(widened, 0);
  const lump::Example e = example(1003, true);

  // No lump: no numbers either.
  int none = 0;
  for (uint64_t i = 2000; i < 2010; ++i) {
    const lump::Estimate plain = network.estimate(read(example(i, false), 0.01, i), lump::Method::Network);
    if (plain.verdict != lump::Status::NoLump) continue;
    ++none;
    EXPECT_TRUE(std::isnan(plain.size_mm.value));
  }
  EXPECT_GE(none, 8);

  // Two lumps, a block of another size, thicker tissue, a torn map: not the like of the training.
  lump::Example two = e, other = example(1004, true);
  for (size_t k = 0; k < 4; ++k)
    for (size_t n = 0; n < two.pressure_Pa[k].values.size(); ++n) {
      const double x = (static_cast<double>(n % 33) - 16) * 1.25,
                   y = (static_cast<double>(n / 33) - 16) * 1.25;
      const double bump = std::exp(-((x + 9) * (x + 9) + (y - 6) * (y - 6)) / 12) -
                          0.7 * std::exp(-((x - 8) * (x - 8) + y * y) / 9);
      two.pressure_Pa[k].values[n] += static_cast<float>(0.5 * two.pressure_Pa[k].values[n] * bump);
    }
  EXPECT_EQ(network.estimate(read(two, 0.002, 1)).verdict, lump::Status::OutsideTraining);
  other.block_mm[2] = 30;
  const lump::Estimate thick = network.estimate(read(other, 0.002, 1));
  EXPECT_EQ(thick.verdict, lump::Status::OutsideTraining);
  ASSERT_FALSE(thick.reasons.empty());
  EXPECT_NE(thick.reasons.front().find("30 mm thick"), std::string::npos) << thick.reasons.front();

  // The file says the same again.
  const std::string bytes = network.bytes();
  const lump::Network again = lump::Network::parse(bytes, "file");
  EXPECT_EQ(again.bytes(), bytes);
  const lump::Estimate first = network.estimate(read(e, 0.01, 3)), second = again.estimate(read(e, 0.01, 3));
  EXPECT_NEAR(first.size_mm.value, second.size_mm.value, 1e-3 * first.size_mm.value);
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
  lump::Observation observation = read(example(1, true), 0.01, 1);
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
  for (fem::Map& map : wrong.pressure_Pa)
    for (float& value : map.values) value = std::nanf("");
  EXPECT_EQ(network.estimate(wrong).verdict, lump::Status::Unusable);
}

TEST(LumpTraining, RefusesTooFewAndMixedExamples) {
  lump::TrainingOptions options;
  lump::TrainingReport report;
  EXPECT_THROW(train_lumps({}, options, report), Error);
  std::vector<lump::Example> lumps;
  for (uint64_t i = 0; i < 30; ++i) lumps.push_back(example(i, true));
  EXPECT_THROW(train_lumps(lumps, options, report), Error);
  lumps.push_back(example(99, false));
  lumps.back().block_mm[0] = 50;
  EXPECT_THROW(train_lumps(lumps, options, report), Error);
}

TEST(SensorReading, KeepsPressureAddsNoiseAndFlagsSaturation) {
  const lump::Example e = example(5, true);
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
