// Transfer functions of the bonded layer against finite elements through its thickness, which know nothing of
// their closed forms: the energy of a wave along the surface, minimised.
#include "engine/pad/layer_response.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/numeric/dense.h"
#include "engine/numeric/quadrature.h"

namespace palpate {
namespace {

constexpr int kOrder = 4;           // of displacements in an element
constexpr int kPressureDegree = 2;  // of its pressure, which is its own: does not lock where nu is 0.5
constexpr int kElements = 44;

/// Lagrange's polynomials through evenly spaced points of [0, 1], and their slopes.
struct Shapes {
  std::array<double, kOrder + 1> value{}, slope{};
  explicit Shapes(double at) {
    for (int i = 0; i <= kOrder; ++i) {
      double product = 1, sum = 0;
      for (int j = 0; j <= kOrder; ++j) {
        if (j == i) continue;
        double others = 1;
        for (int k = 0; k <= kOrder; ++k)
          if (k != i && k != j) others *= (at * kOrder - k) / (i - k);
        sum += others * kOrder / (i - j);
        product *= (at * kOrder - j) / (i - j);
      }
      value[static_cast<size_t>(i)] = product;
      slope[static_cast<size_t>(i)] = sum;
    }
  }
};

/// A layer of thickness 1 and shear modulus 1 under a wave of number s. Depths from the surface down to the
/// base; elements are as fine as the wave is short where it is felt.
class WaveOnLayer {
 public:
  WaveOnLayer(double s, double poisson) : s_(s), poisson_(poisson) {
    const double fine = std::min(1.0, 20 / s);
    for (int i = 0; i <= kElements; ++i) {
      const double part = static_cast<double>(i) / kElements;
      edges_.push_back(fine * part + (1 - fine) * std::pow(part, 6));
    }
  }

  /// {along, down} at the surface by shear P_x = sin(s x) and pressure P_z = cos(s x): displacements u =
  /// U(z) sin(s x), w = W(z) cos(s x), and p(z) cos(s x) that enforces p = -lambda div.
  std::array<double, 2> plane(double shear, double pressure) const {
    const int nodes = kOrder * kElements + 1, moves = 2 * nodes;
    const int size = moves + (kPressureDegree + 1) * kElements;
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    each_point([&](int element, double at, double weight, const Shapes& shapes, double length) {
      for (int a = 0; a <= kOrder; ++a) {
        const int ua = 2 * (kOrder * element + a), wa = ua + 1;
        const auto i = static_cast<size_t>(a);
        const double va = shapes.value[i], da = shapes.slope[i] / length;
        for (int b = 0; b <= kOrder; ++b) {
          const int ub = 2 * (kOrder * element + b), wb = ub + 1;
          const auto j = static_cast<size_t>(b);
          const double vb = shapes.value[j], db = shapes.slope[j] / length;
          // Twice the strains' squares: (s U)^2 + W'^2 + (U' - s W)^2 / 2.
          matrix(ua, ub) += weight * (2 * s_ * s_ * va * vb + da * db);
          matrix(wa, wb) += weight * (2 * da * db + s_ * s_ * va * vb);
          matrix(ua, wb) -= weight * s_ * da * vb;
          matrix(wb, ua) -= weight * s_ * da * vb;
        }
        for (int b = 0; b <= kPressureDegree; ++b) {
          const int p = moves + (kPressureDegree + 1) * element + b;
          const double value = std::pow(2 * at - 1, b);
          for (const auto& [move, divergence] : {std::pair{ua, s_ * va}, std::pair{wa, da}}) {
            matrix(move, p) -= weight * value * divergence;
            matrix(p, move) -= weight * value * divergence;
          }
        }
      }
      // 1 / lambda, 0 where the layer keeps its volume.
      for (int a = 0; a <= kPressureDegree; ++a)
        for (int b = 0; b <= kPressureDegree; ++b)
          matrix(moves + (kPressureDegree + 1) * element + a, moves + (kPressureDegree + 1) * element + b) -=
              weight * std::pow(2 * at - 1, a + b) * (1 - 2 * poisson_) / std::max(2 * poisson_, 1e-9);
    });
    right(0) = shear;
    right(1) = pressure;
    for (int base = moves - 2; base < moves; ++base) {
      matrix.row(base).setZero();
      matrix.col(base).setZero();
      matrix(base, base) = 1;
    }
    const Eigen::VectorXd moved = dense::solve_lu(matrix, right);
    return {moved(0), moved(1)};
  }

  /// Across the wave: v = V(z) cos(s x) by shear S = cos(s x).
  double across() const {
    const int nodes = kOrder * kElements + 1;
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(nodes, nodes);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(nodes);
    each_point([&](int element, double, double weight, const Shapes& shapes, double length) {
      for (int a = 0; a <= kOrder; ++a)
        for (int b = 0; b <= kOrder; ++b) {
          const auto i = static_cast<size_t>(a), j = static_cast<size_t>(b);
          matrix(kOrder * element + a, kOrder * element + b) +=
              weight * (shapes.slope[i] * shapes.slope[j] / (length * length) +
                        s_ * s_ * shapes.value[i] * shapes.value[j]);
        }
    });
    right(0) = 1;
    matrix.row(nodes - 1).setZero();
    matrix.col(nodes - 1).setZero();
    matrix(nodes - 1, nodes - 1) = 1;
    return dense::solve_lu(matrix, right)(0);
  }

 private:
  template <typename With>
  void each_point(const With& with) const {
    const Quadrature points = gauss_legendre(kOrder + 1, 1);
    for (int element = 0; element < kElements; ++element) {
      const auto e = static_cast<size_t>(element);
      const double length = edges_[e + 1] - edges_[e];
      for (size_t i = 0; i < points.x.size(); ++i)
        with(element, points.x[i], length * points.w[i], Shapes(points.x[i]), length);
    }
  }

  double s_, poisson_;
  std::vector<double> edges_;
};

// All components, from waves a hundred times as long as the layer is thick to a hundred times shorter.
TEST(LayerResponse, IsThatOfFiniteElements) {
  for (const double poisson : {0.0, 0.3, 0.45, 0.4999, 0.5})
    for (const double s : {0.01, 0.1, 0.5, 1.0, 2.0, 5.0, 20.0, 100.0}) {
      SCOPED_TRACE("nu " + std::to_string(poisson) + ", s " + std::to_string(s));
      const WaveOnLayer wave(s, poisson);
      const LayerResponse layer = layer_response(s, poisson);
      const auto by_shear = wave.plane(1, 0), by_pressure = wave.plane(0, 1);
      const auto same = [](double found, double wanted, double scale) {
        EXPECT_NEAR(found, wanted, 1e-6 * std::max(std::abs(wanted), 0.1 * scale));
      };
      same(s * by_pressure[1], layer.normal, layer.normal);
      same(s * by_shear[0], layer.along, layer.along);
      // exp(i s x): what goes with a cosine and its sine changes sign once in each direction.
      const double larger = std::max(layer.normal, layer.along);
      same(-s * by_pressure[0], layer.coupling, larger);
      same(-s * by_shear[1], layer.coupling, larger);
      same(s * wave.across(), layer.across, layer.across);
    }
}

}  // namespace
}  // namespace palpate
