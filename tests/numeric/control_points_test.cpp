// Control points: on the contact and its rim, evenly spread over the shape, the same for the same seed.
#include "engine/numeric/control_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "palpate/error.h"

namespace palpate {
namespace {

constexpr PixelRect kBox = {100, 50, 400, 300};

/// A ball's dent: a paraboloid of this radius and depth in the middle of the box, pitch 0.05 mm.
double dent_mm(double x_px, double y_px, double radius_px, double deepest_mm) {
  const double r = std::hypot(x_px - 299.5, y_px - 199.5) / radius_px;
  return deepest_mm * (1 - r * r);
}

ControlOptions options_for(uint32_t count, uint64_t seed = 1) {
  ControlOptions options;
  options.count = count;
  options.seed = seed;
  options.pitch_mm_per_px = 0.05;
  return options;
}

ControlPoints choose(const ControlOptions& options, double radius_px, double deepest_mm,
                     std::span<const ControlPoint> features = {}) {
  const CandidateGrid grid = control_candidates(kBox, options);
  std::vector<float> depths;
  for (const auto& [x, y] : grid.places)
    depths.push_back(static_cast<float>(dent_mm(x, y, radius_px, deepest_mm)));
  return choose_control_points(grid, depths, features, options);
}

double nearest_mm(const ControlPoints& found, size_t i) {
  double nearest = HUGE_VAL;
  for (size_t j = 0; j < found.points.size(); ++j) {
    const ControlPoint &a = found.points[i], &b = found.points[j];
    if (i != j)
      nearest = std::min(
          nearest, std::hypot((a.x_px - b.x_px) * 0.05, (a.y_px - b.y_px) * 0.05, a.depth_mm - b.depth_mm));
  }
  return nearest;
}

TEST(ControlPoints, AsManyAsAskedForEvenlyApart) {
  for (const uint32_t count : {50u, 200u, 700u, 2000u})
    for (const double deepest : {0.3, 5.0}) {
      SCOPED_TRACE(testing::Message() << count << " points, " << deepest << " mm deep");
      const ControlPoints found = choose(options_for(count), 120, deepest);
      ASSERT_EQ(found.points.size(), count);
      double sum = 0, least = HUGE_VAL;
      for (size_t i = 0; i < count; ++i) {
        const double d = nearest_mm(found, i);
        sum += d;
        least = std::min(least, d);
      }
      EXPECT_NEAR(found.spacing_mm, sum / count, 1e-9);
      EXPECT_NEAR(found.least_spacing_mm, least, 1e-9);
      // No point is close to another (of random ones the closest is a hundredth of the mean apart), and
      // their mean distance is most of what hexagons over the dent would have.
      EXPECT_GT(least, (deepest < 1 ? 0.6 : 0.45) * found.spacing_mm);
      const double a = 120 * 0.05, k = 4 * deepest * deepest / (a * a);
      const double area = 2 * std::numbers::pi * a * a / (3 * k) * (std::pow(1 + k, 1.5) - 1);
      EXPECT_GT(found.spacing_mm, 0.7 * std::sqrt(2 / std::numbers::sqrt3 * area / count));
    }
}

TEST(ControlPoints, OnTheContactAndItsRim) {
  const ControlPoints found = choose(options_for(300), 100, 1);
  const double rim_px = 100 * std::sqrt(1 - 0.02);
  size_t rim = 0;
  for (const ControlPoint& p : found.points) {
    const double r = std::hypot(p.x_px - 299.5, p.y_px - 199.5);
    if (p.kind == ControlKind::Rim) {
      ++rim;
      EXPECT_NEAR(r, rim_px, 0.2);
      EXPECT_DOUBLE_EQ(p.depth_mm, 0.02);
    } else {
      EXPECT_LT(r, rim_px);
      EXPECT_NEAR(p.depth_mm, dent_mm(p.x_px, p.y_px, 100, 1), 1e-5);
    }
  }
  EXPECT_NEAR(found.rim_mm, 2 * std::numbers::pi * rim_px * 0.05, 0.03 * found.rim_mm);
  EXPECT_NEAR(found.contact_mm2, std::numbers::pi * rim_px * rim_px * 0.0025, 0.02 * found.contact_mm2);
  // As dense along the rim as within.
  EXPECT_NEAR(found.rim_mm / static_cast<double>(rim), found.spacing_mm, 0.3 * found.spacing_mm);
}

TEST(ControlPoints, TheSameForTheSameSeed) {
  const ControlPoints first = choose(options_for(200, 7), 100, 1),
                      again = choose(options_for(200, 7), 100, 1),
                      other = choose(options_for(200, 8), 100, 1);
  size_t moved = 0;
  for (size_t i = 0; i < 200; ++i) {
    EXPECT_EQ(first.points[i].x_px, again.points[i].x_px);
    EXPECT_EQ(first.points[i].y_px, again.points[i].y_px);
    moved += first.points[i].x_px != other.points[i].x_px ? 1 : 0;
  }
  EXPECT_GT(moved, 190u);
}

TEST(ControlPoints, NeighboursAreTheNearestBothWays) {
  const ControlPoints found = choose(options_for(120), 100, 1);
  for (uint32_t i = 0; i < 120; ++i) {
    const std::vector<uint32_t>& near = found.neighbours[i];
    ASSERT_GE(near.size(), 6u);
    EXPECT_NEAR(nearest_mm(found, i),
                std::hypot((found.points[i].x_px - found.points[near[0]].x_px) * 0.05,
                           (found.points[i].y_px - found.points[near[0]].y_px) * 0.05,
                           found.points[i].depth_mm - found.points[near[0]].depth_mm),
                1e-12);
    for (const uint32_t j : near)
      EXPECT_NE(std::ranges::find(found.neighbours[j], i), found.neighbours[j].end());
  }
}

TEST(ControlPoints, FeaturesAreKeptWhereTheyAreTouched) {
  const std::vector<ControlPoint> features = {{299.5, 199.5, 1.0}, {310.25, 180, 0.9}, {110, 60, 0}};
  const ControlPoints found = choose(options_for(50), 100, 1, features);
  ASSERT_EQ(found.points.size(), 50u);
  EXPECT_EQ(found.points[0].x_px, 299.5);
  EXPECT_EQ(found.points[1].x_px, 310.25);
  EXPECT_EQ(found.points[1].kind, ControlKind::Feature);
  EXPECT_NE(found.points[2].kind, ControlKind::Feature);
}

TEST(ControlPoints, NoContactSmallContactAndHoles) {
  EXPECT_TRUE(choose(options_for(200), 1000, -1).points.empty());
  const ControlPoints small = choose(options_for(2000), 5, 1);
  EXPECT_GT(small.points.size(), 20u);
  EXPECT_LT(small.points.size(), 300u);
  EXPECT_TRUE(control_candidates({0, 0, 0, 10}, options_for(50)).places.empty());

  // Nothing is taken from where depths are not known, and a hole has no rim.
  const ControlOptions options = options_for(200);
  const CandidateGrid grid = control_candidates(kBox, options);
  std::vector<float> depths;
  for (const auto& [x, y] : grid.places)
    depths.push_back(x < 280 ? std::numeric_limits<float>::quiet_NaN()
                             : static_cast<float>(dent_mm(x, y, 100, 1)));
  const ControlPoints half = choose_control_points(grid, depths, {}, options);
  EXPECT_EQ(half.points.size(), 200u);
  for (const ControlPoint& p : half.points) {
    EXPECT_GE(p.x_px, 280);
    if (p.kind == ControlKind::Rim) {
      EXPECT_NEAR(p.depth_mm, 0.02, 1e-9);
    }
  }
}

TEST(ControlPoints, RefusesWhatMakesNoSense) {
  EXPECT_THROW(control_candidates(kBox, options_for(49)), Error);
  EXPECT_THROW(control_candidates(kBox, options_for(2001)), Error);
  ControlOptions options = options_for(100);
  options.pitch_mm_per_px = 0;
  EXPECT_THROW(control_candidates(kBox, options), Error);
  options = options_for(100);
  options.contact_mm = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(control_candidates(kBox, options), Error);
  options = options_for(100);
  const CandidateGrid grid = control_candidates(kBox, options);
  EXPECT_THROW(choose_control_points(grid, std::vector<float>(3), {}, options), Error);
}

}  // namespace
}  // namespace palpate
