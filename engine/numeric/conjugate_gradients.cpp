#include "engine/numeric/conjugate_gradients.h"

#include <cmath>

namespace palpate {

ConjugateGradients::ConjugateGradients(size_t size, WorkTeam& team)
    : team_(team), direction_(size), product_(size), single_residual_(size), correction_(size) {}

template <typename Real>
double ConjugateGradients::dot(const std::vector<double>& a, const std::vector<Real>& b) const {
  std::vector<double> sums(team_.members());
  team_.run([&](uint32_t part) {
    const auto [begin, end] = team_.share(static_cast<uint32_t>(a.size()), part);
    double lanes[8] = {};
    size_t n = begin;
    for (; n + 8 <= end; n += 8)
      for (size_t l = 0; l < 8; ++l) lanes[l] += a[n + l] * double{b[n + l]};
    for (; n < end; ++n) lanes[0] += a[n] * double{b[n]};
    for (const double lane : lanes) sums[part] += lane;
  });
  double sum = 0;
  for (const double s : sums) sum += s;
  return sum;
}

double ConjugateGradients::norm(const std::vector<double>& a) const {
  return std::sqrt(dot(a, a));
}

uint32_t ConjugateGradients::run(const Product& product, const Preconditioner& preconditioner,
                                 std::vector<double>& residual, std::vector<double>& x, double target,
                                 uint32_t most, const StopAsked& stop) {
  const auto size = static_cast<uint32_t>(residual.size());
  double left = norm(residual), previous = 0;
  uint32_t iterations = 0;
  while (left > target && iterations < most && !(stop && stop())) {
    // The preconditioner works on numbers near 1 whatever the unit.
    const double scale = left / std::sqrt(static_cast<double>(size));
    team_.run([&](uint32_t part) {
      const auto [begin, end] = team_.share(size, part);
      for (size_t n = begin; n < end; ++n) single_residual_[n] = static_cast<float>(residual[n] / scale);
    });
    preconditioner(single_residual_.data(), correction_.data());
    const double along = scale * dot(residual, correction_);
    const double beta = previous == 0 ? 0 : along / previous;
    if (!(along > 0)) break;
    previous = along;
    team_.run([&](uint32_t part) {
      const auto [begin, end] = team_.share(size, part);
      for (size_t n = begin; n < end; ++n)
        direction_[n] = scale * double{correction_[n]} + beta * direction_[n];
    });
    product(direction_.data(), product_.data());
    const double curvature = dot(direction_, product_);
    if (!(curvature > 0)) break;
    const double alpha = along / curvature;
    team_.run([&](uint32_t part) {
      const auto [begin, end] = team_.share(size, part);
      for (size_t n = begin; n < end; ++n) {
        x[n] += alpha * direction_[n];
        residual[n] -= alpha * product_[n];
      }
    });
    left = norm(residual);
    ++iterations;
  }
  return iterations;
}

}  // namespace palpate
