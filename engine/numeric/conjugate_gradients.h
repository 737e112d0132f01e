// Conjugate gradients in double precision with a preconditioner in single precision.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "engine/base/stop.h"
#include "engine/base/work_team.h"

namespace palpate {

class ConjugateGradients {
 public:
  using Product = std::function<void(const double* in, double* out)>;
  using Preconditioner = std::function<void(const float* in, float* out)>;

  /// Solver of `size` unknowns. Keeps the team, which outlives it.
  ConjugateGradients(size_t size, WorkTeam& team);

  /// Adds to x about K^-1 residual and takes K times it off the residual, until the residual's norm is
  /// `target` or less. Ends before where a curvature is not positive, which is rounding or a K that is not
  /// positive definite, and once `stop` says so. Returns the iterations done, `most` at most.
  uint32_t run(const Product& product, const Preconditioner& preconditioner, std::vector<double>& residual,
               std::vector<double>& x, double target, uint32_t most, const StopAsked& stop = {});

  double norm(const std::vector<double>& a) const;
  uint64_t bytes() const { return direction_.size() * (2 * sizeof(double) + 2 * sizeof(float)); }

 private:
  template <typename Real>
  double dot(const std::vector<double>& a, const std::vector<Real>& b) const;

  WorkTeam& team_;
  std::vector<double> direction_, product_;
  std::vector<float> single_residual_, correction_;
};

}  // namespace palpate
