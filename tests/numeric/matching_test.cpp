// Matching of bent point sets against known partners.
#include "engine/numeric/matching/matching.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "capture/synthetic/bent_points.h"
#include "palpate/error.h"

namespace palpate {
namespace {

struct Score {
  double miss = 0,
         right = 0;  // means over trials: distance over scale; fraction of named partners that are right
  int reliable = 0, trials = 0;
};

Score score(BentScene scene, int trials) {
  Score s;
  for (int t = 0; t < trials; ++t) {
    scene.seed = static_cast<uint32_t>(100 + t);
    const BentPoints points = bent(scene);
    const MatchResult result = match_points(points.from, points.to);
    s.miss += mean_miss(result.warped, points.truth) / scene.scale / trials;
    s.reliable += result.reliable();
    ++s.trials;
    size_t right = 0, named = 0;
    std::set<uint32_t> taken;
    for (size_t i = 0; i < result.partners.size(); ++i) {
      const Partner& p = result.partners[i];
      if (!result.reliable()) continue;
      EXPECT_GE(p.probability, 0);
      EXPECT_LE(p.probability, 1);
      if (!p.target) continue;
      EXPECT_TRUE(taken.insert(*p.target).second)
          << "target " << *p.target << " given twice, seed " << scene.seed;
      ++named;
      right += static_cast<int64_t>(*p.target) == points.target_of_from[i];
    }
    s.right += named > 0 ? static_cast<double>(right) / static_cast<double>(named) / trials : 0;
  }
  return s;
}

TEST(Matching, BentShapesPointByPoint) {
  const Score s = score({.bend = 0.06}, 10);
  EXPECT_EQ(s.reliable, 10);
  EXPECT_LT(s.miss, 0.001);
  EXPECT_GT(s.right, 0.99);
}

TEST(Matching, StronglyBentShapes) {
  const Score s = score({.bend = 0.08}, 10);
  EXPECT_LT(s.miss, 0.008);
  EXPECT_GT(s.right, 0.9);
}

TEST(Matching, NoiseIsSmoothedAndEstimated) {
  const Score s = score({.noise_sd = 0.03}, 8);
  EXPECT_EQ(s.reliable, 8);
  EXPECT_LT(s.miss, 0.0165);
  const Score more = score({.noise_sd = 0.05}, 8);
  EXPECT_EQ(more.reliable, 8);
  EXPECT_LT(more.miss, 0.027);
  const BentPoints points = bent({.noise_sd = 0.03, .seed = 3});
  EXPECT_NEAR(match_points(points.from, points.to).noise_sd, 0.03, 0.012);
}

TEST(Matching, StrangersAmongTheTarget) {
  const Score s = score({.outlier_ratio = 1}, 8);
  EXPECT_LT(s.miss, 0.008);
  EXPECT_GT(s.right, 0.9);
  const BentPoints points = bent({.bend = 0.03, .outlier_ratio = 2, .seed = 7});
  const MatchResult result = match_points(points.from, points.to);
  EXPECT_TRUE(result.reliable());
  EXPECT_NEAR(result.target_outlier_fraction, 2. / 3, 0.05);
}

TEST(Matching, EightStrangersInTenOnAShapeThatMovedLittle) {
  const Score s = score({.bend = 0.02, .outlier_ratio = 4}, 4);
  EXPECT_LT(s.miss, 0.01);
  EXPECT_GT(s.right, 0.8);
}

TEST(Matching, MissingPointsGoToNil) {
  const BentPoints points = bent({.missing_fraction = 0.2, .seed = 4});
  const MatchResult result = match_points(points.from, points.to);
  ASSERT_TRUE(result.reliable());
  size_t missing = 0, nil = 0;
  for (size_t i = 0; i < points.from.size(); ++i)
    if (points.target_of_from[i] < 0) {
      ++missing;
      nil += !result.partners[i].target;
    }
  EXPECT_GT(missing, 10u);
  EXPECT_GE(static_cast<double>(nil), 0.9 * static_cast<double>(missing));
  EXPECT_NEAR(result.template_nil_fraction, 0.2, 0.06);
}

class MatchingTurns : public testing::TestWithParam<double> {};
TEST_P(MatchingTurns, AreFound) {
  const Score s = score({.bend = 0.04, .turn_deg = GetParam()}, 3);
  EXPECT_EQ(s.reliable, 3);
  EXPECT_LT(s.miss, 0.002);
}
INSTANTIATE_TEST_SUITE_P(Degrees, MatchingTurns, testing::Values(30., 45., 90., 135., 180., 285.),
                         [](const auto& at) { return std::to_string(static_cast<int>(at.param)); });

TEST(Matching, SpaceAsThePlane) {
  const Score s = score({.axes = 3}, 5);
  EXPECT_EQ(s.reliable, 5);
  EXPECT_LT(s.miss, 0.002);
  EXPECT_GT(s.right, 0.97);
  const Score turned = score({.axes = 3, .turn_deg = 120}, 3);
  EXPECT_LT(turned.miss, 0.002);
}

TEST(Matching, UnitsAndPlacesDoNotMatter) {
  const BentPoints unit = bent({.seed = 5});
  const MatchResult expected = match_points(unit.from, unit.to);
  for (const double scale : {1e-3, 1e5}) {
    const BentPoints points = bent({.scale = scale, .seed = 5});
    const MatchResult result = match_points(points.from, points.to);
    EXPECT_TRUE(result.reliable());
    EXPECT_LT(mean_miss(result.warped, points.truth) / scale, 0.001) << scale;
    EXPECT_EQ(result.winner, expected.winner);
  }
  const BentPoints far = bent({.shift = 1e6, .seed = 5});
  EXPECT_LT(mean_miss(match_points(far.from, far.to).warped, far.truth), 0.001);
}

TEST(Matching, ATargetSomewhereElseAndOfAnotherSize) {
  BentPoints points = bent({.bend = 0.03, .turn_deg = 60, .seed = 6});
  for (PointSet* set : {&points.to, &points.truth})
    for (double& v : set->coordinates) v = 250 * v - 4000;
  const MatchResult result = match_points(points.from, points.to);
  EXPECT_TRUE(result.reliable()) << to_string(result.verdict);
  EXPECT_LT(mean_miss(result.warped, points.truth) / 250, 0.002);
}

TEST(Matching, UnrelatedSetsAreNoMatch) {
  std::mt19937 random(9);
  for (int trial = 0; trial < 8; ++trial) {
    PointSet strangers;
    for (int k = 0; k < 200; ++k)
      strangers.coordinates.push_back(static_cast<double>(random()) / 4294967296.0);
    const MatchResult result = match_points(character(2), strangers);
    EXPECT_FALSE(result.reliable()) << trial << ", evidence " << result.log_likelihood_gain;
    for (const Partner& p : result.partners) EXPECT_FALSE(p.target.has_value());
  }
}

TEST(Matching, TheSamePointsTheSameAnswer) {
  const BentPoints points = bent({.noise_sd = 0.02, .outlier_ratio = 0.5, .seed = 8});
  const MatchResult a = match_points(points.from, points.to), b = match_points(points.from, points.to);
  EXPECT_EQ(a.warped.coordinates, b.warped.coordinates);
  EXPECT_EQ(a.iterations, b.iterations);
}

std::vector<size_t> drawn_order(size_t size, std::mt19937& random) {
  std::vector<size_t> order(size);
  std::iota(order.begin(), order.end(), size_t{0});
  for (size_t i = size - 1; i > 0; --i) std::swap(order[i], order[random() % (i + 1)]);
  return order;
}

PointSet in_order(const PointSet& set, const std::vector<size_t>& order) {
  PointSet result{set.axes, {}};
  for (const size_t i : order)
    for (const double v : set.at(i)) result.coordinates.push_back(v);
  return result;
}

// Easy and hard pairs, and one that is thinned: to the last bit.
TEST(Matching, OneAnswerWhateverTheOrder) {
  std::vector<BentPoints> pairs;
  pairs.push_back(bent({.bend = 0.11, .turn_deg = 40, .seed = 2}));
  pairs.push_back(bent({.noise_sd = 0.04, .outlier_ratio = 1, .seed = 3}));
  pairs.push_back(bent({.bend = 0.08, .missing_fraction = 0.3, .turn_deg = 130, .seed = 4}));
  pairs.push_back(bent({.axes = 3, .noise_sd = 0.02, .seed = 5}));
  pairs.push_back(bent({.noise_sd = 0.01, .outlier_ratio = 2.2, .seed = 6}));
  std::mt19937 random(1);
  for (size_t k = 0; k < pairs.size(); ++k) {
    const BentPoints& points = pairs[k];
    const MatchResult first = match_points(points.from, points.to);
    for (int trial = 0; trial < 1; ++trial) {
      const std::vector<size_t> from = drawn_order(points.from.size(), random),
                                to = drawn_order(points.to.size(), random);
      const MatchResult again = match_points(in_order(points.from, from), in_order(points.to, to));
      ASSERT_EQ(again.verdict, first.verdict) << k;
      EXPECT_EQ(again.warped.coordinates, in_order(first.warped, from).coordinates) << k;
      EXPECT_EQ(again.evidence, first.evidence) << k;
      EXPECT_EQ(again.posterior, first.posterior) << k;
      for (size_t i = 0; i < from.size(); ++i) {
        const Partner &a = again.partners[i], &b = first.partners[from[i]];
        ASSERT_EQ(a.target.has_value(), b.target.has_value()) << k;
        if (a.target) {
          EXPECT_EQ(to[*a.target], *b.target) << k;
        }
      }
    }
  }
}

PointSet scattered(size_t count, uint32_t seed, uint32_t axes = 2) {
  std::mt19937 random(seed);
  PointSet set{axes, {}};
  for (size_t i = 0; i < count * axes; ++i)
    set.coordinates.push_back(100 * static_cast<double>(random()) / 4294967296.0);
  return set;
}

/// (x, y, ...) -> A (x, y) + shift; a third coordinate is scaled as `a`.
PointSet mapped(const PointSet& set, double a, double b, double c, double d) {
  PointSet result = set;
  for (size_t i = 0; i < set.size(); ++i) {
    double* p = result.coordinates.data() + i * set.axes;
    const double x = p[0], y = p[1];
    p[0] = a * x + b * y + 30, p[1] = c * x + d * y - 12;
  }
  return result;
}

int right_partners(const PointSet& from, const PointSet& to, const std::string& what) {
  std::mt19937 random(4);
  const std::vector<size_t> order = drawn_order(to.size(), random);
  const MatchResult result = match_points(from, in_order(to, order));
  if (!result.reliable()) return 0;
  EXPECT_LT(mean_miss(result.warped, to), 1e-6 * result.scale) << what;
  for (size_t i = 0; i < from.size(); ++i) {
    EXPECT_TRUE(result.partners[i].target.has_value()) << what;
    if (result.partners[i].target) {
      EXPECT_EQ(order[*result.partners[i].target], i) << what;
    }
  }
  return 1;
}

// What is not bent needs no more than one point beyond an affine map's own.
TEST(Matching, FewPointsThatAreNotBentAreMatched) {
  const double c = std::cos(0.5), s = std::sin(0.5);
  int affine = 0, affine_trials = 0;
  for (size_t count = 4; count <= 14; ++count)
    for (uint32_t seed = 1; seed <= 3; ++seed) {
      const PointSet set = scattered(count, seed * 31 + static_cast<uint32_t>(count));
      const std::string what = std::to_string(count) + " points, seed " + std::to_string(seed);
      EXPECT_EQ(right_partners(set, set, what), 1) << what << ", the same";
      EXPECT_EQ(right_partners(set, mapped(set, c, -s, s, c), what), 1) << what << ", moved and turned";
      EXPECT_EQ(right_partners(set, mapped(set, 2.5 * c, -2.5 * s, 2.5 * s, 2.5 * c), what), 1) << what;
      affine += right_partners(set, mapped(set, 1.3, 0.4, -0.1, 0.8), what);
      ++affine_trials;
    }
  EXPECT_GE(affine, affine_trials - 2);  // four points nearly on a line leave an affine map open
  const PointSet space = scattered(6, 9, 3);
  EXPECT_EQ(right_partners(space, mapped(space, c, -s, s, c), "space"), 1);
}

TEST(Matching, FewPointsWithNoiseAndGapsAreMatchedOrRefused) {
  std::mt19937 random(8);
  std::normal_distribution<double> noise(0, 0.1);
  int right = 0, trials = 0;
  for (size_t count = 6; count <= 12; ++count) {
    const PointSet set = scattered(count, static_cast<uint32_t>(77 + count));
    PointSet to = mapped(set, 0.8, -0.6, 0.6, 0.8);
    const PointSet truth = to;
    for (double& v : to.coordinates) v += noise(random);
    to.coordinates.resize(to.coordinates.size() - 2);  // the last has no partner
    const MatchResult result = match_points(set, to);
    ++trials;
    if (!result.reliable()) continue;
    EXPECT_LT(mean_miss(result.warped, truth) / result.scale, 0.02) << count;
    EXPECT_FALSE(result.partners.back().target) << count;
    ++right;
  }
  EXPECT_GE(right, trials - 2);
}

TEST(Matching, FewPointsThatFitThemselvesOtherwiseAreAmbiguous) {
  PointSet square{2, {0, 0, 10, 0, 10, 10, 0, 10}}, rectangle{2, {0, 0, 30, 0, 30, 10, 0, 10}}, grid{2, {}},
      ring{2, {}};
  for (int k = 0; k < 12; ++k)
    grid.coordinates.insert(grid.coordinates.end(), {10. * (k % 4), 10. * std::floor(k / 4.)});
  for (int k = 0; k < 7; ++k)
    ring.coordinates.insert(ring.coordinates.end(), {std::cos(2 * M_PI * k / 7), std::sin(2 * M_PI * k / 7)});
  for (PointSet* set : {&square, &rectangle, &grid, &ring}) {
    for (double& v : set->coordinates) v *= M_PI;  // of a few round numbers the digits are not known
    const MatchResult result = match_points(*set, *set);
    EXPECT_EQ(result.verdict, MatchVerdict::Ambiguous) << set->size() << " " << to_string(result.verdict);
    for (const Partner& partner : result.partners) EXPECT_FALSE(partner.target);
    EXPECT_TRUE(match_points(*set, *set, {.most_turn_deg = 10}).reliable()) << set->size();
  }
  EXPECT_EQ(match_points(scattered(3, 1), scattered(3, 1)).verdict, MatchVerdict::TooFewPoints);
}

TEST(Matching, FewUnrelatedPointsAreNoMatch) {
  int reliable = 0;
  for (uint32_t seed = 0; seed < 200; ++seed) {
    PointSet from = scattered(4 + seed % 9, 1000 + seed), to = scattered(4 + seed / 9 % 9, 5000 + seed);
    if (seed % 3 == 0)  // written with few digits: coincidences are no evidence
      for (PointSet* set : {&from, &to})
        for (double& v : set->coordinates) v = std::round(v / 5) * 5;
    reliable += match_points(from, to).reliable();
  }
  EXPECT_LE(reliable, 1);
}

TEST(Matching, DegenerateSetsEndAndSayWhatTheyAre) {
  const PointSet three{2, {0, 0, 1, 0, 0, 1}};
  const MatchResult few = match_points(three, three);
  EXPECT_EQ(few.verdict, MatchVerdict::TooFewPoints);

  PointSet straight;  // on a line, unevenly: its order along the line is what can be found
  for (int k = 0; k < 40; ++k) {
    const double t = k + 0.4 * std::sin(1.7 * k);
    straight.coordinates.insert(straight.coordinates.end(), {t, 2 * t});
  }
  const MatchResult line = match_points(straight, straight);
  EXPECT_LT(mean_miss(line.warped, straight), 0.05);

  BentPoints doubled = bent({.seed = 11});
  const size_t n = doubled.from.size();
  for (size_t k = 0; k < 20; ++k) doubled.from.coordinates.push_back(doubled.from.coordinates[k]);
  const MatchResult result = match_points(doubled.from, doubled.to);
  ASSERT_EQ(result.partners.size(), n + 10);
  for (const double v : result.warped.coordinates) EXPECT_TRUE(std::isfinite(v));
  EXPECT_TRUE(result.reliable());
}

TEST(Matching, AThousandPoints) {
  BentPoints points;
  std::mt19937 random(12);
  for (int k = 0; k < 1000; ++k) {
    const double x = static_cast<double>(random()) / 4294967296.0,
                 y = static_cast<double>(random()) / 4294967296.0;
    points.from.coordinates.insert(points.from.coordinates.end(), {x, y});
    const double bend = 0.04 * std::exp(-8 * (std::pow(x - 0.4, 2) + std::pow(y - 0.5, 2)));
    points.truth.coordinates.insert(points.truth.coordinates.end(), {x + bend, y - 0.7 * bend});
  }
  points.to = points.truth;
  std::reverse(points.to.coordinates.begin(), points.to.coordinates.end());
  for (size_t i = 0; i < points.to.size(); ++i)
    std::swap(points.to.coordinates[2 * i], points.to.coordinates[2 * i + 1]);
  const MatchResult result = match_points(points.from, points.to);
  EXPECT_TRUE(result.reliable());
  EXPECT_LT(mean_miss(result.warped, points.truth), 0.001);
}

// A ring fits itself after many turns: where noise leaves no way to tell them apart, none is called right.
TEST(Matching, WhatTurnsIntoItselfIsAmbiguous) {
  PointSet from, to;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.05);
  for (int k = 0; k < 30; ++k) {
    const double angle = 2 * M_PI * k / 30;
    from.coordinates.insert(from.coordinates.end(), {std::cos(angle), std::sin(angle)});
    to.coordinates.insert(to.coordinates.end(),
                          {std::cos(angle) + noise(random), std::sin(angle) + noise(random)});
  }
  const MatchResult result = match_points(from, to);
  EXPECT_EQ(result.verdict, MatchVerdict::Ambiguous) << to_string(result.verdict);
  EXPECT_LT(result.posterior, 0.9);
  for (const Partner& partner : result.partners) EXPECT_FALSE(partner.target);
  // Who knows that it has not turned says so.
  EXPECT_TRUE(match_points(from, to, {.most_turn_deg = 10}).reliable());
}

// An exact fit is no answer where the template fits itself as exactly after a turn.
TEST(Matching, AnExactlySymmetricTemplateIsAmbiguousAlsoWithoutNoise) {
  PointSet star;
  for (int k = 0; k < 30; ++k) {
    const double angle = 2 * M_PI * k / 30, r = 1 + 0.3 * std::cos(3 * angle);
    star.coordinates.insert(star.coordinates.end(), {r * std::cos(angle), r * std::sin(angle)});
  }
  EXPECT_EQ(match_points(star, star).verdict, MatchVerdict::Ambiguous);
  EXPECT_TRUE(match_points(star, star, {.most_turn_deg = 10}).reliable());
}

TEST(Matching, AMirrorImageIsFoundWhereAskedFor) {
  BentPoints points = bent({.bend = 0.02, .seed = 21});
  for (PointSet* set : {&points.to, &points.truth})
    for (size_t i = 0; i < set->size(); ++i) set->coordinates[2 * i] *= -1;
  const MatchResult result = match_points(points.from, points.to, {.reflections = true});
  EXPECT_TRUE(result.reliable()) << to_string(result.verdict);
  EXPECT_LT(mean_miss(result.warped, points.truth), 0.002);
}

// Two strangers a point and a turn; a third missing as well: right, or not called reliable.
TEST(Matching, HardScenesAreRightOrNotReliable) {
  for (const BentScene& scene : {BentScene{.bend = 0.03, .outlier_ratio = 2, .turn_deg = 135},
                                 BentScene{.bend = 0.03, .outlier_ratio = 2, .turn_deg = 180},
                                 BentScene{.bend = 0.03, .missing_fraction = 0.33, .turn_deg = 135}}) {
    int right = 0;
    for (uint32_t seed = 1; seed <= 8; ++seed) {
      BentScene one = scene;
      one.seed = seed;
      const BentPoints points = bent(one);
      const MatchResult result = match_points(points.from, points.to);
      const double miss = mean_miss(result.warped, points.truth);
      EXPECT_TRUE(miss <= 0.05 || !result.reliable()) << seed << ": " << miss << " off and called reliable";
      right += miss <= 0.05 && result.reliable();
    }
    std::printf("%.0f strangers a point, %.2f missing, turned by %.0f deg: %d of 8 right\n",
                scene.outlier_ratio, scene.missing_fraction, scene.turn_deg, right);
    EXPECT_GE(right, 4);
  }
}

TEST(Matching, NonsenseIsRefused) {
  const PointSet good = character(2);
  PointSet nan = good;
  nan.coordinates[7] = std::numeric_limits<double>::quiet_NaN();
  const PointSet bad = nan, two{2, {0, 0, 1, 1}}, space = character(3), same{2, {1, 1, 1, 1, 1, 1}},
                 none{2, {}};
  for (const PointSet* other : {&bad, &two, &space, &same, &none}) {
    EXPECT_THROW(match_points(good, *other), Error);
    EXPECT_THROW(match_points(*other, good), Error);
  }
}

}  // namespace
}  // namespace palpate
