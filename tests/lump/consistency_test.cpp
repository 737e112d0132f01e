// Observations that contradict themselves: stored presses of finite elements, as they are and stated wrong.
#include "engine/lump/network/consistency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "capture/files/lump_maps.h"
#include "engine/lump/network/network.h"
#include "tests/support/json.h"
#include "tests/support/text_file.h"

namespace palpate {
namespace {

using lump::Fault;
using lump::Observation;

const std::string kReadings = PALPATE_SOURCE_DIR "/tests/data/lump/";

std::vector<Observation> stored() {
  std::vector<Observation> all;
  for (const auto& truth : parse_json(slurp(kReadings + "truth.json"))) {
    Observation o;
    const std::string forces = truth["forces"];
    for (size_t from = 0, k = 1; from < forces.size(); ++k) {
      const size_t comma = std::min(forces.find(',', from), forces.size());
      o.force_N.push_back(std::stod(forces.substr(from, comma - from)));
      o.pressure_Pa.push_back(
          read_pressure_map(kReadings + std::string(truth["name"]) + "_" + std::to_string(k) + ".npy", 1.25));
      from = comma + 1;
    }
    o.young_Pa = std::stod(std::string(truth["young_Pa"]));
    o.block_mm = {40, 40, std::stod(std::string(truth["thickness_mm"]))};
    o.noise_Pa = lump::roughness(o.pressure_Pa.back());
    all.push_back(std::move(o));
  }
  return all;
}

void scale(Observation& o, double factor) {
  o.noise_Pa *= factor;
  for (PressureMap& map : o.pressure_Pa)
    for (float& value : map.values) value *= static_cast<float>(factor);
}

void pitch(Observation& o, double factor) {
  for (PressureMap& map : o.pressure_Pa) map.pitch_mm = {1.25 * factor, 1.25 * factor};
}

/// Part of the maps, told to lie in the middle.
void crop(Observation& o, uint32_t first_x, uint32_t first_y, uint32_t width, uint32_t height) {
  for (PressureMap& map : o.pressure_Pa) {
    PressureMap cut{width, height, map.pitch_mm, {}};
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x) cut.values.push_back(map.at(first_x + x, first_y + y));
    map = std::move(cut);
  }
}

/// The faults found in an observation; the estimate has to agree.
std::vector<Fault> faults_of(const Observation& o) {
  const lump::Network& network = lump::Network::built_in();
  lump::Estimate ignored;
  const auto nodes = pressed_nodes(network.model(), o, ignored);
  std::vector<Fault> faults;
  const auto found = find_contradictions(network.model(), o, nodes ? &*nodes : nullptr);
  for (const lump::Contradiction& one : found) {
    faults.push_back(one.fault);
    EXPECT_GE(one.reason.size(), 40u);
    EXPECT_TRUE(std::isfinite(one.value));
    EXPECT_GE(one.sd, 0);
  }
  const lump::Estimate estimate = network.estimate(o);
  if (!found.empty()) {
    EXPECT_EQ(estimate.verdict, lump::Status::Inconsistent) << found.front().reason;
    EXPECT_EQ(estimate.reasons.at(0), found.front().reason);
  }
  return faults;
}

/// How many of the stored presses show the fault, each told wrong by `wrong`.
template <typename Wrong>
size_t count_of(Fault fault, const Wrong& wrong) {
  size_t count = 0;
  for (Observation o : stored()) {
    wrong(o);
    const std::vector<Fault> faults = faults_of(o);
    count += std::find(faults.begin(), faults.end(), fault) != faults.end();
  }
  return count;
}

TEST(LumpConsistency, HonestPressesWithMoreNoiseAndFewerLoadsAreNotAccused) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (const Observation& honest : stored())
    for (const double noise : {0.0, 0.01, 0.05, 0.1})
      for (const size_t loads : {size_t{1}, size_t{2}, size_t{4}}) {
        Observation o = honest;
        o.pressure_Pa.erase(o.pressure_Pa.begin(), o.pressure_Pa.end() - static_cast<std::ptrdiff_t>(loads));
        o.force_N.erase(o.force_N.begin(), o.force_N.end() - static_cast<std::ptrdiff_t>(loads));
        const auto& last = o.pressure_Pa.back().values;
        const double sd = noise * double{*std::max_element(last.begin(), last.end())};
        o.noise_Pa = std::hypot(o.noise_Pa, sd);
        for (PressureMap& map : o.pressure_Pa)
          for (float& value : map.values) value += static_cast<float>(sd * normal(random));
        for (double& force : o.force_N) force *= 1 + 0.005 * normal(random);
        EXPECT_TRUE(faults_of(o).empty()) << noise << ", " << loads << " loads";
      }
}

TEST(LumpConsistency, WrongUnitsAreNamed) {
  const auto reason = [](const Observation& o) {
    return lump::Network::built_in().estimate(o).reasons.at(0);
  };
  const size_t all = stored().size();
  const auto kpa = [](Observation& o) { scale(o, 1e-3); };
  EXPECT_EQ(count_of(Fault::Unit, kpa), all);
  EXPECT_EQ(count_of(Fault::Unit, [](Observation& o) { scale(o, 1 / 133.322); }), all);
  EXPECT_EQ(count_of(Fault::Unit, [](Observation& o) { scale(o, 1e-6); }), all);
  const auto milli = [](Observation& o) {
    for (double& force : o.force_N) force *= 1e3;
  };
  EXPECT_EQ(count_of(Fault::Unit, milli), all);
  const auto modulus = [](Observation& o) { o.young_Pa *= 1e-3; };
  EXPECT_EQ(count_of(Fault::Unit, modulus), all);
  Observation o = stored().front();
  kpa(o);
  EXPECT_NE(reason(o).find("pressures in kPa would fit"), std::string::npos) << reason(o);
  o = stored().front();
  milli(o);
  EXPECT_NE(reason(o).find("forces in mN would fit"), std::string::npos) << reason(o);
  o = stored().front();
  modulus(o);
  EXPECT_NE(reason(o).find("a modulus in kPa would fit"), std::string::npos) << reason(o);
}

TEST(LumpConsistency, APitchAndAWindowThatAreToldWrongAreFoundAndMeasured) {
  const size_t all = stored().size();
  // A wrong thickness explains one lump as well.
  EXPECT_GE(count_of(Fault::Pitch, [](Observation& o) { pitch(o, 0.8); }), all - 1);
  // Crops of 24 x 21 nodes whose middles lie 3.75 mm off: one of the four lumps is longer than the crop.
  EXPECT_GE(count_of(Fault::Window, [](Observation& o) { crop(o, 7, 1, 23, 21); }), all - 1);
  Observation o = stored().back();
  crop(o, 7, 1, 23, 21);
  lump::Estimate ignored;
  const lump::Model& model = lump::Network::built_in().model();
  const auto nodes = pressed_nodes(model, o, ignored);
  ASSERT_TRUE(nodes);
  const auto found = find_contradictions(model, o, &*nodes);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].value, 3.75, 0.5);
  EXPECT_LT(found[0].sd, 0.5);
}

TEST(LumpConsistency, LoadsInTheWrongOrderOrOfAnotherPressAreFound) {
  const size_t all = stored().size();
  EXPECT_EQ(count_of(Fault::Order, [](Observation& o) { std::swap(o.pressure_Pa[1], o.pressure_Pa[2]); }),
            all);
  EXPECT_EQ(count_of(Fault::Order,
                     [](Observation& o) { std::reverse(o.pressure_Pa.begin(), o.pressure_Pa.end()); }),
            all);
  EXPECT_EQ(count_of(Fault::OneForce, [](Observation& o) { o.force_N[1] *= 1.25; }), all);
  // The last map one node, 1.25 mm, to the side, twice.
  EXPECT_GE(count_of(Fault::Slide,
                     [](Observation& o) {
                       PressureMap& map = o.pressure_Pa.back();
                       const PressureMap from = map;
                       for (uint32_t y = 0; y < map.height; ++y)
                         for (uint32_t x = 0; x < map.width; ++x)
                           map.values[size_t{y} * map.width + x] = from.at(std::min(x + 2, map.width - 1), y);
                     }),
            all - 1);
}

}  // namespace
}  // namespace palpate
