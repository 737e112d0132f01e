#include "engine/pad/masked_gradients.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate {

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

uint32_t conjugate_gradients(const MaskedOperator& matrix, const std::vector<double>& right,
                             const std::vector<uint8_t>& free, double tolerance, uint32_t most,
                             MaskedGradients& memory, std::vector<double>& x, double& relative_residual) {
  const size_t n = right.size();
  auto& [rest, along, image] = memory;
  for (std::vector<double>* field : {&rest, &along, &image}) field->resize(n);
  double goal = 0;
  for (size_t i = 0; i < n; ++i) {
    if (free[i] == 0) x[i] = 0;
    goal += free[i] != 0 ? right[i] * right[i] : 0;
  }
  relative_residual = 0;
  if (goal == 0) {
    std::fill(x.begin(), x.end(), 0);
    return 0;
  }
  matrix(x, image);
  for (size_t i = 0; i < n; ++i) along[i] = rest[i] = free[i] != 0 ? right[i] - image[i] : 0;
  double squares = dot(rest, rest);
  uint32_t iteration = 0;
  for (; iteration < most && squares > tolerance * tolerance * goal; ++iteration) {
    matrix(along, image);
    for (size_t i = 0; i < n; ++i)
      if (free[i] == 0) image[i] = 0;
    const double step = squares / dot(along, image);
    for (size_t i = 0; i < n; ++i) {
      x[i] += step * along[i];
      rest[i] -= step * image[i];
    }
    const double before = std::exchange(squares, dot(rest, rest));
    for (size_t i = 0; i < n; ++i) along[i] = rest[i] + squares / before * along[i];
  }
  relative_residual = std::sqrt(squares / goal);
  return iteration;
}

}  // namespace palpate
