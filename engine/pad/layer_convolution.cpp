#include "engine/pad/layer_convolution.h"

namespace palpate {
namespace {

using Field = std::vector<double>;
using From = Convolution::Map<const double>;
using Sum = Convolution::Sum<double>;

}  // namespace

LayerConvolution::LayerConvolution(const LayerKernel& kernel, uint32_t width, uint32_t height, bool shear)
    : convolution_(width, height), has_shear_(shear) {
  std::array<Field, kParts> answers;
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      if (!shear) {
        answers[kDepth].push_back(kernel.depth(x, y));
        continue;
      }
      const CellAnswer at = kernel.at(x, y);
      const std::array<double, kParts> values = {at.depth,  at.x_by_pressure, at.y_by_pressure,
                                                 at.x_by_x, at.y_by_x,        at.y_by_y};
      for (size_t part = 0; part < kParts; ++part) answers[part].push_back(values[part]);
    }
  // Whether each changes its sign from right to left, and from below to above.
  constexpr std::array<std::array<bool, 2>, kParts> kOdd = {
      {{false, false}, {true, false}, {false, true}, {false, false}, {true, true}, {false, false}}};
  for (size_t part = 0; part < (shear ? size_t{kParts} : 1); ++part)
    parts_[part] = convolution_.kernel(answers[part], kOdd[part][0], kOdd[part][1]);
}

void LayerConvolution::depth_by_pressure(const Field& pressure, Field& depth) {
  depth.resize(pressure.size());
  const From from[] = {{pressure.data(), width()}};
  const Sum sums[] = {{{depth.data(), width()}, {&parts_[kDepth]}}};
  convolution_.apply<double>(from, sums);
}

void LayerConvolution::depth_by_pressure(const float* pressure, uint32_t pitch, float* depth,
                                         uint32_t depth_pitch) {
  const Convolution::Map<const float> from[] = {{pressure, pitch}};
  const Convolution::Sum<float> sums[] = {{{depth, depth_pitch}, {&parts_[kDepth]}}};
  convolution_.apply<float>(from, sums);
}

void LayerConvolution::depth_by_shear(const Field& x, const Field& y, Field& depth) {
  depth.resize(x.size());
  const From from[] = {{x.data(), width()}, {y.data(), width()}};
  const Sum sums[] = {{{depth.data(), width()}, {&parts_[kXByPressure], &parts_[kYByPressure]}, -1}};
  convolution_.apply<double>(from, sums);
}

void LayerConvolution::shift_by_pressure(const Field& pressure, Field& x, Field& y) {
  x.resize(pressure.size());
  y.resize(pressure.size());
  const From from[] = {{pressure.data(), width()}};
  const Sum sums[] = {{{x.data(), width()}, {&parts_[kXByPressure]}},
                      {{y.data(), width()}, {&parts_[kYByPressure]}}};
  convolution_.apply<double>(from, sums);
}

void LayerConvolution::shift_by_shear(const Field& x, const Field& y, Field& shift_x, Field& shift_y) {
  shift_x.resize(x.size());
  shift_y.resize(x.size());
  const From from[] = {{x.data(), width()}, {y.data(), width()}};
  const Sum sums[] = {{{shift_x.data(), width()}, {&parts_[kXByX], &parts_[kYByX]}},
                      {{shift_y.data(), width()}, {&parts_[kYByX], &parts_[kYByY]}}};
  convolution_.apply<double>(from, sums);
}

}  // namespace palpate
