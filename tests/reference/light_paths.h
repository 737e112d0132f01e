// Light in a stack of layers followed bounce by bounce: a sum over all paths (intensities in every layer,
// moved on until next to nothing is left), and single photons thrown by chance. Fresnel by the angles, as
// textbooks write it. Plain loops, for tests only.
#pragma once

#include <cmath>
#include <complex>
#include <random>
#include <vector>

namespace palpate::reference {

using Complex = std::complex<double>;

/// |r|^2 with angles; N = n - ik, incidence from a clear medium or weakly absorbing ones.
inline double reflected(Complex from, Complex to, double s, bool s_polarised) {
  const auto cosine = [&](Complex n) {
    Complex c = std::sqrt(1.0 - (s / n) * (s / n));
    if ((n * c).imag() > 0 || ((n * c).imag() == 0 && (n * c).real() < 0)) c = -c;
    return c;
  };
  const Complex c1 = cosine(from), c2 = cosine(to);
  const Complex r = s_polarised ? (from * c1 - to * c2) / (from * c1 + to * c2)
                                : (to * c1 - from * c2) / (to * c1 + from * c2);
  return std::norm(r);
}

struct Media {
  std::vector<Complex> index;        ///< outside, layers, outside
  std::vector<double> thickness_mm;  ///< of the layers
  double wavelength_mm = 630e-6;
};

/// Reflectance of single interfaces, and transmittance of a pass through each layer.
struct Pieces {
  std::vector<double> reflect, pass;
};
inline Pieces pieces_of(const Media& m, double s, bool s_polarised) {
  Pieces p;
  for (size_t i = 0; i + 1 < m.index.size(); ++i)
    p.reflect.push_back(reflected(m.index[i], m.index[i + 1], s, s_polarised));
  for (size_t i = 0; i < m.thickness_mm.size(); ++i) {
    // Lambert and Beer along the slanted way.
    const double n = m.index[i + 1].real(), alpha = -4 * M_PI * m.index[i + 1].imag() / m.wavelength_mm;
    p.pass.push_back(std::exp(-alpha * m.thickness_mm[i] / std::sqrt(1 - s * s / n / n)));
  }
  return p;
}

struct Ends {
  double reflected = 0, passed = 0;
  std::vector<double> absorbed;
};

/// Light of intensity 1 from the first outside, split at every interface until less than 1e-16 is under way.
inline Ends sum_of_paths(const Pieces& p) {
  const size_t layers = p.pass.size();
  Ends ends;
  ends.absorbed.assign(layers, 0);
  // down[i]: light that arrives at interface i from above; up[i]: from below.
  std::vector<double> down(layers + 1), up(layers + 1);
  down[0] = 1;
  for (int bounce = 0; bounce < 10'000'000; ++bounce) {
    std::vector<double> next_down(layers + 1), next_up(layers + 1);
    double under_way = 0;
    const auto cross = [&](size_t layer, double light, bool downwards) {
      const double left = light * p.pass[layer];
      ends.absorbed[layer] += light - left;
      (downwards ? next_down[layer + 1] : next_up[layer]) += left;
      under_way += left;
    };
    for (size_t i = 0; i <= layers; ++i) {
      const double r = p.reflect[i];
      const double above = down[i] * r + up[i] * (1 - r), below = down[i] * (1 - r) + up[i] * r;
      if (i == 0)
        ends.reflected += above;
      else if (above > 0)
        cross(i - 1, above, false);
      if (i == layers)
        ends.passed += below;
      else if (below > 0)
        cross(i, below, true);
    }
    down = next_down;
    up = next_up;
    if (under_way < 1e-16) break;
  }
  return ends;
}

/// The same by `count` photons, each reflected, passed or absorbed as chance has it.
inline Ends throw_photons(const Pieces& p, int count, std::mt19937_64& random) {
  const size_t layers = p.pass.size();
  std::uniform_real_distribution<double> uniform(0, 1);
  Ends ends;
  ends.absorbed.assign(layers, 0);
  const double one = 1.0 / count;
  for (int k = 0; k < count; ++k) {
    size_t medium = 0;  // 0: first outside, layers + 1: second
    bool downwards = true;
    while (true) {
      const size_t face = downwards ? medium : medium - 1;
      if (uniform(random) < p.reflect[face])
        downwards = !downwards;
      else
        medium = downwards ? medium + 1 : medium - 1;
      if (medium == 0) {
        ends.reflected += one;
        break;
      }
      if (medium == layers + 1) {
        ends.passed += one;
        break;
      }
      if (uniform(random) >= p.pass[medium - 1]) {
        ends.absorbed[medium - 1] += one;
        break;
      }
    }
  }
  return ends;
}

}  // namespace palpate::reference
