// Conjugate gradients on some of the unknowns, the others held at 0: those of a contact.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace palpate {

using MaskedOperator = std::function<void(const std::vector<double>& in, std::vector<double>& out)>;

/// Memory of conjugate gradients; kept so that frames allocate nothing.
struct MaskedGradients {
  std::vector<double> rest, along, image;
};

double dot(const std::vector<double>& a, const std::vector<double>& b);

/// Solves matrix x = right, symmetric and positive definite, on the unknowns where `free` is not 0, from `x`;
/// until the residual is `tolerance` times the right side. Returns the iterations done, `most` at most.
uint32_t conjugate_gradients(const MaskedOperator& matrix, const std::vector<double>& right,
                             const std::vector<uint8_t>& free, double tolerance, uint32_t most,
                             MaskedGradients& memory, std::vector<double>& x, double& relative_residual);

}  // namespace palpate
