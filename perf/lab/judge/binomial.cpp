#include "perf/lab/judge/binomial.h"

#include <cmath>
#include <initializer_list>

namespace palpate::judge {
namespace {

/// The continued fraction of I_x(a, b), which converges fast for x < (a + 1) / (a + b + 2).
double beta_fraction(double a, double b, double x) {
  constexpr double kTiny = 1e-300, kSettled = 1e-15;
  constexpr int kMost = 10000;
  const auto away_from_0 = [](double v) { return std::abs(v) < kTiny ? kTiny : v; };
  double c = 1, d = 1 / away_from_0(1 - (a + b) * x / (a + 1)), value = d;
  for (int k = 1; k < kMost; ++k) {
    const double even = k * (b - k) * x / ((a + 2 * k - 1) * (a + 2 * k)),
                 odd = -(a + k) * (a + b + k) * x / ((a + 2 * k) * (a + 2 * k + 1));
    double step = 1;
    for (const double term : {even, odd}) {
      d = 1 / away_from_0(1 + term * d);
      c = away_from_0(1 + term / c);
      step = c * d;
      value *= step;
    }
    if (std::abs(step - 1) < kSettled) break;
  }
  return value;
}

/// The x in 0 to 1 at which I_x(a, b) is `probability`, by bisection.
double beta_quantile(double a, double b, double probability) {
  double low = 0, high = 1;
  for (int k = 0; k < 60; ++k) {
    const double middle = (low + high) / 2;
    (incomplete_beta(a, b, middle) < probability ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace

double incomplete_beta(double a, double b, double x) {
  if (!(x > 0)) return 0;
  if (!(x < 1)) return 1;
  const double front =
      std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x));
  return x < (a + 1) / (a + b + 2) ? front * beta_fraction(a, b, x) / a
                                   : 1 - front * beta_fraction(b, a, 1 - x) / b;
}

double at_most(size_t count, size_t all, double rate) {
  if (count >= all) return 1;
  return incomplete_beta(static_cast<double>(all - count), static_cast<double>(count + 1), 1 - rate);
}

Band exact_band(size_t count, size_t all, double level) {
  const double tail = (1 - level) / 2;
  const auto k = static_cast<double>(count), left = static_cast<double>(all - count);
  Band band;
  if (count > 0) band.low = beta_quantile(k, left + 1, tail);
  if (count < all) band.high = beta_quantile(k + 1, left, 1 - tail);
  return band;
}

}  // namespace palpate::judge
