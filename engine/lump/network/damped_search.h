// Levenberg and Marquardt's search for the least chi-square of a lump, or of two.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace palpate::lump {

/// Chi-square of what the emulator has no number for.
inline constexpr double kHopeless = 1e30;

/// Goes on from where `fit` is, and leaves it where its chi-square is least; `fit` has `chi_square` and
/// `normal`. `chi_square(fit, &slope, &normal)` judges a fit, `solve(matrix, slope)` gives a step, and
/// `move(fit, step)` takes it, five numbers of each lump. `held`: of the numbers, one that stays; below 0:
/// none.
template <typename Vector, typename Fit, typename ChiSquare, typename Solve, typename Move>
void damped_search(Fit& fit, uint32_t rounds, int held, const ChiSquare& chi_square, const Solve& solve,
                   const Move& move) {
  constexpr std::array<double, 5> kLongestStep = {0.4, 0.5, 0.9, 1.5, 1.5};
  Vector slope;
  fit.chi_square = chi_square(fit, &slope, &fit.normal);
  if (!std::isfinite(fit.chi_square)) {
    fit.chi_square = kHopeless;
    return;
  }
  double damping = 1e-3;
  for (uint32_t round = 0; round < rounds; ++round) {
    auto matrix = fit.normal;
    matrix.diagonal() *= 1 + damping;
    if (held >= 0) {
      matrix.row(held).setZero();
      matrix.col(held).setZero();
      matrix(held, held) = 1;
      slope(held) = 0;
    }
    Vector step = solve(matrix, slope);
    double shrink = 1;
    for (int p = 0; p < static_cast<int>(step.size()); ++p)
      shrink =
          std::min(shrink, kLongestStep[static_cast<size_t>(p % 5)] / std::max(1e-12, std::abs(step(p))));
    step *= shrink;
    Fit next = fit;
    move(next, step);
    Vector next_slope;
    next.chi_square = chi_square(next, &next_slope, &next.normal);
    if (std::isfinite(next.chi_square) && next.chi_square < fit.chi_square) {
      const double gain = fit.chi_square - next.chi_square;
      fit = next;
      slope = next_slope;
      damping = std::max(1e-6, damping * 0.2);
      if (gain < 0.02 && shrink == 1) break;
    } else {
      if (step.cwiseAbs().maxCoeff() < 1e-4) break;
      damping = std::max(damping * 10, 1e-2);
    }
  }
}

}  // namespace palpate::lump
