// A pad that is lifted and set down elsewhere: found again on what the map knows, and nowhere else.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/map/object_map.h"
#include "perf/map/relief.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

using namespace scenes;

struct FoundMap {
  std::shared_ptr<const MapSnapshot> map;
  std::optional<MapPlace> place;  ///< of the last frame
};

/// Slides from (x0, y0) to (x1, y1), mm, turned by so much, 1 mm a frame.
std::vector<RigidMotion> slide(double x0, double y0, double x1, double y1, double turn_deg) {
  std::vector<RigidMotion> out;
  const int frames = static_cast<int>(std::ceil(std::hypot(x1 - x0, y1 - y0))) + 1;
  Vector6d twist = Vector6d::Zero();
  twist[5] = turn_deg * kDegree;
  for (int k = 0; k < frames; ++k) {
    const double t = k / (frames - 1.0);
    out.push_back(motion_about(Eigen::Vector3d::Zero(), twist) *
                  RigidMotion{Eigen::Matrix3d::Identity(), {-x0 - t * (x1 - x0), -y0 - t * (y1 - y0), 0}});
  }
  return out;
}

/// Slides one after the other, each over its object, the pad lifted between them.
FoundMap map_of(const std::vector<std::pair<SolidObject, std::vector<RigidMotion>>>& slides,
                DepthNoise noise = DepthNoise::White, MapOptions options = {}) {
  const PadView pad = wide_pad(false);
  std::mt19937 random(1);
  PoseTracker tracker;
  ObjectMap map(options);
  for (const auto& [object, way] : slides) {
    for (const RigidMotion& motion : way) {
      const PressedMap seen = pressed(object, motion, pad, 0.002, noise, random);
      map.add(seen.map(), tracker.update(seen.map()));
      while (map.work(ObjectMap::Work::Places)) {
      }
    }
    tracker.lift();
  }
  map.finish();
  return {map.snapshot(), map.place()};
}

TEST(FoundAgain, WhereThePadComesDownTurnedOnWhatTheMapKnows) {
  for (const uint32_t seed : {5u, 6u, 7u})
    for (const DepthNoise noise : {DepthNoise::White, DepthNoise::Integrated})
      for (const double turn_deg : {40.0, -125.0}) {
        if (!thorough() && (seed != 5 || (noise == DepthNoise::White) == (turn_deg > 0))) continue;
        const Relief relief(seed);
        const std::vector<RigidMotion> first = slide(-20, 0, 20, 0, 3), then = slide(6, 1, 12, -1, turn_deg);
        const FoundMap m = map_of({{relief.object(), first}, {relief.object(), then}}, noise);
        std::printf("seed %u, %.0f degrees: pieces %zu, keys %u, found again %u, ambiguous %u\n", seed,
                    turn_deg, m.map->pieces.size(), m.map->keys, m.map->found_again, m.map->ambiguous);
        ASSERT_EQ(m.map->pieces.size(), 1u);
        EXPECT_GE(m.map->found_again, 1u);
        EXPECT_EQ(m.map->smooth, 0u);
        ASSERT_TRUE(m.place);
        const RigidMotion truth = then.back() * first.front().inverse();
        const Vector6d off = twist_between(m.place->motion, truth, Eigen::Vector3d::Zero());
        EXPECT_LT(off.head<3>().norm(), 0.05);
        EXPECT_LT(off.tail<3>().norm(), 0.5 * kDegree);
      }
  const Relief relief;
  const FoundMap off =
      map_of({{relief.object(), slide(-20, 0, 20, 0, 3)}, {relief.object(), slide(6, 1, 12, -1, 40)}},
             DepthNoise::White, {.searches = 0});
  EXPECT_EQ(off.map->pieces.size(), 2u) << "nothing is searched";
}

TEST(FoundAgain, NotOnGroundThatTheMapDoesNotKnow) {
  for (const uint32_t seed : {5u, 6u, 7u})
    for (const DepthNoise noise : {DepthNoise::White, DepthNoise::Integrated}) {
      if (!thorough() && (seed != 5 || noise == DepthNoise::White)) continue;
      const FoundMap m = map_of({{Relief(seed).object(), slide(-20, 0, 20, 0, 3)},
                                 {Relief(seed + 10).object(), slide(6, 1, 14, -1, 40)}},
                                noise);
      std::printf("seed %u: pieces %zu, found again %u, ambiguous %u\n", seed, m.map->pieces.size(),
                  m.map->found_again, m.map->ambiguous);
      EXPECT_EQ(m.map->pieces.size(), 2u);
      EXPECT_EQ(m.map->found_again, 0u);
    }
}

// One place of many that are alike is not known, even where each of them fits.
TEST(FoundAgain, NotOnAPatternThatRepeats) {
  for (const double period_mm : {2.5, 4.0}) {
    const SolidObject pattern{"pattern", [period_mm](double x, double y) {
                                const double k = 2 * M_PI / period_mm;
                                return 0.45 + 0.05 * std::sin(k * x) + 0.04 * std::sin(k * y + 1) +
                                       0.03 * std::sin(k * (x + y) + 2) + 0.02 * std::sin(k * (2 * x - y));
                              }};
    const FoundMap m = map_of({{pattern, slide(-20, 0, 20, 0, 3)}, {pattern, slide(6, 1, 12, -1, 40)}});
    std::printf("period %.1f mm: pieces %zu, found again %u, ambiguous %u\n", period_mm, m.map->pieces.size(),
                m.map->found_again, m.map->ambiguous);
    EXPECT_EQ(m.map->pieces.size(), 2u);
    EXPECT_EQ(m.map->found_again, 0u);
    EXPECT_GT(m.map->ambiguous, 0u);
  }
}

// A pattern that goes on beyond a map of less than two of its periods: the pad comes down three periods on,
// where the map has just one place like it. The same way over a relief that does not repeat is joined.
TEST(FoundAgain, NotOnAPatternThatGoesOnBeyondTheMap) {
  constexpr double kPeriod_mm = 12;
  const Relief relief(9);
  const SolidObject pattern{"pattern", [&](double x, double y) {
                              const double t = std::remainder(x, kPeriod_mm) / (kPeriod_mm / 2);
                              // Two halves of the relief that fade into each other.
                              const double part = 0.5 + 0.5 * std::cos(M_PI * t), u = t * kPeriod_mm / 2;
                              const double other = u - std::copysign(kPeriod_mm / 2, u);
                              return part * relief.depth_mm(u, y) +
                                     (1 - part) * relief.depth_mm(other + 20, y);
                            }};
  const auto ways = [&](const SolidObject& object, double on_mm) {
    return map_of({{object, slide(-3, 0, 3, 0, 3)}, {object, slide(on_mm, 1, on_mm + 6, -1, 3)}});
  };
  const FoundMap apart = ways(pattern, 3 * kPeriod_mm), joined = ways(relief.object(), 0);
  std::printf("pattern: pieces %zu, repeating %u, ambiguous %u; relief: pieces %zu, found again %u\n",
              apart.map->pieces.size(), apart.map->repeating, apart.map->ambiguous, joined.map->pieces.size(),
              joined.map->found_again);
  EXPECT_EQ(apart.map->found_again, 0u);
  EXPECT_EQ(apart.map->pieces.size(), 2u);
  EXPECT_GT(apart.map->repeating, 0u);
  EXPECT_EQ(joined.map->pieces.size(), 1u);
  EXPECT_GE(joined.map->found_again, 1u);
  EXPECT_EQ(joined.map->repeating, 0u);
}

}  // namespace
}  // namespace palpate
