// Presses by hand: places by the skin, tilts by pressure, held against what the simulated hand did.
#include "engine/palpation/hand/hand_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <utility>

#include "engine/lump/network/network.h"
#include "engine/lump/observation/pad_tilt.h"
#include "engine/palpation/hand/hand_simulation.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kOneDegree = M_PI / 180;

/// A block without a lump whose pressure is even, pressed as a neo-Hookean column is.
PressedTissue even_tissue() {
  PressedTissue tissue;
  const double area_m2 = 1e-6 * tissue.block_mm[0] * tissue.block_mm[1];
  for (const double force_N : {0.4, 0.8, 1.2, 1.6}) {
    tissue.force_N.push_back(force_N);
    tissue.press_mm.push_back(tissue.block_mm[2] *
                              lump::compression_under(force_N / area_m2, tissue.young_Pa));
    tissue.pressure_Pa.push_back(
        {33, 33, {1.25, 1.25}, std::vector<float>(33 * 33, static_cast<float>(force_N / area_m2))});
  }
  return tissue;
}

/// The same, whose pressure falls behind its force as the block spreads; higher in its middle.
PressedTissue spreading_tissue() {
  PressedTissue tissue = even_tissue();
  for (size_t k = 0; k < tissue.force_N.size(); ++k)
    for (float& value : tissue.pressure_Pa[k].values)
      value *= static_cast<float>(1.16 * (1 - tissue.press_mm[k] / tissue.block_mm[2]));
  return tissue;
}

HandPlan four_presses(uint64_t seed) {
  HandPlan plan;
  plan.aims_mm = {{0, 0}, {6, -3}, {6, 5}, {-5, 4}};
  plan.aim_sd_mm = 1;
  plan.force_N = {1, 1.5};
  plan.skill.tilt_deg = 3;
  plan.seed = seed;
  return plan;
}

std::string refusal(const std::vector<HandPress>& presses) {
  try {
    place_presses(presses);
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::Input);
    return error.what();
  }
  return "";
}

TEST(HandScan, PlacesAreThoseOfTheSkin) {
  double squares = 0, held = 0, count = 0;
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    std::vector<HandTruth> truth;
    const std::vector<HandPress> presses = simulate_hand(even_tissue(), four_presses(seed), &truth);
    const HandPlaces found = place_presses(presses);
    const double c = std::cos(truth[0].turn_rad), s = std::sin(truth[0].turn_rad);
    for (size_t p = 1; p < presses.size(); ++p) {
      ASSERT_TRUE(found.places[p].placed) << seed << " " << p << " " << found.places[p].reason;
      // The first press's frame is the map's.
      const double x = truth[p].at_mm[0] - truth[0].at_mm[0], y = truth[p].at_mm[1] - truth[0].at_mm[1];
      const double off[3] = {found.places[p].at_mm[0] - (c * x + s * y),
                             found.places[p].at_mm[1] - (c * y - s * x),
                             found.places[p].turn_rad - (truth[p].turn_rad - truth[0].turn_rad)};
      for (size_t k = 0; k < 3; ++k) {
        const size_t row = 3 * p + k;
        held += std::abs(off[k]) < 2.5 * std::sqrt(found.covariance[row * 3 * presses.size() + row]);
        count += 1;
      }
      squares += (off[0] * off[0] + off[1] * off[1]) / 2;
      EXPECT_LT(std::abs(off[2]), 2.5 * kOneDegree) << seed << " " << p;
    }
  }
  const double rms_mm = std::sqrt(squares / (count / 3));
  std::printf("places: RMS %.3f mm along an axis, %.0f of %.0f within 2.5 standard errors\n", rms_mm, held,
              count);
  EXPECT_LT(rms_mm, 0.15);
  EXPECT_GT(held, 0.8 * count);
}

TEST(HandScan, TiltsAreFoundAndTakenOut) {
  std::vector<HandTruth> truth;
  const PressedTissue tissue = even_tissue();
  const std::vector<HandPress> presses = simulate_hand(tissue, four_presses(4), &truth);
  const HandScan scan = hand_scan(presses, lump::Network::built_in().model());
  ASSERT_EQ(scan.presses.size(), presses.size());
  const lump::ScanMap map = lump::stitch(scan.presses, scan.stitch);
  double tilted = 0;
  for (size_t p = 0; p < presses.size(); ++p) {
    // Against each other: what they have in common the block's own shape tells, and this one has none.
    const double x = (truth[p].tilt_rad[0] - truth[0].tilt_rad[0]) / kOneDegree,
                 y = (truth[p].tilt_rad[1] - truth[0].tilt_rad[1]) / kOneDegree;
    EXPECT_NEAR(scan.tilt[p].x_deg - scan.tilt[0].x_deg, x, 1) << p;
    EXPECT_NEAR(scan.tilt[p].y_deg - scan.tilt[0].y_deg, y, 1) << p;
    tilted = std::max(tilted, std::hypot(x, y));
  }
  EXPECT_GT(tilted, 1.5);
  const double mean_Pa = map.observation.force_N.back() / 1600e-6;
  EXPECT_LT(map.between_presses_Pa, 0.03 * mean_Pa);
  for (const lump::PressPlace& place : map.places)
    EXPECT_NEAR(place.shift_mm[0], 0, 1e-6) << "held where the skin says";
  EXPECT_GT(map.observation.place_sd_mm, 1);  // the first press's aim
}

TEST(HandScan, MomentsTellTheTiltToFiveDegrees) {
  const PressedTissue tissue = spreading_tissue();
  for (const double most : {1.0, 3.0, 5.0}) {
    HandPlan plan = four_presses(static_cast<uint64_t>(10 * most));
    plan.skill.tilt_deg = most;
    plan.relief_pitch_mm = 0.5;
    std::vector<HandTruth> truth;
    const std::vector<HandPress> presses = simulate_hand(tissue, plan, &truth);
    for (size_t p = 0; p < presses.size(); ++p) {
      const lump::Observation& seen = presses[p].observation;
      const lump::PadTilt tilt = lump::pad_tilt(seen.pressure_Pa.back(), {seen.young_Pa, seen.block_mm[2]});
      const double c = std::cos(truth[p].turn_rad), s = std::sin(truth[p].turn_rad);
      const double x = (c * truth[p].tilt_rad[0] + s * truth[p].tilt_rad[1]) / kOneDegree,
                   y = (c * truth[p].tilt_rad[1] - s * truth[p].tilt_rad[0]) / kOneDegree;
      EXPECT_NEAR(tilt.x_deg, x, 2.5 * tilt.x_sd_deg) << most << " " << p;
      EXPECT_NEAR(tilt.y_deg, y, 2.5 * tilt.y_sd_deg) << most << " " << p;
      EXPECT_LT(tilt.x_sd_deg, 1);
    }
  }
  const PressureMap empty{9, 9, {1, 1}, std::vector<float>(81, 0)};
  EXPECT_TRUE(std::isnan(lump::pad_tilt(empty, {}).size_deg()));
}

TEST(HandScan, APressOfAnotherSkinIsLeftOut) {
  std::vector<HandPress> presses = simulate_hand(even_tissue(), four_presses(5));
  presses[2].relief = simulate_hand(even_tissue(), four_presses(77))[2].relief;
  const HandScan scan = hand_scan(presses, lump::Network::built_in().model());
  EXPECT_FALSE(scan.places.places[2].placed);
  EXPECT_EQ(scan.presses.size(), 3u);
  EXPECT_NE(scan.left_out[2].find("no texture or no overlap"), std::string::npos) << scan.left_out[2];
  EXPECT_TRUE(scan.left_out[1].empty());
}

TEST(HandScan, EndsWhereItIsStopped) {
  const std::vector<HandPress> presses = simulate_hand(even_tissue(), four_presses(4));
  const lump::Model& model = lump::Network::built_in().model();
  HandScanOptions options;
  size_t asked = 0, until = 1000000;
  // Of the processor: others may use it as well.
  std::clock_t last = std::clock();
  double longest_s = 0;
  options.places.stop = [&] {
    const std::clock_t now = std::clock();
    longest_s = std::max(longest_s, static_cast<double>(now - std::exchange(last, now)) / CLOCKS_PER_SEC);
    return ++asked > until;
  };
  EXPECT_EQ(hand_scan(presses, model, options).presses.size(), presses.size());
  std::printf("asked %zu times, at most %.2f s apart\n", asked, longest_s);
  EXPECT_LT(longest_s, 1);
  const size_t all = asked;
  EXPECT_GT(all, presses.size());
  for (until = 0; until < all; until += 3) {
    asked = 0;
    EXPECT_THROW(hand_scan(presses, model, options), Stopped);
    EXPECT_EQ(asked, until + 1) << "nothing is begun after it";
  }
}

TEST(HandScan, RefusesWhatHasNoPlaces) {
  HandPlan smooth = four_presses(6);
  smooth.relief_mm = 0;
  EXPECT_NE(refusal(simulate_hand(even_tissue(), smooth)).find("texture"), std::string::npos);
  std::vector<HandPress> presses = simulate_hand(even_tissue(), four_presses(7));
  EXPECT_NE(refusal({presses[0]}).find("two presses"), std::string::npos);
  HandPlan other = four_presses(7);
  other.relief_pitch_mm = 0.3;
  presses[1] = simulate_hand(even_tissue(), other)[1];
  EXPECT_NE(refusal(presses).find("press 2"), std::string::npos);
  HandPlan hard = four_presses(8);
  hard.force_N = {5, 6};
  EXPECT_THROW(simulate_hand(even_tissue(), hard), Error);
}

}  // namespace
}  // namespace palpate
