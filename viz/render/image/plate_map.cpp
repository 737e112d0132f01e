#include "viz/render/image/plate_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "shaders/thin_plate.spv.h"
#include "shaders/thin_plate_map.spv.h"

namespace palpate {
namespace {

constexpr uint32_t kWorkgroup = 64, kStep = shared::kPlateStep;

std::array<uint32_t, 3> groups_for(uint32_t invocations) {
  return {divide_up(invocations, kWorkgroup), 1, 1};
}

/// Largest error of the pieces' gradient for one point of weight 1 at this distance from the cell, step 1.
double piece_error(double distance) {
  struct At {
    double distance, error;
  };
  constexpr std::array<At, 8> kTable = {{{0, 0.9106},
                                         {0.125, 0.6863},
                                         {0.25, 0.5112},
                                         {0.375, 0.3611},
                                         {0.5, 0.2567},
                                         {0.75, 0.1402},
                                         {1, 0.0857},
                                         {1.5, 0.0406}}};
  if (distance >= 1.5) return 0.1 / (distance * distance);
  // It falls with the distance: what holds at the nearer place holds beyond it.
  double error = kTable.front().error;
  for (const At& at : kTable)
    if (distance >= at.distance) error = at.error;
  return error;
}

}  // namespace

PlateMap::PlateMap(gpu::Context& context, uint32_t width, uint32_t height, PlateShown shown) {
  using enum gpu::Binding;
  push_.width = width;
  push_.height = height;
  push_.nodes_x = divide_up(width, kStep) + 1;
  push_.nodes_y = divide_up(height, kStep) + 1;
  push_.pitch = (push_.nodes_x - 1) * (kStep / 4);
  const uint64_t texel = 4 * sizeof(float);
  points_ = gpu::DeviceBuffer(context, "spline points", kMostPoints * texel, gpu::Memory::Upload);
  nodes_ = gpu::DeviceBuffer(context, "spline nodes",
                             uint64_t{push_.nodes_x} * push_.nodes_y * shared::kPlateNodeTexels * texel,
                             gpu::Memory::Device);
  map_ =
      gpu::DeviceBuffer(context, "strain map", uint64_t{push_.pitch} * height * texel, gpu::Memory::Readback);
  point_texels_ = gpu::TexelView(context, points_, VK_FORMAT_R32G32B32A32_SFLOAT);
  node_texels_ = gpu::TexelView(context, nodes_, VK_FORMAT_R32G32B32A32_SFLOAT);
  lattice_ = gpu::Kernel(context, {"thin_plate", k_thin_plate},
                         {{Texels, Storage}, sizeof push_, {kWorkgroup, 1, 1}, {}});
  fill_ = gpu::Kernel(context, {"thin_plate_map", k_thin_plate_map},
                      {{Texels, Storage}, sizeof push_, {kWorkgroup, 1, 1}, {static_cast<uint32_t>(shown)}});
}

void PlateMap::set(const ThinPlateSpline<2>& spline, double reach_px) {
  const PlateTerms& terms = spline.terms();
  if (spline.fields() != 2 || terms.kernel != PlateKernel::Log || spline.frame().rank != 2 ||
      terms.count > kMostPoints)
    throw Error(Failure::Input,
                "a spline of two fields, kernel r^2 log r^2, over up to " + std::to_string(kMostPoints) +
                    " points that are not in one line",
                std::to_string(spline.fields()) + " fields over " + std::to_string(terms.count) +
                    " points of rank " + std::to_string(spline.frame().rank),
                "more points, spread over the pad");
  const auto points = points_.as<std::array<float, 4>>();
  for (size_t i = 0; i < terms.count; ++i)
    points[i] = {static_cast<float>(terms.at[i]), static_cast<float>(terms.at[terms.count + i]),
                 static_cast<float>(terms.weight[i]), static_cast<float>(terms.weight[terms.count + i])};
  points_.flush();
  const double px = spline.frame().axes[0][0];
  const std::vector<double>& polynomial = spline.polynomial();
  push_.count = static_cast<uint32_t>(terms.count);
  push_.px = static_cast<float>(px);
  push_.first_x = static_cast<float>(-px * spline.frame().centre[0]);
  push_.first_y = static_cast<float>(-px * spline.frame().centre[1]);
  push_.reach2 = static_cast<float>(px * px * reach_px * reach_px);
  push_.u = static_cast<float>(polynomial[0]);
  push_.u_x = static_cast<float>(polynomial[1]);
  push_.u_y = static_cast<float>(polynomial[2]);
  push_.v = static_cast<float>(polynomial[3]);
  push_.v_x = static_cast<float>(polynomial[4]);
  push_.v_y = static_cast<float>(polynomial[5]);
}

void PlateMap::record(gpu::Commands& commands) const {
  const auto scope = commands.scope("thin_plate");
  commands.dispatch(lattice_, {&point_texels_, &nodes_}, push_,
                    groups_for((push_.nodes_x + 3) / 4 * push_.nodes_y));
  commands.barrier();
  commands.dispatch(fill_, {&node_texels_, &map_}, push_, groups_for((push_.nodes_x - 1) * push_.height));
  commands.barrier();
}

double plate_map_error_bound(const ThinPlateSpline<2>& spline, uint32_t width, uint32_t height) {
  const PlateTerms& terms = spline.terms();
  const auto& frame = spline.frame();
  const double px = frame.axes[0][0], cell = px * kStep;
  double most = 0;
  for (uint32_t j = 0; j * kStep < height; ++j)
    for (uint32_t i = 0; i * kStep < width; ++i) {
      double u = 0, v = 0;
      for (size_t p = 0; p < terms.count; ++p) {
        // In cells, from the cell's upper left corner.
        const double x = (terms.at[p] + px * frame.centre[0]) / cell - i,
                     y = (terms.at[terms.count + p] + px * frame.centre[1]) / cell - j;
        const double error =
            piece_error(std::hypot(x - std::clamp(x, 0.0, 1.0), y - std::clamp(y, 0.0, 1.0)));
        u += std::abs(terms.weight[p]) * error;
        v += std::abs(terms.weight[terms.count + p]) * error;
      }
      most = std::max({most, u, v});
    }
  return most * cell * px;
}

}  // namespace palpate
