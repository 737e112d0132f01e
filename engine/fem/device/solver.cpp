#include "engine/fem/device/solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <span>
#include <utility>

#include "engine/gpu/context.h"
#include "palpate/error.h"

namespace palpate::fem {
namespace {

/// Iterations of one submission while many are to come.
constexpr uint32_t kBatch = 4;
constexpr uint32_t kGroup = DeviceGrid::kWorkgroup;

}  // namespace

std::string DeviceSolver::refusal(const gpu::Context& context, const CellGrid& grid) {
  if (!context.has_double()) return context.report().name + " without double precision (shaderFloat64)";
  return DeviceCycle::refusal(grid);
}

namespace {
gpu::Context& checked(gpu::Context& context, const CellGrid& grid) {
  if (const std::string why = DeviceSolver::refusal(context, grid); !why.empty())
    throw Error(Failure::Device, "a device and a grid that go together", why, "--solver processor");
  return context;
}
}  // namespace

DeviceSolver::DeviceSolver(gpu::Context& context, const CellGrid& grid, double poisson, FixedNodes fixed,
                           std::shared_ptr<const Kernels> kernels)
    : context_(checked(context, grid)),
      fixed_(std::move(fixed)),
      cycle_(context, grid, poisson, fixed_, std::move(kernels)) {
  const DeviceGrid& g = cycle_.finest();
  displacement_ = g.wide_vector(context, "forward displacement");
  load_ = g.wide_vector(context, "forward load");
  residual_ = g.wide_vector(context, "forward residual");
  direction_ = g.wide_vector(context, "forward direction");
  product_ = g.wide_vector(context, "forward product");
  const uint32_t sums = std::max(cycle_.product_sums(), g.vector_groups()[0] * kGroup);
  sums_ = DeviceTexels(context, "forward sums", uint64_t{sums} * 16, VK_FORMAT_R32G32B32A32_UINT);
  scalars_ =
      gpu::DeviceBuffer(context, "forward scalars", sizeof(shared::ForwardScalars), gpu::Memory::Readback);
  if (!displacement_.buffer.mapped()) {
    upload_ = gpu::DeviceBuffer(context, "forward upload", displacement_.buffer.bytes(), gpu::Memory::Upload);
    readback_ =
        gpu::DeviceBuffer(context, "forward readback", displacement_.buffer.bytes(), gpu::Memory::Readback);
  }

  const auto record = [&](gpu::Commands& commands, const char* name, auto&& body) {
    commands = gpu::Commands(context);
    commands.begin();
    {
      const auto scope = commands.scope(name);
      body();
    }
    commands.host_barrier();
    commands.end();
  };
  record(balance_, "forward balance", [&] {
    balance_.dispatch(cycle_.kernels()->balance,
                      {&displacement_.texels, &g.moduli().texels, &g.wide_layers().texels,
                       &g.inverse().texels, &residual_.buffer, &sums_.buffer, &load_.texels},
                      g.wide_push(), g.product_groups());
    balance_.barrier();
    record_scalars(balance_, shared::kForwardBalance, cycle_.product_sums());
    balance_.dispatch(cycle_.kernels()->narrow, {&scalars_, &residual_.texels, &cycle_.right().buffer},
                      g.nodes_push(0), g.vector_groups());
    balance_.barrier();
  });
  record(iteration_, "forward iteration", [&] { record_iteration(iteration_); });
  record(iterations_, "forward iterations", [&] {
    for (uint32_t i = 0; i < kBatch; ++i) record_iteration(iterations_);
  });
  record(single_, "forward product", [&] { cycle_.record_residual(single_); });
  record(wide_, "forward wide product", [&] { record_product(wide_); });
  record(precondition_, "forward cycle", [&] { cycle_.record(precondition_, sums_); });
  transfer_ = gpu::Commands(context);
}

void DeviceSolver::record_scalars(gpu::Commands& commands, uint32_t stage, uint32_t sums) const {
  commands.dispatch(cycle_.kernels()->scalars, {&sums_.texels, &scalars_},
                    shared::ForwardScalarPush{stage, sums, 3 * cycle_.finest().nodes()}, {1, 1, 1});
  commands.barrier();
}

void DeviceSolver::record_product(gpu::Commands& commands) const {
  const DeviceGrid& g = cycle_.finest();
  commands.dispatch(cycle_.kernels()->product,
                    {&direction_.texels, &g.moduli().texels, &g.wide_layers().texels, &g.inverse().texels,
                     &product_.buffer, &sums_.buffer},
                    g.wide_push(), g.product_groups());
  commands.barrier();
}

void DeviceSolver::record_iteration(gpu::Commands& commands) const {
  const DeviceGrid& g = cycle_.finest();
  const std::array<uint32_t, 3> groups = g.vector_groups();
  cycle_.record(commands, sums_);
  record_scalars(commands, shared::kForwardDirection, cycle_.product_sums());
  commands.dispatch(cycle_.kernels()->direction,
                    {&scalars_, &cycle_.correction().texels, &direction_.texels, &direction_.buffer},
                    g.nodes_push(0), groups);
  commands.barrier();
  record_product(commands);
  record_scalars(commands, shared::kForwardLength, cycle_.product_sums());
  commands.dispatch(
      cycle_.kernels()->advance,
      {&scalars_, &residual_.texels, &cycle_.right().buffer, &direction_.texels, &product_.texels,
       &displacement_.texels, &residual_.buffer, &displacement_.buffer, &sums_.buffer},
      g.nodes_push(0), groups);
  commands.barrier();
  record_scalars(commands, shared::kForwardLeft, g.vector_groups()[0] * kGroup);
}

namespace {

// Structure of arrays on the host, an array of four (x, y, z, spare) on the device.
template <typename Real>
void interleave(const Real* values, size_t nodes, size_t lead, std::span<Real> to) {
  for (size_t n = 0; n < nodes; ++n)
    for (size_t c = 0; c < 3; ++c) to[4 * (lead + n) + c] = values[c * nodes + n];
}
template <typename Real>
void separate(std::span<const Real> from, size_t nodes, size_t lead, Real* values) {
  for (size_t n = 0; n < nodes; ++n)
    for (size_t c = 0; c < 3; ++c) values[c * nodes + n] = from[4 * (lead + n) + c];
}

}  // namespace

template <typename Real>
void DeviceSolver::write_as(const DeviceTexels& to, const Real* values) {
  const DeviceGrid& g = cycle_.finest();
  const gpu::DeviceBuffer& host = to.buffer.mapped() ? to.buffer : upload_;
  if (!to.buffer.mapped()) gpu::clear(context_, upload_);  // lead and tail stay finite
  interleave(values, g.nodes(), g.lead(), host.as<Real>());
  host.flush();
  if (!to.buffer.mapped()) move(upload_, to.buffer, to.buffer.bytes());
}

template <typename Real>
void DeviceSolver::read_as(const DeviceTexels& from, Real* values) {
  const DeviceGrid& g = cycle_.finest();
  if (!from.buffer.mapped()) move(from.buffer, readback_, from.buffer.bytes());
  const gpu::DeviceBuffer& host = from.buffer.mapped() ? from.buffer : readback_;
  host.invalidate();
  separate(std::span<const Real>(host.as<Real>()), g.nodes(), g.lead(), values);
}

void DeviceSolver::move(const gpu::DeviceBuffer& from, const gpu::DeviceBuffer& to, uint64_t bytes) {
  transfer_.begin();
  transfer_.copy(from, to, bytes);
  transfer_.barrier();
  transfer_.host_barrier();
  transfer_.end();
  transfer_.submit();
  transfer_.wait();
}

SolveStatistics DeviceSolver::solve(const std::vector<double>& load, std::vector<double>& displacement,
                                    double residual, uint32_t most_iterations) {
  write_as(load_, load.data());
  write_as(displacement_, displacement.data());
  shared::ForwardScalars& s = scalars_.as<shared::ForwardScalars>()[0];
  s = {};
  s.wanted = residual;
  s.most = most_iterations;
  scalars_.flush();

  SolveStatistics statistics;
  for (int round = 0;; ++round) {
    submit(balance_);
    statistics.iterations = s.iterations;
    statistics.residual = s.all_forces == 0 ? 0 : s.left / s.all_forces;
    statistics.converged = statistics.residual <= residual;
    if (statistics.converged || round == kMostRounds || statistics.iterations >= most_iterations) break;
    while (s.done == 0) {
      const double before = s.left;
      const uint32_t at = s.iterations;
      submit(iteration_);
      // As many at once as its pace lets expect.
      double pace = s.left / before;
      while (s.done == 0 && pace < 1 && most_iterations - s.iterations >= kBatch &&
             s.left * std::pow(pace, kBatch) > residual * s.all_forces) {
        submit(iterations_);
        pace = std::pow(s.left / before, 1.0 / std::max(1u, s.iterations - at));
      }
    }
  }
  read_as(displacement_, displacement.data());
  return statistics;
}

void DeviceSolver::submit(gpu::Commands& commands) const {
  commands.submit();
  commands.wait();
  scalars_.invalidate();
}

void DeviceSolver::run(Piece piece) const {
  switch (piece) {
    case Piece::Product:
      return submit(single_);
    case Piece::WideProduct:
      return submit(wide_);
    case Piece::Cycle:
      return submit(precondition_);
    case Piece::Iteration:
      return submit(iteration_);
  }
}

void DeviceSolver::apply(const float* displacement, float* force) {
  gpu::clear(context_, cycle_.right().buffer);
  write_as(cycle_.correction(), displacement);
  submit(single_);
  read_as(cycle_.residual(), force);
  std::transform(force, force + 3 * size_t{cycle_.finest().nodes()}, force, std::negate<>());
}

void DeviceSolver::apply(const double* displacement, double* force) {
  write_as(direction_, displacement);
  submit(wide_);
  read_as(product_, force);
}

void DeviceSolver::precondition(const float* residual, float* correction) {
  write_as(cycle_.right(), residual);
  submit(precondition_);
  read_as(cycle_.correction(), correction);
}

uint64_t DeviceSolver::bytes() const {
  uint64_t sum = cycle_.bytes() + sums_.buffer.bytes() + upload_.bytes() + readback_.bytes() + fixed_.size();
  for (const DeviceTexels* v : {&displacement_, &load_, &residual_, &direction_, &product_})
    sum += v->buffer.bytes();
  return sum;
}

}  // namespace palpate::fem
