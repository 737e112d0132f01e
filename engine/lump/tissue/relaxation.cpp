#include "engine/lump/tissue/relaxation.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace palpate::lump {
namespace {

/// Sums of maps and forces, a row of `by` for each load.
void combine(const Eigen::MatrixXd& by, std::vector<PressureMap>& pressure_Pa, std::vector<double>& force_N) {
  const std::vector<PressureMap> maps = pressure_Pa;
  const std::vector<double> forces = force_N;
  for (size_t k = 0; k < maps.size(); ++k) {
    force_N[k] = 0;
    std::fill(pressure_Pa[k].values.begin(), pressure_Pa[k].values.end(), 0.0f);
    for (size_t j = 0; j <= k; ++j) {
      const double factor = by(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(j));
      force_N[k] += factor * forces[j];
      for (size_t n = 0; n < maps[j].values.size(); ++n)
        pressure_Pa[k].values[n] += static_cast<float>(factor * double{maps[j].values[n]});
    }
  }
}

/// What is read at each load, by the elastic maps of all: lower triangular, positive on its diagonal.
Eigen::MatrixXd read_by_elastic(const Relaxation& relaxation, size_t loads) {
  const auto n = static_cast<Eigen::Index>(loads);
  Eigen::MatrixXd by = Eigen::MatrixXd::Zero(n, n);
  const double period_s = relaxation.move_s + relaxation.rest_s;
  for (Eigen::Index k = 0; k < n; ++k)
    for (Eigen::Index step = 0; step <= k; ++step) {
      const double since_s = relaxation.rest_s + static_cast<double>(k - step) * period_s;
      const double modulus = modulus_after(relaxation, since_s, relaxation.move_s);
      by(k, step) += modulus;
      if (step > 0) by(k, step - 1) -= modulus;
    }
  return by;
}

}  // namespace

double modulus_after(const Relaxation& relaxation, double seconds, double ramp_s) {
  double modulus = 1;
  for (const Relaxation::Term& term : relaxation.terms) {
    const double ramp = ramp_s / term.time_s;
    const double left = std::exp(-seconds / term.time_s) * (ramp > 0 ? -std::expm1(-ramp) / ramp : 1);
    modulus -= term.share * (1 - left);
  }
  return modulus;
}

Observation without_relaxation(const Observation& observation, double share) {
  Observation elastic = observation;
  elastic.relaxation.reset();
  if (!observation.relaxation) return elastic;
  Relaxation part = *observation.relaxation;
  for (Relaxation::Term& term : part.terms) term.share *= share;
  const Eigen::MatrixXd by = read_by_elastic(part, observation.force_N.size());
  const Eigen::MatrixXd inverse =
      by.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(by.rows(), by.cols()));
  combine(inverse, elastic.pressure_Pa, elastic.force_N);
  elastic.noise_Pa *= inverse.rowwise().norm().maxCoeff();
  return elastic;
}

void relax(const Relaxation& relaxation, std::vector<PressureMap>& pressure_Pa,
           std::vector<double>& force_N) {
  combine(read_by_elastic(relaxation, force_N.size()), pressure_Pa, force_N);
}

}  // namespace palpate::lump
