// Matches that must not be called reliable: what slides along itself, and what is right in part only.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <vector>

#include "capture/synthetic/bent_points.h"
#include "engine/numeric/matching/curve.h"
#include "engine/numeric/matching/matching.h"

namespace palpate {
namespace {

using Point = std::array<double, 2>;

PointSet set_of(size_t count, const std::function<Point(size_t)>& place) {
  PointSet set;
  for (size_t i = 0; i < count; ++i) {
    const Point p = place(i);
    set.coordinates.insert(set.coordinates.end(), p.begin(), p.end());
  }
  return set;
}

PointSet spiral(size_t count, double flat) {
  return set_of(count, [&](size_t i) -> Point {
    const double t = 10 * static_cast<double>(i) / static_cast<double>(count) + 0.5, r = 0.08 * t + 0.05;
    return {r * std::cos(t), flat * r * std::sin(t) + 0.1 * r * r};
  });
}

double even(std::mt19937& random) {
  return (static_cast<double>(random()) + 0.5) / 4294967296.0;
}

PointSet bent_by_waves(const PointSet& set, double bend, std::mt19937& random) {
  const double k = 3 + 3 * even(random), a = 6 * even(random), b = 6 * even(random), p = 6 * even(random),
               q = 6 * even(random);
  return set_of(set.size(), [&](size_t i) -> Point {
    const double x = set.at(i)[0], y = set.at(i)[1];
    return {x + 1.5 * bend * std::sin(k * (x * std::cos(a) + y * std::sin(a)) + p),
            y + 1.5 * bend * std::sin(k * (x * std::cos(b) + y * std::sin(b)) + q)};
  });
}

void turn(PointSet& set, double angle) {
  for (size_t i = 0; i < set.size(); ++i) {
    double *x = &set.coordinates[2 * i], *y = x + 1;
    const double was = *x;
    *x = was * std::cos(angle) - *y * std::sin(angle);
    *y = was * std::sin(angle) + *y * std::cos(angle);
  }
}

double size_of(const PointSet& set) {
  double x = 0, y = 0, squares = 0;
  const auto n = static_cast<double>(set.size());
  for (size_t i = 0; i < set.size(); ++i) x += set.at(i)[0] / n, y += set.at(i)[1] / n;
  for (size_t i = 0; i < set.size(); ++i)
    squares += std::pow(set.at(i)[0] - x, 2) + std::pow(set.at(i)[1] - y, 2);
  return std::sqrt(squares / n);
}

// A spiral lies nearly on itself some points farther on: the answer is the right one, or none.
TEST(MatchingVerdict, WhatSlidesAlongItselfIsRightOrNotReliable) {
  int right = 0, trials = 0;
  for (uint32_t seed = 1; seed <= 12; ++seed) {
    std::mt19937 random(seed);
    const double flat = 0.6 + 0.4 * even(random);
    const PointSet from = spiral(30 + random() % 60, flat);
    PointSet truth = bent_by_waves(from, 0.04 + 0.08 * even(random), random);
    turn(truth, seed % 2 ? 6 * even(random) : 0);
    PointSet to = truth;
    for (size_t k = 0; k < from.size() * (seed % 3) / 4; ++k)  // strangers
      to.coordinates.insert(to.coordinates.end(), {1.8 * even(random) - 0.9, 1.8 * even(random) - 0.9});
    const MatchResult result = match_points(from, to);
    const double miss = mean_miss(result.warped, truth) / size_of(from);
    EXPECT_TRUE(miss < 0.125 || !result.reliable()) << seed << ": " << miss << " off and called reliable";
    right += miss < 0.05 && result.reliable();
    ++trials;
  }
  std::printf("spirals: %d of %d right and reliable\n", right, trials);
  EXPECT_GE(right, 4);
}

TEST(MatchingVerdict, ACurveIsFoundInAnyOrderAndWhereThereIsOne) {
  const PointSet points = spiral(60, 0.8);
  Eigen::MatrixXd mixed(60, 2);
  for (Eigen::Index i = 0; i < 60; ++i)
    for (Eigen::Index c = 0; c < 2; ++c)
      mixed(i, c) = points.coordinates[static_cast<size_t>(2 * (i * 37 % 60) + c)];
  const std::optional<Curve> curve = curve_through(mixed);
  ASSERT_TRUE(curve);
  ASSERT_EQ(curve->order.size(), 60u);
  EXPECT_FALSE(curve->closed);
  for (size_t k = 1; k < 60; ++k)
    EXPECT_EQ(std::abs(curve->order[k] * 37 % 60 - curve->order[k - 1] * 37 % 60), 1) << k;
  Eigen::MatrixXd ring(40, 2), scattered(80, 2);
  for (Eigen::Index i = 0; i < 40; ++i) {
    const double angle = 2 * M_PI * static_cast<double>(i) / 40;
    ring.row(i) << 2 * std::cos(angle), std::sin(angle);
  }
  std::mt19937 random(5);
  for (Eigen::Index i = 0; i < 80; ++i) scattered.row(i) << even(random), even(random);
  ASSERT_TRUE(curve_through(ring));
  EXPECT_TRUE(curve_through(ring)->closed);
  EXPECT_FALSE(curve_through(scattered));
  EXPECT_FALSE(curve_through(ring.topRows(5)));
}

/// Points over a square of 100, in a fixed order.
PointSet scattered_set(size_t count, uint32_t seed) {
  std::mt19937 random(seed);
  return set_of(count, [&](size_t) -> Point {
    const double x = 100 * even(random), y = 100 * even(random);
    return {x, y};
  });
}

// The left six tenths and the right four have changed places: no smooth warp does that.
TEST(MatchingVerdict, PartsThatChangedPlacesArePartlyWrong) {
  for (uint32_t seed = 1; seed <= 3; ++seed) {
    const PointSet from = scattered_set(90, seed);
    const PointSet to = set_of(from.size(), [&](size_t i) -> Point {
      const double x = from.at(i)[0];
      return {x < 60 ? x + 40 : x - 60, from.at(i)[1]};
    });
    const MatchResult result = match_points(from, to);
    EXPECT_EQ(result.verdict, MatchVerdict::PartlyWrong) << seed << ": " << to_string(result.verdict);
    for (const Partner& partner : result.partners) EXPECT_FALSE(partner.target);
  }
}

// Nor is it where the part is missing, or where the whole has bent or is noisy.
TEST(MatchingVerdict, WhatIsBentNoisyOrMissingIsNotPartlyWrong) {
  for (uint32_t seed = 1; seed <= 3; ++seed) {
    const PointSet from = scattered_set(90, seed);
    PointSet left;
    for (size_t i = 0; i < from.size(); ++i)
      if (from.at(i)[0] < 60)
        left.coordinates.insert(left.coordinates.end(), {from.at(i)[0] + 40, from.at(i)[1]});
    std::mt19937 random(seed + 70);
    std::normal_distribution<double> noise(0, 1);
    PointSet noisy = from;
    for (double& v : noisy.coordinates) v += noise(random);
    const PointSet bent = set_of(from.size(), [&](size_t i) -> Point {
      const double x = from.at(i)[0], y = from.at(i)[1];
      return {x + 4 * std::sin(y / 20), y + 4 * std::cos(x / 25)};
    });
    EXPECT_TRUE(match_points(from, left).reliable()) << seed;
    EXPECT_TRUE(match_points(from, noisy).reliable()) << seed;
    EXPECT_TRUE(match_points(from, bent).reliable()) << seed;
  }
}

}  // namespace
}  // namespace palpate
