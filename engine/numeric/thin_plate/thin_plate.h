// Thin-plate splines: smooth fields through scattered points in the plane or in space, as stiff as their
// noise asks for.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/numeric/thin_plate/kernel.h"
#include "engine/numeric/thin_plate/points.h"

namespace palpate {

/// The thin plate's own kernel in D dimensions. For derivatives at the points in space take Cubic: Linear has
/// a kink there.
template <size_t D>
constexpr PlateKernel plate_kernel() {
  return D == 2 ? PlateKernel::Log : PlateKernel::Linear;
}

struct PlateOptions {
  std::optional<PlateKernel> kernel;  ///< none: plate_kernel<D>()
  /// Points closer than this fraction of the usual spacing become one, their values averaged: a pair 1e-6
  /// apart whose values differ by 1e-3 would bend everything near it. Below 1.
  double merge_fraction = 1e-3;
  /// An axis along which the points spread less than this fraction of their widest spread is not determined:
  /// the spline is constant along it.
  double flat_fraction = 1e-6;
  /// For a given lambda > 0 too: degrees of freedom and residual, at about twice the work.
  bool spread = true;
};

/// Statistics of a spline.
struct PlateStatistics {
  double lambda = 0;           ///< as used; of points scaled to an RMS distance of 1 from their centre
  bool lambda_raised = false;  ///< the one asked for was too small for the points: the least that is solvable
  bool lambda_by_data = false;                            ///< chosen by robust generalised cross-validation
  double gcv = std::numeric_limits<double>::quiet_NaN();  ///< the plain score there, squares of the values;
                                                          ///< NaN: not chosen by it
  /// Trace of the influence matrix, from 1 + rank (a polynomial) to the number of points (through all); NaN:
  /// not asked for.
  double freedom = std::numeric_limits<double>::quiet_NaN();
  /// Per field: standard deviation of a point of mean weight about the spline; NaN: no degrees of freedom are
  /// left.
  std::vector<double> residual_sd;
  double condition = 1;  ///< of the matrix solved (1-norm estimate, or ratio of eigenvalues)
  size_t points = 0;     ///< with a weight
  size_t merged = 0;     ///< of them, averaged with another
  uint32_t rank =
      0;  ///< axes that the points determine: below D they lie in a plane, on a line or in one place
  double flatness = 1;  ///< least spread over widest, 0 to 1
};

/// A fitted spline of one or several fields over the same points: sum of kernels and a linear polynomial.
template <size_t D>
class ThinPlateSpline {
 public:
  using Place = std::array<double, D>;

  ThinPlateSpline(PlateFrame<D> frame, PlateTerms terms, std::vector<double> polynomial,
                  PlateStatistics statistics)
      : frame_(frame),
        terms_(std::move(terms)),
        polynomial_(std::move(polynomial)),
        statistics_(std::move(statistics)) {}

  size_t fields() const { return terms_.fields; }
  /// Per place and field the value, D first derivatives and D x D second ones, whichever span is not empty;
  /// each place after place, within it field after field. Along what the points do not determine derivatives
  /// are 0. At a point Log and Linear have second derivatives without bound, and Linear's gradient leaves out
  /// the point's own.
  void evaluate(std::span<const Place> at, std::span<double> values, std::span<double> first = {},
                std::span<double> second = {}) const;
  std::vector<double> values(std::span<const Place> at) const;

  const PlateStatistics& statistics() const { return statistics_; }
  const PlateFrame<D>& frame() const { return frame_; }
  const PlateTerms& terms() const { return terms_; }
  /// fields x (1 + rank): constant and slopes in the points' own coordinates.
  const std::vector<double>& polynomial() const { return polynomial_; }

 private:
  PlateFrame<D> frame_;
  PlateTerms terms_;
  std::vector<double> polynomial_;
  PlateStatistics statistics_;
};

class PlateSystem;

/// Fixed points, factored once for the fields that are fitted over them. f minimises
/// sum weight |f - value|^2 + lambda * bending, which is (K + lambda / weight) w + P a = values, P^T w = 0,
/// in coordinates about the points' centre that are scaled to an RMS distance of 1, so that lambda means the
/// same wherever and however large the points are. Solved by the null space of P and Cholesky (or the
/// tridiagonal form, once lambda is chosen by the data). Not for use by several threads at a time.
template <size_t D>
class ThinPlate {
 public:
  using Place = std::array<double, D>;

  /// `weights` (relative, >= 0; 0: the point is not there) or none. Throws Error(Failure::Input) without a
  /// point, with sizes that differ, and with a number that is not finite.
  explicit ThinPlate(std::span<const Place> points, const PlateOptions& options = {},
                     std::span<const double> weights = {});
  ~ThinPlate();
  ThinPlate(ThinPlate&&) noexcept;
  ThinPlate& operator=(ThinPlate&&) noexcept;

  /// `values`: points x `fields`, point after point. `lambda` >= 0, 0: through all points; none: chosen for
  /// all fields together by robust generalised cross-validation (Lukas 2006). A lambda is factored once
  /// however often it is used. Throws Error(Failure::Input) as above.
  ThinPlateSpline<D> fit(std::span<const double> values, size_t fields, std::optional<double> lambda = {});
  template <size_t Fields>
  ThinPlateSpline<D> fit(std::span<const std::array<double, Fields>> values,
                         std::optional<double> lambda = {}) {
    return fit(std::span(values.empty() ? nullptr : values.front().data(), values.size() * Fields), Fields,
               lambda);
  }

  /// How sum over `at` of (value coefficient * f + gradient coefficients * grad f) answers to each point's
  /// value at this lambda: that sum is the row times the values. Its standard error from noise of equal size
  /// in all points is the residual sd times the root of sum row^2 / (weight / mean weight); the bias of
  /// smoothing is not in it.
  std::vector<double> row(std::span<const Place> at, std::span<const double> value,
                          std::span<const Place> gradient, double lambda);

 private:
  void gather(std::span<const double> values, size_t fields, std::vector<double>& mean,
              std::vector<double>& within) const;

  PlateOptions options_;
  PlateKernel kernel_;
  PlateFrame<D> frame_;
  PlateStatistics statistics_;    // of the points
  std::vector<size_t> group_;     // of each point among the merged ones; kNone: weight 0
  std::vector<double> weight_;    // of each point, their mean 1
  std::vector<double> own_;       // merged points in own coordinates, rank x count
  std::vector<double> together_;  // weights of the merged points
  std::unique_ptr<PlateSystem> system_;
};

extern template class ThinPlateSpline<2>;
extern template class ThinPlateSpline<3>;
extern template class ThinPlate<2>;
extern template class ThinPlate<3>;

}  // namespace palpate
