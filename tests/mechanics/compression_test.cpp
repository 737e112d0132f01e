// Two compressions compared: the strain of shapes that grew by a known amount, within its own errors.
#include "engine/measure/compression.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>

namespace palpate {
namespace {

using Depth = std::function<double(double, double)>;  // mm, of a place in mm

/// Control points of a shape that lies in a frame of 40 x 30 mm, pitch 0.05 mm.
/// `area_mm2`: the touched area is added to it.
std::vector<ShapePoint> seen(const Depth& depth, uint64_t seed, uint32_t count = 300,
                             double* area_mm2 = nullptr) {
  ControlOptions options;
  options.count = count;
  options.seed = seed;
  options.pitch_mm_per_px = 0.05;
  const CandidateGrid grid = control_candidates({0, 0, 800, 600}, options);
  std::vector<float> depths;
  for (const auto& [x, y] : grid.places) depths.push_back(static_cast<float>(depth(0.05 * x, 0.05 * y)));
  const ControlPoints chosen = choose_control_points(grid, depths, {}, options);
  if (area_mm2) *area_mm2 += chosen.contact_mm2;
  return shape_points(chosen, options.pitch_mm_per_px);
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

// An interval that is stated holds the truth as often as it says, with an error of the surface that all draws
// share, and the estimate that is farthest off is not the one that claims to be the best.
TEST(Compression, ErrorsOfDrawsHold) {
  struct Grown {
    double radius, to, wide;
  };
  constexpr int kSets = 5, kDrawn = 8;
  int inside = 0, sets = 0;
  double sum = 0, farthest = 0, its_sd = 0, mean_sd = 0;
  for (const Grown& g : {Grown{5, 5.25, 1}, Grown{4, 4.5, 1}, Grown{4, 4.4, 1.4}})
    for (int set = 0; set < kSets; ++set) {
      std::mt19937_64 random(static_cast<uint64_t>(100 * sets + 7));
      const auto even = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
      std::array<std::vector<std::vector<ShapePoint>>, 2> draws;
      std::array<double, 2> area{};
      for (size_t i = 0; i < 2; ++i) {
        std::array<std::array<double, 4>, 20> waves;
        for (auto& w : waves)
          w = {0.0018 * (even() - 0.5), 4 * (even() - 0.5), 4 * (even() - 0.5), 6.3 * even()};
        const double radius = i == 0 ? g.radius : g.to;
        const auto shape = [&](double x, double y) {
          const double u = (x - 20) / g.wide, v = y - 15;
          double depth = 0.5 * (1 - (u * u + v * v) / (radius * radius));
          for (const auto& [height, a, b, phase] : waves) depth += height * std::sin(a * x + b * y + phase);
          return depth;
        };
        for (int d = 0; d < kDrawn; ++d)
          draws[i].push_back(seen(shape, static_cast<uint64_t>(1000 * sets + 2 * d) + i, 60, &area[i]));
      }
      const Compression found = compare_draws(draws[0], draws[1], {{}, 0.5, area[1] / area[0] - 1});
      ASSERT_EQ(found.reason, "");
      const double truth = g.to * g.to / (g.radius * g.radius) - 1, sd = found.plane.sd.area;
      const double off = std::abs(found.plane.mean.area - truth);
      ++sets;
      inside += off < 1.96 * sd;
      sum += off * off / (sd * sd);
      mean_sd += sd / (3 * kSets);
      if (off > farthest) farthest = off, its_sd = sd;
    }
  std::printf("%d of %d inside 1.96 standard errors, RMS %.2f of them\n", inside, sets,
              std::sqrt(sum / sets));
  EXPECT_GE(inside, sets - 2);
  EXPECT_LT(std::sqrt(sum / sets), 1.3);
  EXPECT_GT(std::sqrt(sum / sets), 0.4);  // nor are they wide enough for anything
  EXPECT_GT(its_sd, 0.7 * mean_sd);
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
