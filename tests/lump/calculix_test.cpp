// The inverse on maps that another program's finite elements made: what the network says of a lump is within
// its intervals, or it has no numbers and says so.
#include "tests/support/calculix.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "engine/lump/network/network.h"

namespace palpate {
namespace {

/// The block's loads as a sensor over all of it would see them, with the noise of a good one.
lump::Observation observation_of(const CalculixCase& block) {
  lump::Observation observation;
  observation.block_mm = block.scene.block_mm;
  observation.young_Pa = block.scene.young_Pa;
  for (const CalculixCase::Load& load : block.loads) {
    observation.pressure_Pa.push_back(without_rim(load.pressure_Pa));
    observation.force_N.push_back(load.force_N);
  }
  const PressureMap& last = observation.pressure_Pa.back();
  observation.noise_Pa = 0.002 * double{*std::max_element(last.values.begin(), last.values.end())};
  return observation;
}

struct Asked {
  const char* name;
  lump::Method method;
};

std::string told(const lump::Estimate& e) {
  std::ostringstream line;
  line << lump::to_string(e.verdict) << ": d " << e.size_mm.value << " (" << e.size_mm.low << " to "
       << e.size_mm.high << "), depth " << e.depth_mm.value << " (" << e.depth_mm.low << " to "
       << e.depth_mm.high << "), ratio " << e.stiffness_ratio.value << " (" << e.stiffness_ratio.low << " to "
       << e.stiffness_ratio.high << "), " << to_string(e.shape);
  return line.str();
}

/// By how many halves of its interval a value is off: up to 1 the interval holds.
double halves_off(const lump::Value& value, double truth) {
  const double off = std::log(truth / value.value);
  return off > 0 ? off / std::log(value.high / value.value) : off / std::log(value.low / value.value);
}

constexpr Asked kAsked[] = {
    {"plain", lump::Method::Network},          {"plain", lump::Method::Refined},
    {"small_ball", lump::Method::Network},     {"small_ball", lump::Method::Refined},
    {"cylinder", lump::Method::Network},       {"cylinder", lump::Method::Refined},
    {"deep_ellipsoid", lump::Method::Network}, {"deep_ellipsoid", lump::Method::Refined}};

// One in ten of the intervals may miss, by little; a lump is never missed, and none is found in tissue alone.
TEST(CalculixInverse, IntervalsHoldOrTheVerdictIsOpen) {
  int reported = 0, held = 0, lumps = 0;
  for (const Asked& asked : kAsked) {
    SCOPED_TRACE(std::string(asked.name) +
                 (asked.method == lump::Method::Network ? ", network" : ", refined"));
    const CalculixCase block = calculix_case(asked.name);
    const lump::Estimate found = lump::Network::built_in().estimate(observation_of(block), asked.method);
    std::printf("%s: %s\n", asked.name, told(found).c_str());
    if (!block.scene.inclusion) {
      EXPECT_EQ(found.verdict, lump::Status::NoLump) << told(found);
      continue;
    }
    EXPECT_NE(found.verdict, lump::Status::NoLump) << told(found);
    if (!lump::reports_numbers(found.verdict)) continue;  // it refuses
    ++lumps;
    const fem::Inclusion& lump = *block.scene.inclusion;
    for (const auto& [value, truth] : {std::pair{found.size_mm, lump.size()[2]},
                                       {found.depth_mm, lump.depth_mm},
                                       {found.stiffness_ratio, lump.stiffness_ratio}}) {
      const double off = halves_off(value, truth);
      EXPECT_LT(off, 2.5) << told(found);
      ++reported;
      held += off <= 1;
    }
  }
  EXPECT_GE(lumps, 5);
  EXPECT_GE(held, reported - 3) << "of " << reported;
}

}  // namespace
}  // namespace palpate
