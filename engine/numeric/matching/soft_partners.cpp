#include "engine/numeric/matching/soft_partners.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/base/simd.h"

namespace palpate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;
using Eigen::VectorXf;

constexpr int kBalancings = 2;

// e^x of x <= 0 to 3e-7 relative; below e^-87 nothing is left.
PALPATE_INLINE float fading(float x) {
  constexpr float kLog2e = 1.44269504f;
  const float t = std::max(x, -87.f) * kLog2e;
  const float whole = std::floor(t), f = t - whole;
  const float power =
      1.f + f * (0.693147f +
                 f * (0.2402265f + f * (0.0555033f + f * (0.0096184f + f * (0.0013341f + f * 0.000154f)))));
  return power * std::bit_cast<float>((static_cast<int32_t>(whole) + 127) << 23);
}

// One target's column: exp(-squared distance * scale + likeness). `a`: count x axes.
PALPATE_INLINE void fill_column(const float* a, size_t count, size_t axes, const float* b, const float* scale,
                                const float* likeness, float* result) {
  for (size_t i = 0; i < count; ++i) result[i] = 0;
  for (size_t c = 0; c < axes; ++c)
    for (size_t i = 0; i < count; ++i) {
      const float d = a[c * count + i] - b[c];
      result[i] += d * d;
    }
  if (likeness)
    for (size_t i = 0; i < count; ++i) result[i] = fading(likeness[i] - result[i] * scale[i]);
  else
    for (size_t i = 0; i < count; ++i) result[i] = fading(-result[i] * scale[i]);
}

using FillColumn = void (*)(const float*, size_t, size_t, const float*, const float*, const float*, float*);

void plain(const float* a, size_t count, size_t axes, const float* b, const float* scale,
           const float* likeness, float* result) {
  fill_column(a, count, axes, b, scale, likeness, result);
}
#ifdef PALPATE_WIDE
PALPATE_AVX2 void wide(const float* a, size_t count, size_t axes, const float* b, const float* scale,
                       const float* likeness, float* result) {
  fill_column(a, count, axes, b, scale, likeness, result);
}
#endif

FillColumn widest_here() {
#ifdef PALPATE_WIDE
  if (vector_units::avx2()) return wide;
#endif
  return plain;
}

}  // namespace

void set_closeness(const MatrixXd& from, const MatrixXf& to, const VectorXd& variance,
                   const MatrixXf& likeness, MatrixXf& result) {
  static const FillColumn fill = widest_here();
  const MatrixXf a = from.cast<float>();
  const VectorXf scale = (0.5 / variance.array()).cast<float>();
  const auto count = static_cast<size_t>(a.rows()), axes = static_cast<size_t>(a.cols());
  result.resize(a.rows(), to.rows());
  for (Index j = 0; j < to.rows(); ++j) {
    const float b[3] = {to(j, 0), to(j, 1), axes > 2 ? to(j, 2) : 0.f};
    fill(a.data(), count, axes, b, scale.data(), likeness.size() > 0 ? likeness.col(j).data() : nullptr,
         result.col(j).data());
  }
}

void balance(float column_nil, float row_nil, VectorXf& row_factor, MatrixXf& p) {
  Eigen::RowVectorXf column_factor;
  for (int k = 0; k < kBalancings; ++k) {
    column_factor = ((row_factor.transpose() * p).array() + column_nil).inverse();
    row_factor = ((p * column_factor.transpose()).array() + row_nil).inverse();
  }
  column_factor = ((row_factor.transpose() * p).array() + column_nil).inverse();
  p.array().colwise() *= row_factor.array();
  p.array().rowwise() *= column_factor.array();
}

}  // namespace palpate
