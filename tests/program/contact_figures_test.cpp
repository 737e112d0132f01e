// The figures and the worked example of `palpate contact`: what they show is what the contact's physics says.
#include "viz/report/contact_figures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/elasticity/hertz.h"

namespace palpate {
namespace {

TEST(ContactFigures, PaperExampleIsMended) {
  const PaperExample e = paper_example();
  EXPECT_NEAR(e.paper_modulus_MPa, 0.0242684, 5e-8);
  EXPECT_NEAR(e.weighted_modulus_MPa, 3 * e.paper_modulus_MPa, 1e-7);
  EXPECT_NEAR(e.cases[0].contact_mm, 6.7580, 5e-5);
  EXPECT_NEAR(e.cases[0].pressure_max_MPa, 0.020909, 5e-7);
  EXPECT_EQ(e.cases[0].warnings.size(), 2u);
  EXPECT_GT(e.cases[1].contact_mm, 2.5);
  EXPECT_NEAR(e.cases[2].contact_mm, 1.45597, 5e-6);
  EXPECT_TRUE(e.cases[2].warnings.empty());
  // Error of Hertz, by Sneddon's sphere solved here by bisection.
  for (const PaperExample::Case& c : e.cases) {
    double low = 0, high = c.radius_mm * (1 - 1e-15);
    for (int i = 0; i < 200; ++i) {
      const double a = (low + high) / 2;
      (a * std::atanh(a / c.radius_mm) < c.depth_mm ? low : high) = a;
    }
    const double l = 2 * std::atanh(low / c.radius_mm), r2 = c.radius_mm * c.radius_mm;
    const double force = c.modulus_MPa * ((low * low + r2) / 2 * l - low * c.radius_mm);
    EXPECT_NEAR(1 + c.force_error, c.force_N / force, 1e-6);
  }
  EXPECT_GT(e.cases[0].force_error, 0.1);
  EXPECT_LT(e.cases[2].force_error, 0.02);
}

TEST(ContactFigures, FiguresSayWhatTheyShow) {
  const Figure f7 = figure7(), f8 = figure8();
  // Fig. 7: half of each column's weighted sum is the force; the peak goes with the cube root of the force.
  const auto& r = f7.columns[0];
  for (size_t c = 1; c <= 3; ++c) {
    double force = 0, peak = 0;
    for (size_t i = 0; i < r.size(); ++i) {
      force += f7.columns[c][i] * std::numbers::pi * std::abs(r[i]) * 0.03;
      peak = std::max(peak, f7.columns[c][i]);
    }
    EXPECT_NEAR(force, 0.5 * static_cast<double>(c), 0.002);
    EXPECT_NEAR(peak, hertz_contact(0.5 * static_cast<double>(c), 0.0242684, 1).pressure_max_MPa, 1e-6);
  }
  // Fig. 8: sums fall with the radius, rise with the modulus and converge; over the area they are the force.
  const size_t last = f8.columns[0].size() - 1;
  for (size_t c = 2; c <= 5; ++c) EXPECT_LT(f8.columns[c][last], f8.columns[c - 1][last]);
  for (size_t c = 7; c <= 10; ++c) EXPECT_GT(f8.columns[c][last], f8.columns[c - 1][last]);
  EXPECT_NEAR(f8.columns[10][last] / f8.columns[9][last], 1, 0.01);
  for (size_t i = 0; i <= last; ++i) {
    EXPECT_NEAR(f8.columns[11][i] / f8.columns[0][i], 1, 5e-3);
    EXPECT_NEAR(f8.columns[12][i] / f8.columns[0][i], 1, 5e-3);
  }
}

}  // namespace
}  // namespace palpate
