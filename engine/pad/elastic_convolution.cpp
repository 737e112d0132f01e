#include "engine/pad/elastic_convolution.h"

#include <vector>

namespace palpate {

ElasticConvolution::ElasticConvolution(const ElasticKernel& kernel, uint32_t width, uint32_t height)
    : convolution_(width, height) {
  std::vector<double> answer;
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) answer.push_back(kernel.at(x, y));
  answer_ = convolution_.kernel(answer, false, false);
}

template <typename Real>
void ElasticConvolution::solve_as(const Real* pressure, uint32_t pitch, Real* deflection,
                                  uint32_t out_pitch) {
  const Convolution::Map<const Real> from[] = {{pressure, pitch}};
  const Convolution::Sum<Real> sums[] = {{{deflection, out_pitch}, {&answer_}}};
  convolution_.apply<Real>(from, sums);
}

void ElasticConvolution::solve(const float* pressure, uint32_t pitch, float* deflection, uint32_t out_pitch) {
  solve_as(pressure, pitch, deflection, out_pitch);
}
void ElasticConvolution::solve(const double* pressure, uint32_t pitch, double* deflection,
                               uint32_t out_pitch) {
  solve_as(pressure, pitch, deflection, out_pitch);
}

}  // namespace palpate
