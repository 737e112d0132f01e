// The capacitance matrix: a solver of the whole grid, with sources on the edge of what is known, gives what
// the weighted least squares of the known part alone give.
#include "engine/numeric/capacitance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "engine/numeric/islands.h"
#include "engine/numeric/poisson_dct.h"
#include "engine/numeric/weighted_poisson.h"

namespace palpate {
namespace {

struct Mask {
  const char* name;
  std::function<bool(double x, double y)> known;
};

// Flow through the missing faces of the edge cells.
std::vector<double> missing_flow(const Capacitance& c, const std::vector<double>& z, uint32_t width) {
  std::vector<double> m;
  for (const EdgeCell& cell : c.cells) {
    const size_t i = size_t{cell.y} * width + cell.x;
    double flow = 0;
    if (cell.left > 0) flow += double{cell.left} * (z[i] - z[i - 1]);
    if (cell.right > 0) flow += double{cell.right} * (z[i] - z[i + 1]);
    if (cell.up > 0) flow += double{cell.up} * (z[i] - z[i - width]);
    if (cell.down > 0) flow += double{cell.down} * (z[i] - z[i + width]);
    m.push_back(flow);
  }
  return m;
}

TEST(Capacitance, OneCorrectionSolvesTheKnownPart) {
  constexpr uint32_t kWidth = 64, kHeight = 48;
  std::mt19937 random(5);
  std::normal_distribution<float> normal(0, 1);
  std::vector<float> gradients(2 * kWidth * kHeight);
  for (float& g : gradients) g = normal(random);
  const std::vector<Mask> masks{
      {"round pad", [](double x, double y) { return std::hypot(x - 31.5, y - 23.5) < 22; }},
      {"speck", [](double x, double y) { return std::hypot(x - 20, y - 30) > 3; }},
      {"specks at the border", [](double x, double y) { return x > 1 || y > 5; }},
      {"half", [](double x, double) { return x < 40; }},
      {"two islands, apart by one column", [](double x, double) { return x != 30; }},
      {"ring and disc", [](double x, double y) {
         const double r = std::hypot(x - 31.5, y - 23.5);
         return r < 8 || (r > 11 && r < 21);
       }}};
  for (const Mask& mask : masks) {
    std::vector<uint8_t> known;
    std::vector<float> weights;
    for (uint32_t y = 0; y < kHeight; ++y)
      for (uint32_t x = 0; x < kWidth; ++x) {
        known.push_back(mask.known(x, y) ? 1 : 0);
        weights.push_back(known.back());
      }
    const WeightedFaces faces = weighted_faces(gradients, weights, kWidth, kHeight);
    const std::vector<double> exact = solve_weighted(faces).z;
    const std::optional<Capacitance> c = capacitance(faces_of_known(known, kWidth, kHeight, 1));
    ASSERT_TRUE(c.has_value());
    std::vector<double> right = right_side(faces), z(right.size());
    PoissonDct whole(kWidth, kHeight);
    whole.solve(right.data(), z.data(), kWidth);
    const std::vector<double> r = missing_flow(*c, z, kWidth);
    for (size_t i = 0; i < r.size(); ++i)
      for (size_t j = 0; j < r.size(); ++j)
        right[size_t{c->cells[i].y} * kWidth + c->cells[i].x] += double{c->sources[i * r.size() + j]} * r[j];
    whole.solve(right.data(), z.data(), kWidth);
    // Islands each by themselves.
    std::vector<uint32_t> label;
    const Islands islands = find_islands(known, kWidth, kHeight, {}, &label);
    std::vector<double> offset(islands.count + 1), count(islands.count + 1);
    for (size_t i = 0; i < z.size(); ++i) {
      offset[label[i]] += z[i] - exact[i];
      count[label[i]] += 1;
    }
    double worst = 0, largest = 0;
    for (size_t i = 0; i < z.size(); ++i) {
      if (label[i] == 0) continue;
      worst = std::max(worst, std::abs(z[i] - exact[i] - offset[label[i]] / count[label[i]]));
      largest = std::max(largest, std::abs(exact[i]));
    }
    std::printf("%-34s %4zu edge cells, %u islands: worst %.1e of %.2f\n", mask.name, r.size(), islands.count,
                worst, largest);
    EXPECT_LT(worst, 2e-5 * largest) << mask.name;
  }
}

TEST(Capacitance, NothingMissingNeedsNothingAndTooMuchIsRefused) {
  const std::vector<uint8_t> all(200 * 200, 1);
  EXPECT_TRUE(capacitance(faces_of_known(all, 200, 200, 2))->cells.empty());
  std::vector<uint8_t> chequered(200 * 200);
  for (size_t i = 0; i < chequered.size(); ++i) chequered[i] = i % 3 != 0;
  EXPECT_FALSE(capacitance(faces_of_known(chequered, 200, 200, 1)).has_value());
}

// Cells of 2 x 2 px: where all is known the weights are those of the plain equations, 1, and at an odd
// frame's end those of a narrower cell.
TEST(Capacitance, FacesOfCells) {
  const std::vector<uint8_t> all(7 * 6, 1);
  const CellFaces f = faces_of_known(all, 7, 6, 2);
  ASSERT_EQ(f.width, 4u);
  ASSERT_EQ(f.height, 3u);
  EXPECT_FLOAT_EQ(f.across[0], 1);
  EXPECT_FLOAT_EQ(f.across[2], 4.0f / 3);
  EXPECT_FLOAT_EQ(f.across[3], 0);
  EXPECT_FLOAT_EQ(f.down[0], 1);
  EXPECT_FLOAT_EQ(f.down[3], 0.5f);
  EXPECT_FLOAT_EQ(f.down[8], 0);
  EXPECT_EQ(f.across, f.whole_across);
}

}  // namespace
}  // namespace palpate
