#include "engine/fem/device/cycle.h"

#include <Eigen/Core>
#include <algorithm>
#include <optional>
#include <utility>

#include "engine/fem/linear/level.h"
#include "engine/gpu/commands.h"
#include "engine/numeric/dense.h"
#include "palpate/error.h"

namespace palpate::fem {
namespace {

/// The dense inverse as forward_coarsest.comp reads it; zero where displacements are fixed.
std::vector<float> dense_inverse(const Stiffness& stiffness, const FixedNodes& fixed) {
  const size_t nodes = stiffness.grid().nodes();
  const auto size = static_cast<Eigen::Index>(3 * nodes);
  Eigen::MatrixXd matrix(size, size);
  std::vector<double> unit(3 * nodes), column(3 * nodes);
  WorkTeam team(1);
  const auto held = [&](size_t at) { return (fixed[at % nodes] >> (at / nodes) & 1) != 0; };
  for (size_t at = 0; at < 3 * nodes; ++at) {
    if (held(at)) {
      matrix.col(static_cast<Eigen::Index>(at)).setZero();
      matrix(static_cast<Eigen::Index>(at), static_cast<Eigen::Index>(at)) = 1;
      continue;
    }
    unit[at] = 1;
    stiffness.apply(unit.data(), column.data(), &fixed, team);
    unit[at] = 0;
    matrix.col(static_cast<Eigen::Index>(at)) = Eigen::Map<const Eigen::VectorXd>(column.data(), size);
  }
  const dense::Cholesky factor(matrix);
  if (!factor.ok())
    throw Error(Failure::Usage, "a block held by its supports", "a block that can move freely",
                "a bonded or sliding bottom");
  const Eigen::MatrixXd inverse = factor.solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(size, size)));
  std::vector<float> texels(4 * nodes * 3 * nodes);
  for (size_t m = 0; m < nodes; ++m)
    for (size_t row = 0; row < 3 * nodes; ++row)
      for (size_t c = 0; c < 3; ++c)
        if (!held(row) && !held(c * nodes + m))
          texels[4 * (m * 3 * nodes + row) + c] = static_cast<float>(
              inverse(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(c * nodes + m)));
  return texels;
}

}  // namespace

struct DeviceCycle::Level : GridLevel {
  DeviceGrid device;
  DeviceTexels right, step, x[2];

  /// `Grid` and `Fixed` as GridLevel takes them.
  template <typename Grid, typename Fixed>
  Level(gpu::Context& context, const char* name, Grid&& g, double poisson, Fixed&& f)
      : GridLevel(std::forward<Grid>(g), poisson, std::forward<Fixed>(f)),
        device(context, name, stiffness, fixed),
        right(device.single_vector(context, "forward right side")),
        step(device.single_vector(context, "forward step")),
        x{device.single_vector(context, "forward correction"),
          device.single_vector(context, "forward next correction")} {}
  uint64_t bytes() const {
    return device.bytes() + right.buffer.bytes() + step.buffer.bytes() + x[0].buffer.bytes() +
           x[1].buffer.bytes() + own_bytes();
  }
};

std::string DeviceCycle::refusal(const CellGrid& grid) {
  if (grid.slit) return "a pad that slides";
  std::array<uint32_t, 3> cells = grid.cells;
  // As halve() does.
  while (std::ranges::all_of(cells, [](uint32_t n) { return n % 2 == 0 && n >= 4; }))
    for (uint32_t& n : cells) n /= 2;
  const auto text = [](const std::array<uint32_t, 3>& n) {
    return std::to_string(n[0]) + " x " + std::to_string(n[1]) + " x " + std::to_string(n[2]);
  };
  if (cells == grid.cells) return "a grid of " + text(cells) + " cells, too small or odd to be halved";
  const size_t unknowns = 3 * size_t{cells[0] + 1} * (cells[1] + 1) * (cells[2] + 1);
  if (unknowns <= kMostCoarse) return {};
  return "a coarsest grid of " + text(cells) + " cells with " + std::to_string(unknowns) +
         " unknowns, more than " + std::to_string(kMostCoarse);
}

DeviceCycle::DeviceCycle(gpu::Context& context, const CellGrid& grid, double poisson, const FixedNodes& fixed,
                         std::shared_ptr<const Kernels> kernels) {
  if (const std::string why = refusal(grid); !why.empty())
    throw Error(Failure::Usage, "cells that can be halved to a small grid on the device", why,
                "64x64x32 or another power of two times 1 or 3, or --solver processor");
  levels_.push_back(std::make_unique<Level>(context, "forward", grid, poisson, fixed));
  while (std::optional<CellGrid> half = halve(levels_.back()->grid)) {
    FixedNodes half_fixed = halve(levels_.back()->grid, *half, levels_.back()->fixed);
    levels_.push_back(
        std::make_unique<Level>(context, "forward coarse", std::move(*half), poisson, std::move(half_fixed)));
  }
  const Level& coarse = *levels_.back();
  const std::vector<float> dense = dense_inverse(coarse.stiffness, coarse.fixed);
  dense_ = DeviceTexels(context, "forward coarsest inverse", dense.size() * sizeof(float),
                        VK_FORMAT_R32G32B32A32_SFLOAT, dense);
  const bool layered = finest().layered();
  kernels_ = kernels && (kernels->layered || !layered) ? std::move(kernels)
                                                       : std::make_shared<Kernels>(context, layered);
}

DeviceCycle::~DeviceCycle() = default;

const DeviceGrid& DeviceCycle::finest() const {
  return levels_.front()->device;
}
const DeviceTexels& DeviceCycle::right() const {
  return levels_.front()->right;
}
const DeviceTexels& DeviceCycle::correction() const {
  return levels_.front()->x[0];
}
const DeviceTexels& DeviceCycle::residual() const {
  return levels_.front()->x[1];
}

uint64_t DeviceCycle::bytes() const {
  uint64_t sum = dense_.buffer.bytes();
  for (const auto& level : levels_) sum += level->bytes();
  return sum;
}

void DeviceCycle::smooth(gpu::Commands& commands, size_t index, int first, const DeviceTexels* sums) const {
  const Level& v = *levels_[index];
  const auto end = static_cast<int>(v.steps.size());
  // One step leads from either x to the other.
  int from = (end - first) % 2;
  for (int s = first; s < end; ++s, from = 1 - from) {
    const bool last = s + 1 == end, dot = last && sums != nullptr;
    const gpu::Kernel& kernel = s == 0  ? kernels_->fresh_step
                                : !last ? kernels_->step
                                : dot   ? kernels_->last_step_dot
                                        : kernels_->last_step;
    std::vector<gpu::Argument> arguments = {
        &v.x[from].texels, &v.device.moduli().texels,  &v.device.layers().texels,
        &v.right.texels,   &v.device.inverse().texels, &v.step.texels,
        &v.step.buffer,    &v.x[1 - from].buffer};
    if (dot) arguments.emplace_back(&sums->buffer);
    const shared::ForwardStepPush push =
        v.device.step_push(v.steps[static_cast<size_t>(s)].keep, v.steps[static_cast<size_t>(s)].gain);
    commands.dispatch(kernel, arguments, &push, v.device.product_groups());
    commands.barrier();
  }
}

void DeviceCycle::residual_of(gpu::Commands& commands, const Level& v) const {
  commands.dispatch(kernels_->residual,
                    {&v.x[0].texels, &v.device.moduli().texels, &v.device.layers().texels, &v.right.texels,
                     &v.device.inverse().texels, &v.x[1].buffer},
                    v.device.step_push(0, 0), v.device.product_groups());
  commands.barrier();
}

void DeviceCycle::cycle(gpu::Commands& commands, size_t index, const DeviceTexels& sums) const {
  const Level& v = *levels_[index];
  if (index + 1 == levels_.size()) {
    commands.dispatch(kernels_->coarsest, {&v.right.texels, &dense_.texels, &v.x[0].buffer},
                      v.device.nodes_push(0), v.device.node_groups());
    commands.barrier();
    return;
  }
  const Level& coarse = *levels_[index + 1];
  const size_t count = v.steps.size();
  commands.dispatch(
      kernels_->first,
      {&v.right.texels, &v.device.inverse().texels, &v.step.buffer, &v.x[(count - 1) % 2].buffer},
      v.device.nodes_push(v.steps.front().gain), v.device.node_groups());
  commands.barrier();
  smooth(commands, index, 1, nullptr);
  residual_of(commands, v);
  const shared::ForwardTransferPush transfer = {
      v.device.row(),      v.device.plane(),      v.device.nodes(),      v.device.lead(),
      coarse.device.row(), coarse.device.plane(), coarse.device.nodes(), coarse.device.lead()};
  commands.dispatch(
      kernels_->restriction,
      {&v.x[1].texels, &v.device.layers().texels, &coarse.device.inverse().texels, &coarse.right.buffer},
      transfer, coarse.device.node_groups());
  commands.barrier();
  cycle(commands, index + 1, sums);
  commands.dispatch(kernels_->prolongation,
                    {&coarse.x[0].texels, &v.device.layers().texels, &v.device.inverse().texels,
                     &v.x[0].texels, &v.x[count % 2].buffer},
                    transfer, v.device.node_groups());
  commands.barrier();
  smooth(commands, index, 0, index == 0 ? &sums : nullptr);
}

void DeviceCycle::record_residual(gpu::Commands& commands) const {
  residual_of(commands, *levels_.front());
}

void DeviceCycle::record(gpu::Commands& commands, const DeviceTexels& sums) const {
  cycle(commands, 0, sums);
}

}  // namespace palpate::fem
