// Two compressions compared: the strain of shapes that grew by a known amount, within its own errors.
#include "engine/measure/compression.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace palpate {
namespace {

using Depth = std::function<double(double, double)>;  // mm, of a place in mm

/// Control points of a shape that lies in a frame of 40 x 30 mm, pitch 0.05 mm.
std::vector<ShapePoint> seen(const Depth& depth, uint64_t seed, uint32_t count = 300) {
  ControlOptions options;
  options.count = count;
  options.seed = seed;
  options.pitch_mm_per_px = 0.05;
  const CandidateGrid grid = control_candidates({0, 0, 800, 600}, options);
  std::vector<float> depths;
  for (const auto& [x, y] : grid.places) depths.push_back(static_cast<float>(depth(0.05 * x, 0.05 * y)));
  return shape_points(choose_control_points(grid, depths, {}, options), options.pitch_mm_per_px);
}

/// A face of 12 x 8 mm with soft edges, pressed in by 0.4 mm.
double face(double x, double y) {
  const double u = std::max(std::abs(x) - 6, 0.0), v = std::max(std::abs(y) - 4, 0.0);
  return 0.4 * std::exp(-(u * u + v * v));
}

TEST(Compression, AFaceThatGrows) {
  const auto first = seen([](double x, double y) { return face(x - 20, y - 15); }, 1);
  const auto second =
      seen([](double x, double y) { return face((x - 20) / 1.06, (y - 15) / 1.03) * 1.1; }, 2);
  const Compression found = compare_compressions(first, second);
  ASSERT_EQ(found.reason, "");
  EXPECT_GT(found.pairs.size(), 200u);
  const PlaneStrain &e = found.plane.mean, &sd = found.plane.sd;
  EXPECT_NEAR(e.xx, 0.0618, 4 * sd.xx);
  EXPECT_NEAR(e.yy, 0.03045, 4 * sd.yy);
  EXPECT_NEAR(e.xy, 0, 4 * sd.xy);
  EXPECT_LT(sd.xx, 0.01);
  EXPECT_NEAR(found.axial, axial_strain_by_area(1.06 * 1.03 - 1), 4 * found.axial_sd);
  EXPECT_NEAR(found.deepening_mm, 0.037, 0.01);
}

TEST(Compression, MovedAndTurnedIsNotStrained) {
  const auto first = seen([](double x, double y) { return face(x - 20, y - 15); }, 1);
  const double turn = 10 * std::numbers::pi / 180, c = std::cos(turn), s = std::sin(turn);
  const auto second = seen(
      [&](double x, double y) {
        const double u = x - 21, v = y - 14;
        return face(c * u + s * v, c * v - s * u);
      },
      2);
  const Compression found = compare_compressions(first, second);
  ASSERT_EQ(found.reason, "");
  EXPECT_NEAR(found.plane.mean.xx, 0, 4 * found.plane.sd.xx);
  EXPECT_NEAR(found.plane.mean.yy, 0, 4 * found.plane.sd.yy);
  EXPECT_NEAR(found.plane.mean.area, 0, 4 * found.plane.sd.area);
}

// A round contact fits itself after any turn; its points stay where they are all the same.
TEST(Compression, RoundShapesDoNotTurn) {
  const auto ball = [](double radius) {
    return [radius](double x, double y) {
      return 0.5 * (1 - ((x - 20) * (x - 20) + (y - 15) * (y - 15)) / (radius * radius));
    };
  };
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    const Compression found = compare_compressions(seen(ball(5), seed, 200), seen(ball(5.5), seed + 10, 200));
    ASSERT_EQ(found.reason, "");
    double furthest = 0;
    for (const MatchedPoint& p : found.pairs)
      furthest = std::max(furthest, std::hypot(p.after.x_mm - p.before.x_mm, p.after.y_mm - p.before.y_mm));
    EXPECT_LT(furthest, 3.0);
    EXPECT_NEAR(found.plane.mean.area, 0.21, 4 * found.plane.sd.area);
  }
}

// Several draws tell how far one draw's pairs lead astray: a round contact grows alike in all directions.
TEST(Compression, DrawsTellTheError) {
  const auto grown = [](double radius) {
    return [radius](double x, double y) {
      return 0.5 * (1 - ((x - 20) * (x - 20) + (y - 15) * (y - 15)) / (radius * radius));
    };
  };
  std::vector<std::vector<ShapePoint>> before, after;
  for (uint64_t seed = 0; seed < 8; ++seed) {
    before.push_back(seen(grown(5), 2 * seed, 200));
    after.push_back(seen(grown(5.25), 2 * seed + 1, 200));
  }
  const Compression found = compare_draws(before, after);
  ASSERT_EQ(found.reason, "");
  const PlaneStrain &e = found.plane.mean, &sd = found.plane.sd;
  EXPECT_NEAR(e.xx, 0.05125, 4 * sd.xx);
  EXPECT_NEAR(e.yy, 0.05125, 4 * sd.yy);
  EXPECT_NEAR(e.xy, 0, 4 * sd.xy);
  EXPECT_NEAR(e.area, 0.1025, 4 * sd.area);
  EXPECT_LT(sd.area, 0.015);
  EXPECT_GT(sd.xx, 0.001);
  EXPECT_GT(found.pairs.size(), 1200u);
  // The map through all draws' pairs has it on the mean; turned pairs would shrink it.
  double area = 0;
  for (const MatchedPoint& p : found.pairs) {
    const std::array<double, 2> place[] = {{p.before.x_mm, p.before.y_mm}};
    area += found.field->at(place)[0].area / static_cast<double>(found.pairs.size());
  }
  EXPECT_NEAR(area, 0.1025, 0.015);

  before.resize(1);
  after.resize(1);
  EXPECT_NE(compare_draws(before, after).reason, "");
}

// Partners that are known, with noise: the mean's standard error covers the truth as often as it says.
TEST(Compression, KnownPairsWithinTheirErrors) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.01);
  int within = 0;
  constexpr int kTrials = 100;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<MatchedPoint> pairs;
    for (int i = 0; i < 100; ++i) {
      const double x = 1.0 * (i % 10), y = 1.0 * (i / 10);
      pairs.push_back({{x, y, 0.1}, {1.02 * x + 0.01 * y + noise(random), 0.98 * y + noise(random), 0.2}, 1});
    }
    const Compression found = strain_of_pairs(std::move(pairs));
    ASSERT_EQ(found.reason, "");
    within += std::abs(found.plane.mean.xx - 0.0202) < 1.96 * found.plane.sd.xx ? 1 : 0;
    EXPECT_NEAR(found.deepening_mm, 0.1, 1e-12);
  }
  EXPECT_GE(within, 85);
}

TEST(Compression, SaysWhyThereIsNone) {
  const auto shape = seen([](double x, double y) { return face(x - 20, y - 15); }, 1);
  EXPECT_NE(compare_compressions(shape, {}).reason.find("second compression has 0"), std::string::npos);
  std::vector<MatchedPoint> line;
  for (int i = 0; i < 20; ++i) line.push_back({{1.0 * i, 2.0 * i, 0}, {1.1 * i, 2.1 * i, 0}, 1});
  EXPECT_NE(strain_of_pairs(line).reason.find("on a line"), std::string::npos);
  line.resize(5);
  EXPECT_NE(strain_of_pairs(line).reason.find("5 points"), std::string::npos);
}

}  // namespace
}  // namespace palpate
