// The inverse on maps that another program's finite elements made: what the network says of a lump is within
// its intervals, or it says that it cannot tell.
#include "tests/support/calculix.h"

#include <gtest/gtest.h>

#include <algorithm>
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
  const fem::Map& last = observation.pressure_Pa.back();
  observation.noise_Pa = 0.002 * double{*std::max_element(last.values.begin(), last.values.end())};
  return observation;
}

struct Asked {
  const char* name;
  lump::Method method;
};

class CalculixInverse : public testing::TestWithParam<Asked> {};

std::string told(const lump::Estimate& e) {
  std::ostringstream line;
  line << lump::to_string(e.verdict) << ": d " << e.size_mm.value << " (" << e.size_mm.low << " to "
       << e.size_mm.high << "), depth " << e.depth_mm.value << " (" << e.depth_mm.low << " to "
       << e.depth_mm.high << "), ratio " << e.stiffness_ratio.value << " (" << e.stiffness_ratio.low << " to "
       << e.stiffness_ratio.high << "), " << fem::to_string(e.shape);
  return line.str();
}

TEST_P(CalculixInverse, IntervalsHoldOrTheVerdictIsOpen) {
  const CalculixCase block = calculix_case(GetParam().name);
  const lump::Estimate found = lump::Network::built_in().estimate(observation_of(block), GetParam().method);
  RecordProperty("told", told(found));
  if (!block.scene.inclusion) {
    EXPECT_NE(found.verdict, lump::Status::Found) << told(found);
    return;
  }
  EXPECT_NE(found.verdict, lump::Status::NoLump) << told(found);
  if (!lump::reports_numbers(found.verdict)) return;  // it refuses
  const fem::Inclusion& lump = *block.scene.inclusion;
  const auto holds = [](const lump::Value& value, double truth) {
    return value.low <= truth && truth <= value.high;
  };
  EXPECT_TRUE(holds(found.size_mm, lump.size()[2])) << told(found);
  EXPECT_TRUE(holds(found.depth_mm, lump.depth_mm)) << told(found);
  if (found.verdict == lump::Status::StiffnessOpen) return;
  EXPECT_TRUE(holds(found.stiffness_ratio, lump.stiffness_ratio)) << told(found);
}

constexpr Asked kAsked[] = {
    {"plain", lump::Method::Network},          {"plain", lump::Method::Refined},
    {"small_ball", lump::Method::Network},     {"small_ball", lump::Method::Refined},
    {"cylinder", lump::Method::Network},       {"cylinder", lump::Method::Refined},
    {"deep_ellipsoid", lump::Method::Network}, {"deep_ellipsoid", lump::Method::Refined}};

INSTANTIATE_TEST_SUITE_P(Blocks, CalculixInverse, testing::ValuesIn(kAsked), [](const auto& asked) {
  return std::string(asked.param.name) +
         (asked.param.method == lump::Method::Network ? "_network" : "_refined");
});

}  // namespace
}  // namespace palpate
