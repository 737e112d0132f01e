// Thin-plate splines against the plain dense system, closed forms, and points of every awkward kind.
#include "engine/numeric/thin_plate/thin_plate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "palpate/error.h"
#include "tests/reference/thin_plate.h"

namespace palpate {
namespace {

template <size_t D>
using Places = std::vector<std::array<double, D>>;
constexpr PlateKernel kKernels[] = {PlateKernel::Log, PlateKernel::Linear, PlateKernel::Cubic};

template <size_t D>
Places<D> scattered(size_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> in(0, 1);
  Places<D> places(n);
  for (auto& p : places)
    for (double& x : p) x = in(random);
  return places;
}
template <size_t D>
double smooth(const std::array<double, D>& p) {
  return std::sin(3 * p[0] + p[1]) * std::exp(-p[D - 1]) + 0.5 * p[0] * p[1];
}
template <size_t D, typename Of>
std::vector<double> values_of(const Places<D>& places, const Of& of) {
  std::vector<double> v;
  for (const auto& p : places) v.push_back(of(p));
  return v;
}
template <size_t D>
double sum_weights(const ThinPlateSpline<D>& s,
                   size_t axis) {  // axis 0: of the weights; else of weight x coordinate
  double sum = 0, size = 0;
  for (size_t i = 0; i < s.terms().count; ++i) {
    const double x = axis == 0 ? 1 : s.terms().at[(axis - 1) * s.terms().count + i];
    sum += s.terms().weight[i] * x;
    size += std::abs(s.terms().weight[i]);
  }
  return size > 0 ? sum / size : 0;
}
double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}
std::vector<double> noisy(std::vector<double> values, double sd, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, sd);
  for (double& v : values) v += noise(random);
  return values;
}

template <size_t D>
void expect_equals_dense(PlateKernel kernel, double lambda, bool weighted) {
  SCOPED_TRACE(testing::Message() << D << "D, kernel " << int(kernel) << ", lambda " << lambda << ", weights "
                                  << weighted);
  const Places<D> points = scattered<D>(60, 3), at = scattered<D>(40, 4);
  const std::vector<double> values = noisy(values_of(points, smooth<D>), 0.01, 5);
  std::vector<double> weights;
  for (size_t i = 0; weighted && i < points.size(); ++i)
    weights.push_back(0.5 + 0.05 * static_cast<double>(i % 30));
  PlateOptions options;
  options.kernel = kernel;
  ThinPlate<D> plate(points, options, weights);
  const auto spline = plate.fit(values, 1, lambda);
  const reference::Plate<D> dense(kernel, points, values, lambda, weights);
  EXPECT_LT(largest_difference(spline.values(at), values_of(at, dense)), 1e-10);
  EXPECT_NEAR(spline.statistics().freedom, lambda > 0 ? dense.freedom() : 60, 1e-6);
  for (size_t axis = 0; axis <= D; ++axis) EXPECT_NEAR(sum_weights(spline, axis), 0, 1e-11);
}

TEST(ThinPlate, EqualsTheDenseSystem) {
  for (const PlateKernel kernel : kKernels)
    for (const double lambda : {0.0, 1e-6, 1e-2, 1.0, 100.0})
      for (const bool weighted : {false, true}) {
        expect_equals_dense<2>(kernel, lambda, weighted);
        expect_equals_dense<3>(kernel, lambda, weighted);
      }
}

template <size_t D>
void expect_affine(PlateKernel kernel, std::optional<double> lambda) {
  SCOPED_TRACE(testing::Message() << D << "D, kernel " << int(kernel) << ", lambda " << lambda.value_or(-1));
  const auto affine = [](const std::array<double, D>& p) {
    return 2 + 3 * p[0] - 0.7 * p[1] + 0.1 * p[D - 1];
  };
  const Places<D> points = scattered<D>(200, 7), at = scattered<D>(50, 8);
  PlateOptions options;
  options.kernel = kernel;
  const auto spline = ThinPlate<D>(points, options).fit(values_of(points, affine), 1, lambda);
  EXPECT_LT(largest_difference(spline.values(at), values_of(at, affine)), 1e-12);
  std::vector<double> first(at.size() * D);
  spline.evaluate(at, {}, first);
  for (size_t i = 0; i < at.size(); ++i) {
    EXPECT_NEAR(first[i * D], 3, 1e-11);
    EXPECT_NEAR(first[i * D + D - 1], D == 2 ? -0.6 : 0.1, 1e-11);
  }
}
TEST(ThinPlate, AnAffineFieldIsKept) {
  for (const PlateKernel kernel : kKernels)
    for (const std::optional<double> lambda : {std::optional<double>(), {0.0}, {1e-3}, {1.0}, {1e12}}) {
      expect_affine<2>(kernel, lambda);
      expect_affine<3>(kernel, lambda);
    }
}

TEST(ThinPlate, PassesThroughAllPointsAtZero) {
  for (const size_t n : {3, 4, 5, 10, 100, 500}) {
    const Places<2> points = scattered<2>(n, 11);
    const std::vector<double> values = values_of(points, smooth<2>);
    const auto spline = ThinPlate<2>(points).fit(values, 1, 0.0);
    EXPECT_LT(largest_difference(spline.values(points), values), 1e-10) << n;
    EXPECT_EQ(spline.statistics().freedom, static_cast<double>(n));
    EXPECT_TRUE(std::isnan(spline.statistics().residual_sd[0]));
    EXPECT_EQ(spline.statistics().rank, 2u);
  }
}

TEST(ThinPlate, DerivativesAreThoseOfTheField) {
  for (const PlateKernel kernel : kKernels) {
    SCOPED_TRACE(int(kernel));
    PlateOptions options;
    options.kernel = kernel;
    const Places<3> points = scattered<3>(80, 13);
    const auto spline = ThinPlate<3>(points, options).fit(values_of(points, smooth<3>), 1, 1e-3);
    const Places<3> at = scattered<3>(20, 14);
    std::vector<double> value(20), first(60), second(180), some(60);
    spline.evaluate(at, value, first, second);
    spline.evaluate(at, {}, some);
    EXPECT_EQ(first, some);
    constexpr double kStep = 1e-3;
    for (size_t i = 0; i < at.size(); ++i)
      for (size_t d = 0; d < 3; ++d) {
        // Fourth-order central differences.
        Places<3> near;
        for (const double k : {-2.0, -1.0, 1.0, 2.0}) {
          near.push_back(at[i]);
          near.back()[d] += k * kStep;
        }
        std::vector<double> v(4), g(12);
        spline.evaluate(near, v, g);
        EXPECT_NEAR(first[3 * i + d], (v[0] - 8 * v[1] + 8 * v[2] - v[3]) / (12 * kStep), 1e-6);
        for (size_t e = 0; e < 3; ++e)
          EXPECT_NEAR(second[9 * i + 3 * d + e],
                      (g[e] - 8 * g[3 + e] + 8 * g[6 + e] - g[9 + e]) / (12 * kStep), 1e-4);
      }
  }
}

TEST(ThinPlate, DerivativesAtThePointsSayWhatTheyAre) {
  const Places<2> points = scattered<2>(30, 15);
  const auto log = ThinPlate<2>(points).fit(values_of(points, smooth<2>), 1, 1e-3);
  std::vector<double> first(60), second(120), near(60);
  log.evaluate(points, {}, first, second);
  Places<2> beside = points;
  for (auto& p : beside) p[0] += 1e-9;
  log.evaluate(beside, {}, near);
  EXPECT_LT(largest_difference(first, near), 1e-6);  // continuous
  for (size_t i = 0; i < points.size(); ++i) {
    EXPECT_TRUE(std::isinf(second[4 * i]));
    EXPECT_TRUE(std::isinf(second[4 * i + 3]));
  }
  PlateOptions cubic;
  cubic.kernel = PlateKernel::Cubic;
  const auto smooth_one = ThinPlate<2>(points, cubic).fit(values_of(points, smooth<2>), 1, 1e-3);
  smooth_one.evaluate(points, {}, first, second);
  for (const double s : second) EXPECT_TRUE(std::isfinite(s));
}

TEST(ThinPlate, NeitherOriginNorScaleMatter) {
  const Places<2> points = scattered<2>(200, 17), at = scattered<2>(50, 18);
  const std::vector<double> values = noisy(values_of(points, smooth<2>), 0.01, 19);
  const auto plain = ThinPlate<2>(points).fit(values, 1);
  const std::vector<double> expected = plain.values(at);
  for (const double offset : {0.0, 1e4, 1e6})
    for (const double scale : {1e-3, 1.0, 1e3, 1e5}) {
      SCOPED_TRACE(testing::Message() << "offset " << offset << ", scale " << scale);
      Places<2> moved = points, moved_at = at;
      for (auto* set : {&moved, &moved_at})
        for (auto& p : *set)
          for (double& x : p) x = x * scale + offset;
      const auto spline = ThinPlate<2>(moved).fit(values, 1);
      const double rounding = 1e-14 * offset / scale;  // of the places themselves
      EXPECT_NEAR(spline.statistics().lambda, plain.statistics().lambda,
                  (1e-3 + rounding) * plain.statistics().lambda);
      EXPECT_LT(largest_difference(spline.values(moved_at), expected), 1e-7 + 10 * rounding);
      const double lambda = plain.statistics().lambda;
      EXPECT_LT(largest_difference(ThinPlate<2>(moved).fit(values, 1, lambda).values(moved_at),
                                   ThinPlate<2>(points).fit(values, 1, lambda).values(at)),
                1e-11 + 10 * rounding);
    }
}

TEST(ThinPlate, LambdaGoesFromAllPointsToAPlane) {
  const Places<2> points = scattered<2>(100, 21);
  const std::vector<double> values = noisy(values_of(points, smooth<2>), 0.05, 22);
  ThinPlate<2> plate(points);
  double before = 101;
  for (const double lambda : {0.0, 1e-9, 1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e8, 1e12}) {
    const auto spline = plate.fit(values, 1, lambda);
    EXPECT_LT(spline.statistics().freedom, before);
    EXPECT_GE(spline.statistics().freedom, 3 - 1e-9);
    EXPECT_FALSE(spline.statistics().lambda_raised);
    before = spline.statistics().freedom;
  }
  EXPECT_NEAR(before, 3, 1e-8);
  Eigen::MatrixXd a(100, 3);
  for (Eigen::Index i = 0; i < 100; ++i)
    a.row(i) << 1, points[static_cast<size_t>(i)][0], points[static_cast<size_t>(i)][1];
  const Eigen::Vector3d line =
      a.colPivHouseholderQr().solve(Eigen::Map<const Eigen::VectorXd>(values.data(), 100));
  const auto stiff = plate.fit(values, 1, 1e12);
  for (const auto& p : points)
    EXPECT_NEAR(stiff.values(std::span(&p, 1))[0], line[0] + line[1] * p[0] + line[2] * p[1], 1e-10);
}

TEST(ThinPlate, RepeatedPointsAreAveraged) {
  Places<2> points = scattered<2>(50, 23), twice = points;
  std::vector<double> values = noisy(values_of(points, smooth<2>), 0.02, 24), both = values, weights(50, 2.0);
  for (size_t i = 0; i < 50; ++i) {
    twice.push_back(points[i]);
    both[i] += 0.01;
    both.push_back(values[i] - 0.01);
  }
  for (const std::optional<double> lambda : {std::optional<double>(0.0), {1e-2}}) {
    const auto merged = ThinPlate<2>(twice).fit(both, 1, lambda);
    EXPECT_EQ(merged.statistics().merged, 50u);
    EXPECT_EQ(merged.statistics().points, 100u);
    // A point that stands for two has twice the weight, which halves lambda.
    const auto single = ThinPlate<2>(points).fit(values, 1, *lambda / 2);
    const Places<2> at = scattered<2>(20, 25);
    EXPECT_LT(largest_difference(merged.values(at), single.values(at)), 1e-10);
  }
  // The difference of pairs gives the noise, even through all means.
  EXPECT_NEAR(ThinPlate<2>(twice).fit(both, 1, 0.0).statistics().residual_sd[0], 0.01 * std::sqrt(2.0), 1e-9);
}

TEST(ThinPlate, AClosePairDoesNotBlowUp) {
  Places<2> points = scattered<2>(100, 27);
  std::vector<double> values = values_of(points, smooth<2>);
  points.push_back({points[40][0] + 1e-6, points[40][1]});
  values.push_back(values[40] + 1e-3);
  const Places<2> at = scattered<2>(500, 28);
  const std::vector<double> truth = values_of(at, smooth<2>);
  const double without = largest_difference(
      ThinPlate<2>(std::span(points).first(100)).fit(std::span(values).first(100), 1, 0.0).values(at), truth);
  const auto merged = ThinPlate<2>(points).fit(values, 1, 0.0);
  EXPECT_EQ(merged.statistics().merged, 1u);
  EXPECT_LT(largest_difference(merged.values(at), truth), without + 1e-3);
  PlateOptions keep;
  keep.merge_fraction = 0;
  EXPECT_GT(largest_difference(ThinPlate<2>(points, keep).fit(values, 1, 0.0).values(at), truth), 1);
  EXPECT_LT(largest_difference(ThinPlate<2>(points, keep).fit(values, 1).values(at), truth), 0.1);
}

TEST(ThinPlate, WhatIsNotDeterminedIsLeftOut) {
  const auto along = [](double t) { return std::sin(4 * t); };
  Places<2> line;
  Places<3> plane, line3;
  std::vector<double> on_line, on_plane;
  std::mt19937 random(29);
  std::uniform_real_distribution<double> in(0, 1);
  for (int i = 0; i < 60; ++i) {
    const double t = in(random), u = in(random);
    line.push_back({5 + 3 * t, 7 - 4 * t});
    line3.push_back({t, 2 * t, 1 - 2 * t});
    on_line.push_back(along(t));
    plane.push_back({t, u, 0.3 * t - 0.2 * u + 4});
    on_plane.push_back(smooth<2>({t, u}));
  }
  const auto two = ThinPlate<2>(line).fit(on_line, 1, 0.0);
  EXPECT_EQ(two.statistics().rank, 1u);
  EXPECT_LT(two.statistics().flatness, 1e-10);
  EXPECT_LT(largest_difference(two.values(line), on_line), 1e-9);
  const Places<2> off = {{5 + 1.5 + 0.8, 7 - 2 + 0.6}};  // one unit beside the middle
  std::vector<double> value(1), first(2);
  two.evaluate(off, value, first);
  EXPECT_NEAR(value[0], along(0.5), 0.01);
  EXPECT_NEAR(first[0] * 0.8 + first[1] * 0.6, 0, 1e-9);  // across the line
  EXPECT_NEAR(first[0] * 0.6 - first[1] * 0.8, 4 * std::cos(2.0) / 5, 0.05);
  for (const PlateKernel kernel : kKernels) {
    PlateOptions options;
    options.kernel = kernel;
    const auto flat = ThinPlate<3>(plane, options).fit(on_plane, 1, 0.0);
    EXPECT_EQ(flat.statistics().rank, 2u);
    EXPECT_LT(largest_difference(flat.values(plane), on_plane), 1e-8);
    const auto thin = ThinPlate<3>(line3, options).fit(on_line, 1, 0.0);
    EXPECT_EQ(thin.statistics().rank, 1u);
    EXPECT_LT(largest_difference(thin.values(line3), on_line), 1e-8);
  }
}

TEST(ThinPlate, FewPointsGiveWhatTheyCan) {
  const Places<3> points = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  const std::vector<double> values = {1, 2, 3, 4};
  for (size_t n = 1; n <= 4; ++n)
    for (const std::optional<double> lambda : {std::optional<double>(), {0.0}, {1.0}}) {
      const auto spline = ThinPlate<3>(std::span(points).first(n)).fit(std::span(values).first(n), 1, lambda);
      EXPECT_EQ(spline.statistics().rank, n - 1);
      for (size_t i = 0; i < n; ++i)
        EXPECT_NEAR(spline.values(std::span(&points[i], 1))[0], values[i], 1e-12);
    }
  const Places<2> same(7, {3.0, 4.0});
  const auto one = ThinPlate<2>(same).fit(std::vector<double>{1, 2, 3, 4, 5, 6, 7}, 1);
  EXPECT_EQ(one.statistics().rank, 0u);
  EXPECT_EQ(one.statistics().merged, 6u);
  EXPECT_NEAR(one.values(Places<2>{{9, 9}})[0], 4, 1e-12);
  EXPECT_NEAR(one.statistics().residual_sd[0], std::sqrt(28.0 / 6), 1e-12);
}

TEST(ThinPlate, TwoThousandPoints) {
  const Places<2> points = scattered<2>(2000, 31), at = scattered<2>(200, 32);
  const auto spline = ThinPlate<2>(points).fit(values_of(points, smooth<2>), 1, 0.0);
  EXPECT_LT(largest_difference(spline.values(points), values_of(points, smooth<2>)), 1e-8);
  EXPECT_LT(largest_difference(spline.values(at), values_of(at, smooth<2>)), 5e-3);
  EXPECT_FALSE(spline.statistics().lambda_raised);
  EXPECT_GT(spline.statistics().condition, 1e3);
}

TEST(ThinPlate, CrossValidationIsNearTheBest) {
  const Places<2> at = scattered<2>(400, 33);
  const std::vector<double> truth = values_of(at, smooth<2>);
  const auto off = [&](const ThinPlateSpline<2>& s) {
    const std::vector<double> v = s.values(at);
    double sum = 0;
    for (size_t i = 0; i < v.size(); ++i) sum += std::pow(v[i] - truth[i], 2);
    return std::sqrt(sum / static_cast<double>(v.size()));
  };
  std::vector<double> ratios, sds;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Places<2> points = scattered<2>(150, 100 + seed);
    const std::vector<double> values = noisy(values_of(points, smooth<2>), 0.02, 200 + seed);
    ThinPlate<2> plate(points);
    const auto chosen = plate.fit(values, 1);
    EXPECT_TRUE(chosen.statistics().lambda_by_data);
    double best = 1;
    for (double lambda = 1e-8; lambda < 1e4; lambda *= 2)
      best = std::min(best, off(plate.fit(values, 1, lambda)));
    ratios.push_back(off(chosen) / best);
    sds.push_back(chosen.statistics().residual_sd[0]);
  }
  std::sort(ratios.begin(), ratios.end());
  EXPECT_LT(ratios[10], 1.1);
  EXPECT_LT(ratios[18], 1.6);
  EXPECT_NEAR(std::accumulate(sds.begin(), sds.end(), 0.0) / 20, 0.02, 0.001);
}

TEST(ThinPlate, OneFactorServesManyFields) {
  const Places<3> points = scattered<3>(70, 35), at = scattered<3>(10, 36);
  std::vector<std::array<double, 3>> values;
  for (const auto& p : points) values.push_back({smooth<3>(p), p[0] * p[1], std::cos(2 * p[2])});
  ThinPlate<3> plate(points);
  const auto together = plate.fit<3>(values, 0.01);
  std::vector<double> all(30), first(90);
  together.evaluate(at, all, first);
  for (size_t f = 0; f < 3; ++f) {
    std::vector<double> one, value(10), slope(30);
    for (const auto& v : values) one.push_back(v[f]);
    plate.fit(one, 1, 0.01).evaluate(at, value, slope);
    for (size_t i = 0; i < 10; ++i) {
      EXPECT_NEAR(all[3 * i + f], value[i], 1e-12);
      for (size_t d = 0; d < 3; ++d) EXPECT_NEAR(first[(3 * i + f) * 3 + d], slope[3 * i + d], 1e-11);
    }
  }
}

TEST(ThinPlate, ARowIsTheSmoothersOwn) {
  const Places<2> points = scattered<2>(40, 37), at = scattered<2>(15, 38);
  std::vector<double> weights, value, values = noisy(values_of(points, smooth<2>), 0.1, 39);
  Places<2> doubled = points, gradient;
  doubled.push_back(points[3]);  // one that is merged
  values.push_back(1);
  for (size_t i = 0; i < doubled.size(); ++i) weights.push_back(i == 7 ? 0 : 1 + static_cast<double>(i % 3));
  for (size_t i = 0; i < at.size(); ++i) {
    value.push_back(0.1 * static_cast<double>(i));
    gradient.push_back({1.0 - static_cast<double>(i % 4), 0.3});
  }
  for (const double lambda : {0.0, 1e-3, 1.0}) {
    ThinPlate<2> plate(doubled, {}, weights);
    const std::vector<double> row = plate.row(at, value, gradient, lambda);
    EXPECT_EQ(row[7], 0);
    std::vector<double> v(at.size()), g(2 * at.size());
    plate.fit(values, 1, lambda).evaluate(at, v, g);
    double sum = 0, by_row = 0;
    for (size_t i = 0; i < at.size(); ++i)
      sum += value[i] * v[i] + gradient[i][0] * g[2 * i] + gradient[i][1] * g[2 * i + 1];
    for (size_t i = 0; i < row.size(); ++i) by_row += row[i] * values[i];
    EXPECT_NEAR(sum, by_row, 1e-8 * (1 + std::abs(sum))) << lambda;
  }
}

TEST(ThinPlate, RefusesWhatIsNoNumber) {
  const Places<2> points = scattered<2>(5, 41), none;
  EXPECT_THROW(ThinPlate<2>{none}, Error);
  Places<2> bad = points;
  bad[2][1] = std::nan("");
  EXPECT_THROW(ThinPlate<2>{bad}, Error);
  EXPECT_THROW((ThinPlate<2>{points, {}, std::vector<double>{1, 1, 1, 1, -1}}), Error);
  EXPECT_THROW((ThinPlate<2>{points, {}, std::vector<double>(5, 0.0)}), Error);
  ThinPlate<2> plate(points);
  EXPECT_THROW(plate.fit(std::vector<double>{1, 2, 3}, 1), Error);
  EXPECT_THROW(plate.fit(std::vector<double>{1, 2, 3, 4, INFINITY}, 1), Error);
  EXPECT_THROW(plate.fit(std::vector<double>(5, 1.0), 1, -1.0), Error);
}

}  // namespace
}  // namespace palpate
