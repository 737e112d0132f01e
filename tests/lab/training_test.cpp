// Training: on pressures of a formula, which the network must then invert, with intervals that hold and with
// doubt where it is due.
#include "perf/lab/training/training.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "engine/lump/network/model.h"
#include "palpate/error.h"
#include "tests/lump/formula_lump.h"

namespace palpate {
namespace {

lump::Example example(uint64_t seed, bool lump) {
  const FormulaLump of = formula_lump(seed, lump);
  lump::Example e;
  e.lump = of.lump;
  e.shape = of.shape;
  e.along_y = of.along_y;
  e.size_mm = of.size_mm;
  e.depth_mm = of.depth_mm;
  e.stiffness_ratio = of.stiffness_ratio;
  e.offset_mm = of.offset_mm;
  e.block_mm = of.block_mm;
  e.young_Pa = of.young_Pa;
  e.pressure_Pa = of.pressure_Pa;
  e.force_N = of.force_N;
  return e;
}

lump::Observation read_of(const lump::Example& e, double noise_fraction, uint64_t seed) {
  FormulaLump of;
  of.block_mm = e.block_mm;
  of.young_Pa = e.young_Pa;
  of.pressure_Pa = e.pressure_Pa;
  of.force_N = e.force_N;
  return read(of, noise_fraction, seed);
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
    const lump::Estimate found = network.estimate(read_of(e, 0.002, i), method);
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
      return network.estimate(read_of(example(i, true), noise, i), lump::Method::Network);
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
    const lump::Estimate plain = network.estimate(read_of(example(i, false), 0.01, i), lump::Method::Network);
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
  EXPECT_EQ(network.estimate(read_of(two, 0.002, 1)).verdict, lump::Status::OutsideTraining);
  other.block_mm[2] = 30;
  const lump::Estimate thick = network.estimate(read_of(other, 0.002, 1));
  EXPECT_EQ(thick.verdict, lump::Status::OutsideTraining);
  ASSERT_FALSE(thick.reasons.empty());
  EXPECT_NE(thick.reasons.front().find("30 mm thick"), std::string::npos) << thick.reasons.front();

  // The file says the same again.
  const std::string bytes = network.bytes();
  const lump::Network again = lump::Network::parse(bytes, "file");
  EXPECT_EQ(again.bytes(), bytes);
  const lump::Estimate first = network.estimate(read_of(e, 0.01, 3)),
                       second = again.estimate(read_of(e, 0.01, 3));
  EXPECT_NEAR(first.size_mm.value, second.size_mm.value, 1e-3 * first.size_mm.value);
}

lump::TrainingOptions quick() {
  lump::TrainingOptions options;
  options.ensemble = 2;
  options.hidden = 12;
  options.fields = 10;
  options.rounds = 20;
  options.observations = 1000;
  options.readers = 1;
  options.reader_hidden = 8;
  options.reader_rounds = 1;
  options.components = 12;
  options.trials = 20;
  return options;
}

TEST(LumpTraining, LearnsNothingOfBlocksThatAreKeptAside) {
  std::vector<lump::Example> examples;
  for (uint64_t i = 0; i < 90; ++i) examples.push_back(example(i, i % 5 != 0));
  const auto emulator_of = [](const std::vector<lump::Example>& all, uint32_t& aside) {
    lump::TrainingReport report;
    const lump::Network network = train_lumps(all, quick(), report);
    aside = report.kept_aside;
    return network.model().ensemble.front().layers.back().weight;
  };
  uint32_t aside = 0;
  const auto with_some = [&](uint64_t from) {
    std::vector<lump::Example> all = examples;
    for (uint64_t i = from; i < from + 30; ++i) {
      all.push_back(example(i, true));
      all.back().aside = true;
    }
    return emulator_of(all, aside);
  };
  // Others kept aside, the same emulator; the same blocks without a word, another one.
  const Eigen::MatrixXf first = with_some(500);
  EXPECT_EQ(aside, 30u);
  EXPECT_TRUE(first.isApprox(with_some(700)));
  std::vector<lump::Example> all = examples;
  for (uint64_t i = 500; i < 530; ++i) all.push_back(example(i, true));
  EXPECT_FALSE(first.isApprox(emulator_of(all, aside)));

  all.back().aside = true;
  all.back().cell_mm *= 2;
  lump::TrainingReport report;
  EXPECT_THROW(train_lumps(all, quick(), report), Error);
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

}  // namespace
}  // namespace palpate
