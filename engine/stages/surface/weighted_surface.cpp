#include "engine/stages/surface/weighted_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/numeric/jacobi_weights.h"
#include "engine/stages/workgroups.h"
#include "shaders/weighted_coarsen.spv.h"
#include "shaders/weighted_coarsest.spv.h"
#include "shaders/weighted_direction.spv.h"
#include "shaders/weighted_faces.spv.h"
#include "shaders/weighted_fill.spv.h"
#include "shaders/weighted_fill_residual.spv.h"
#include "shaders/weighted_restrict.spv.h"
#include "shaders/weighted_scalars.spv.h"
#include "shaders/weighted_start.spv.h"
#include "shaders/weighted_step.spv.h"
#include "shaders/weighted_sweep_correct.spv.h"
#include "shaders/weighted_sweep_present.spv.h"
#include "shaders/weighted_sweep_zero.spv.h"

namespace palpate {
namespace {

constexpr uint32_t kRowsOnCpu = 16, kRowsOnGpu = 4;
// The coarsest level is one invocation's work; where a dispatch costs more than its arithmetic a larger one
// pays.
constexpr uint32_t kCoarsestOnCpu = 24, kCoarsestOnGpu = 8;
constexpr uint32_t kSweepsOnCpu = 6, kSweepsOnGpu = 3;

}  // namespace

WeightedSurface::WeightedSurface(gpu::Context& context, uint32_t width, uint32_t height,
                                 double scale_mm_per_px, uint32_t iterations)
    : iterations_(iterations),
      rows_(context.is_software() ? kRowsOnCpu : kRowsOnGpu),
      scale_(static_cast<float>(scale_mm_per_px)) {
  make(context, grid_for(width, height));
}

WeightedSurface::WeightedSurface(gpu::Context& context, const Grid& cells, uint32_t field_sums,
                                 uint32_t iterations)
    : iterations_(iterations),
      field_sums_(field_sums),
      rows_(context.is_software() ? kRowsOnCpu : kRowsOnGpu) {
  make(context, cells);
}

void WeightedSurface::make(gpu::Context& context, const Grid& finest) {
  const uint64_t most = context.is_software() ? kCoarsestOnCpu : kCoarsestOnGpu;
  for (Grid grid = finest;; grid = coarser(grid)) {
    const std::string name = "weighted level " + std::to_string(levels_.size());
    Level level;
    level.grid = grid;
    level.across = FloatMap(context, name + " right faces", grid);
    level.down = FloatMap(context, name + " lower faces", grid);
    level.right = FloatMap(context, name + " right side", grid);
    level.x[0] = FloatMap(context, name + " solution", grid);
    level.x[1] = FloatMap(context, name + " next solution", grid);
    levels_.push_back(std::move(level));
    if (uint64_t{grid.width} * grid.height <= most) break;
  }
  direction_[0] = FloatMap(context, "search direction", finest);
  direction_[1] = FloatMap(context, "next search direction", finest);
  applied_ = FloatMap(context, "applied direction", finest);
  // At least the four that the coarsest kernel leaves.
  if (field_sums_ == 0) field_sums_ = strips(finest, 1, rows_);
  const uint64_t sums = sizeof(float) * std::max({field_sums_, strips(finest, 2, rows_), 4u});
  const auto partial = [&](const char* name, gpu::DeviceBuffer& buffer, gpu::TexelView& words) {
    buffer = gpu::DeviceBuffer(context, name, sums, gpu::Memory::Device);
    words = gpu::TexelView(context, buffer, VK_FORMAT_R32_SFLOAT);
  };
  partial("weighted field sums", field_, field_words_);
  partial("weighted products", dots_, dot_words_);
  partial("weighted squares", squares_, square_words_);
  make_kernels(context);
}

void WeightedSurface::make_kernels(gpu::Context& context) {
  using enum gpu::Binding;
  const auto make = [&](const gpu::Shader& shader, std::vector<gpu::Binding> bindings,
                        std::vector<uint32_t> constants) {
    return gpu::Kernel(
        context, shader,
        {std::move(bindings), sizeof(shared::WeightedPush), {kWorkgroup, 1, 1}, std::move(constants)});
  };
  const std::vector<uint32_t> rows{rows_};
  faces_ = make({"weighted_faces", k_weighted_faces},
                {Texels, Texels, Texels, Storage, Storage, Storage, Storage}, rows);
  coarsen_ = make({"weighted_coarsen", k_weighted_coarsen}, {Texels, Texels, Storage, Storage}, {});
  sweep_zero_ = make({"weighted_sweep_zero", k_weighted_sweep_zero},
                     {Texels, Texels, Texels, Texels, Texels, Texels, Storage}, rows);
  sweep_correct_ = make({"weighted_sweep_correct", k_weighted_sweep_correct},
                        {Texels, Texels, Texels, Texels, Texels, Texels, Texels, Storage}, rows);
  sweep_present_ = make({"weighted_sweep_present", k_weighted_sweep_present},
                        {Texels, Texels, Texels, Texels, Texels, Texels, Storage, Storage}, rows);
  restrict_ = make({"weighted_restrict", k_weighted_restrict},
                   {Texels, Texels, Texels, Texels, Texels, Texels, Storage}, {rows_ / 2});
  coarsest_ = make({"weighted_coarsest", k_weighted_coarsest}, {Texels, Texels, Texels, Storage, Storage},
                   {context.is_software() ? kSweepsOnCpu : kSweepsOnGpu});
  direction_kernel_ = make(
      {"weighted_direction", k_weighted_direction},
      {Texels, Texels, Texels, Texels, Texels, Texels, Texels, Storage, Storage, Storage, Storage}, rows);
  start_ = make({"weighted_start", k_weighted_start}, {Texels, Storage, Storage}, rows);
  step_ = make({"weighted_step", k_weighted_step},
               {Texels, Texels, Texels, Texels, Storage, Storage, Storage, Storage}, rows);
  fill_residual_ = make({"weighted_fill_residual", k_weighted_fill_residual},
                        {Texels, Texels, Texels, Texels, Texels, Storage}, rows);
  fill_ = make({"weighted_fill", k_weighted_fill}, {Texels, Texels, Texels, Texels, Texels, Storage}, rows);
  scalars_ = gpu::Kernel(
      context, {"weighted_scalars", k_weighted_scalars},
      {{Texels, Texels, Storage}, sizeof(shared::WeightedScalarPush), {kWorkgroup, 1, 1}, {kWorkgroup}});
}

shared::WeightedPush WeightedSurface::push(uint32_t level) const {
  const Grid& fine = levels_[level].grid;
  const Grid& coarse = levels_[std::min<size_t>(level + 1, levels_.size() - 1)].grid;
  return {fine.width, fine.height, fine.pitch, coarse.width, coarse.height, coarse.pitch,
          // In one order on the way down and the other on the way up: the cycle is symmetric, as conjugate
          // gradients need it.
          static_cast<float>(1 / jacobi::kLowerRoot), static_cast<float>(1 / jacobi::kUpperRoot), scale_};
}

// Invocations that cover a level, `columns` texels wide and `rows` rows high each.
uint32_t WeightedSurface::strips(const Grid& grid, uint32_t columns, uint32_t rows) const {
  return divide_up(grid.pitch, columns) * (divide_up(grid.height, rows));
}

// One V(2,2) cycle from zero; the result is in x[0].
void WeightedSurface::cycle(gpu::Commands& commands, uint32_t l) const {
  const Level& v = levels_[l];
  const shared::WeightedPush p = push(l);
  if (l + 1 == levels_.size()) {
    commands.dispatch(coarsest_, {&v.across.words, &v.down.words, &v.right.words, &v.x[0].buffer, &dots_}, p,
                      {1, 1, 1});
    commands.barrier();
    return;
  }
  const Level& coarse = levels_[l + 1];
  const auto whole = workgroups(strips(v.grid, 2, rows_));
  commands.dispatch(sweep_zero_,
                    {&v.across.texels, &v.across.words, &v.down.texels, &v.right.texels, &v.right.words,
                     &v.down.words, &v.x[0].buffer},
                    p, whole);
  commands.barrier();
  commands.dispatch(restrict_,
                    {&v.across.texels, &v.across.words, &v.down.texels, &v.right.texels, &v.x[0].texels,
                     &v.x[0].words, &coarse.right.buffer},
                    p, workgroups(strips(coarse.grid, 1, rows_ / 2)));
  commands.barrier();
  cycle(commands, l + 1);
  commands.dispatch(sweep_correct_,
                    {&v.across.texels, &v.across.words, &v.down.texels, &v.right.texels, &v.x[0].texels,
                     &v.x[0].words, &coarse.x[0].words, &v.x[1].buffer},
                    p, whole);
  commands.barrier();
  commands.dispatch(sweep_present_,
                    {&v.across.texels, &v.across.words, &v.down.texels, &v.right.texels, &v.x[1].texels,
                     &v.x[1].words, &v.x[0].buffer, &dots_},
                    p, whole);
  commands.barrier();
}

void WeightedSurface::scalars(gpu::Commands& commands, uint32_t stage,
                              const gpu::DeviceBuffer& scalars) const {
  const Grid& grid = levels_.front().grid;
  const bool start = stage == shared::kScalarStart;
  commands.dispatch(scalars_, {start ? &field_words_ : &dot_words_, &square_words_, &scalars},
                    shared::WeightedScalarPush{stage, start ? field_sums_ : strips(grid, 2, rows_),
                                               strips(grid, 2, rows_), kWeightedTolerance},
                    {1, 1, 1});
  commands.barrier();
}

void WeightedSurface::solve(gpu::Commands& commands, const FloatMap& depth,
                            const gpu::DeviceBuffer& s) const {
  const Level& v = levels_.front();
  const shared::WeightedPush p = push(0);
  const auto whole = workgroups(strips(v.grid, 2, rows_));
  commands.dispatch(start_, {&v.right.texels, &depth.buffer, &squares_}, p, whole);
  commands.barrier();
  scalars(commands, shared::kScalarStart, s);
  for (uint32_t i = 0; i < iterations_; ++i) {
    const FloatMap &last = direction_[i % 2], &next = direction_[1 - i % 2];
    cycle(commands, 0);
    scalars(commands, shared::kScalarDirection, s);
    commands.dispatch(direction_kernel_,
                      {&v.across.texels, &v.across.words, &v.down.texels, &v.x[0].texels, &v.x[0].words,
                       &last.texels, &last.words, &s, &next.buffer, &applied_.buffer, &dots_},
                      p, whole);
    commands.barrier();
    scalars(commands, shared::kScalarLength, s);
    commands.dispatch(step_,
                      {&v.right.texels, &depth.texels, &next.texels, &applied_.texels, &s, &depth.buffer,
                       &v.right.buffer, &squares_},
                      p, whole);
    commands.barrier();
  }
  scalars(commands, shared::kScalarFinish, s);
}

void WeightedSurface::record_fill(gpu::Commands& commands, const FloatMap& depth) const {
  const auto scope = commands.scope("weighted fill");
  const Level& v = levels_.front();
  const auto whole = workgroups(strips(v.grid, 2, rows_));
  commands.dispatch(
      fill_residual_,
      {&v.across.texels, &v.across.words, &v.down.texels, &depth.texels, &depth.words, &v.right.buffer},
      push(0), whole);
  commands.barrier();
  cycle(commands, 0);
  commands.dispatch(
      fill_,
      {&v.across.texels, &v.across.words, &v.down.texels, &depth.texels, &v.x[0].texels, &depth.buffer},
      push(0), whole);
  commands.barrier();
}

void WeightedSurface::coarsen(gpu::Commands& commands) const {
  for (uint32_t l = 0; l + 1 < levels_.size(); ++l) {
    const Level &fine = levels_[l], &coarse = levels_[l + 1];
    commands.dispatch(coarsen_,
                      {&fine.across.texels, &fine.down.texels, &coarse.across.buffer, &coarse.down.buffer},
                      push(l), workgroups(coarse.grid.pitch * coarse.grid.height));
    commands.barrier();
  }
}

void WeightedSurface::record(gpu::Commands& commands, const FloatMap& depth,
                             const gpu::DeviceBuffer& s) const {
  const auto scope = commands.scope("weighted surface");
  record_right_side(commands, right_side());
  coarsen(commands);
  solve(commands, depth, s);
}

void WeightedSurface::record_right_side(gpu::Commands& commands, const FloatMap& right) const {
  const Level& finest = levels_.front();
  commands.dispatch(faces_,
                    {&slope_x().texels, &slope_y().texels, &weights().texels, &finest.across.buffer,
                     &finest.down.buffer, &right.buffer, &field_},
                    push(0), workgroups(strips(finest.grid, 1, rows_)));
  commands.barrier();
}

void WeightedSurface::record_given(gpu::Commands& commands, const FloatMap& depth,
                                   const gpu::DeviceBuffer& s) const {
  const auto scope = commands.scope("weighted surface");
  coarsen(commands);
  solve(commands, depth, s);
}

void WeightedSurface::record_again(gpu::Commands& commands, const FloatMap& depth,
                                   const gpu::DeviceBuffer& s) const {
  const auto scope = commands.scope("weighted correction");
  solve(commands, depth, s);
}

WeightedStatistics WeightedSurface::statistics(const gpu::DeviceBuffer& buffer) {
  buffer.invalidate();
  const shared::WeightedScalars& s = buffer.as<const shared::WeightedScalars>()[0];
  WeightedStatistics e;
  e.residual = s.right2 > 0 ? std::sqrt(double{s.residual2} / double{s.right2}) : 0;
  e.unexplained = s.field2 > 0 ? std::sqrt(std::max(0.0, 1 - double{s.explained} / double{s.field2})) : 0;
  e.iterations = s.iterations;
  e.converged = s.converged != 0;
  return e;
}

uint64_t WeightedSurface::memory_bytes() const {
  uint64_t bytes = field_.bytes() + dots_.bytes() + squares_.bytes() + direction_[0].buffer.bytes() +
                   direction_[1].buffer.bytes() + applied_.buffer.bytes();
  for (const Level& level : levels_) {
    bytes += level.across.buffer.bytes() + level.down.buffer.bytes() + level.right.buffer.bytes() +
             level.x[0].buffer.bytes() + level.x[1].buffer.bytes();
  }
  return bytes;
}

}  // namespace palpate
