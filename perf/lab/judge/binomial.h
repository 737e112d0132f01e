// Binomial counts: exact bands of a rate from "so many of so many", and how unlikely a count is.
#pragma once

#include <cstddef>

namespace palpate::judge {

/// An interval of a rate, both within 0 to 1.
struct Band {
  double low = 0, high = 1;
};

/// Regularised incomplete beta function I_x(a, b), by Lentz's continued fraction; a, b > 0, x in 0 to 1.
/// Good to 1e-12 (checked against sums of binomial probabilities).
double incomplete_beta(double a, double b, double x);

/// Probability of at most `count` of `all` at a rate; 1 for count >= all.
double at_most(size_t count, size_t all, double rate);

/// Clopper and Pearson's exact band: rates at which neither `count` and fewer nor `count` and more are less
/// likely than (1 - level) / 2. It holds the true rate in `level` of all experiments or more. `count` <=
/// `all`; of no experiment 0 to 1. C. J. Clopper, E. S. Pearson, Biometrika 26 (1934) 404.
Band exact_band(size_t count, size_t all, double level = 0.9);

}  // namespace palpate::judge
