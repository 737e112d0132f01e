// Interpolation of maps between their nodes.
#include "engine/tissue/map_sampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

namespace palpate {
namespace {

PressureMap map_of(uint32_t width, uint32_t height, const std::function<double(double, double)>& value) {
  PressureMap map;
  map.width = width;
  map.height = height;
  map.pitch_mm = {1.25, 0.5};
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x)
      map.values.push_back(static_cast<float>(
          value((x - (width - 1) / 2.0) * map.pitch_mm[0], (y - (height - 1) / 2.0) * map.pitch_mm[1])));
  return map;
}

TEST(MapSampling, WeightsAreThePolynomialThroughTheirNodes) {
  for (const uint32_t nodes : {2u, 3u, 5u, 9u})
    for (double place = 0; place < nodes - 0.9; place += 0.13) {
      const MapTaps taps = map_taps(place, nodes);
      ASSERT_LE(taps.first + taps.count, nodes);
      for (uint32_t power = 0; power < taps.count; ++power) {
        double sum = 0;
        for (uint32_t k = 0; k < taps.count; ++k) sum += taps.weight[k] * std::pow(taps.first + k, power);
        EXPECT_NEAR(sum, std::pow(std::min(place, nodes - 1.0), power), 1e-9 * std::pow(nodes, power))
            << place << " of " << nodes << ", power " << power;
      }
    }
  EXPECT_EQ(map_taps(4.5, 9).count, 6u);
  EXPECT_EQ(map_taps(1.5, 9).count, 4u);
  EXPECT_EQ(map_taps(0.5, 9).count, 2u);
  EXPECT_EQ(map_taps(-3, 9).weight[0], 1);
  EXPECT_EQ(map_taps(30, 9).weight[1], 1);
}

TEST(MapSampling, ANarrowBumpKeepsItsHeightBetweenNodes) {
  const auto bump = [](double x, double y) {
    return 100 * std::exp(-0.5 * ((x - 0.625) * (x - 0.625) + y * y) / 4);
  };
  const PressureMap map = map_of(33, 33, bump);  // sigma 2 mm, its top halfway between nodes 1.25 mm apart
  EXPECT_NEAR(map_at(map, 0.625, 0), 100, 0.3);
  EXPECT_NEAR(map_at(map, 1.9, 0.6), bump(1.9, 0.6), 0.3);
}

TEST(MapSampling, NodesThatAreNotSeenAreNotMadeUp) {
  PressureMap map = map_of(9, 9, [](double x, double) { return x; });
  map.values[4 * 9 + 4] = std::nanf("");
  EXPECT_TRUE(std::isnan(map_at(map, 0.1, 0.1)));
  EXPECT_NEAR(map_at(map, 1.25, 0.5), 1.25, 1e-6);  // on a node: no other counts
}

TEST(MapSampling, RowsSayWhatSinglePlacesSay) {
  PressureMap map = map_of(9, 7, [](double x, double y) { return std::sin(x) + x * y + std::cos(3 * y); });
  map.values[4 * 9 + 4] = std::nanf("");
  std::vector<double> columns, row;
  for (double x = -6.3; x < 6.3; x += 0.21) columns.push_back(x);
  columns.push_back(map.pitch_mm[0]);  // on a node
  row.resize(columns.size());
  MapRows rows(map, columns);
  size_t unseen = 0;
  for (const double y : {-2.0, -1.5, -0.7, 0.1, 0.5, 1.3, 9.0}) {
    rows.read(y, row);
    for (size_t i = 0; i < row.size(); ++i) {
      const double wanted = map_at(map, columns[i], y);
      ASSERT_EQ(std::isnan(row[i]), std::isnan(wanted)) << columns[i] << ", " << y;
      unseen += std::isnan(wanted);
      if (std::isnan(wanted)) continue;
      EXPECT_NEAR(row[i], wanted, 1e-12) << columns[i] << ", " << y;
    }
  }
  EXPECT_GT(unseen, 10u);
}

}  // namespace
}  // namespace palpate
