#include "perf/profile/gpu_solvers.h"

#include <algorithm>

#include "engine/gpu/context.h"
#include "engine/gpu/tuning.h"
#include "engine/stages/frame/contact.h"

namespace palpate::perf {
namespace {

void run(gpu::Commands& commands) {
  commands.submit();
  commands.wait();
}

size_t pitch_of(const Grid& grid) {
  return size_t{grid.pitch} * 4;
}

}  // namespace

GpuSlopes::GpuSlopes(gpu::Context& context, const FrameSize& size)
    : size_(size),
      grid_(grid_for(size.width_px, size.height_px)),
      x_(context, "d/dx", grid_),
      y_(context, "d/dy", grid_),
      up_x_(context, "d/dx upload", grid_.bytes(), gpu::Memory::Upload),
      up_y_(context, "d/dy upload", grid_.bytes(), gpu::Memory::Upload),
      load_(context) {
  load_.begin();
  load_.copy(up_x_, x_.buffer, grid_.bytes());
  load_.copy(up_y_, y_.buffer, grid_.bytes());
  load_.barrier();
  load_.end();
}

void GpuSlopes::load(const Truth& truth) {
  const std::span<float> x = up_x_.as<float>(), y = up_y_.as<float>();
  std::fill(x.begin(), x.end(), 0.0f);
  std::fill(y.begin(), y.end(), 0.0f);
  for (size_t row = 0; row < size_.height_px; ++row) {
    for (size_t column = 0; column < size_.width_px; ++column) {
      const size_t from = 2 * (row * size_.width_px + column), to = row * pitch_of(grid_) + column;
      x[to] = truth.gradients[from];
      y[to] = truth.gradients[from + 1];
    }
  }
  up_x_.flush();
  up_y_.flush();
  run(load_);
}

GpuHeights::GpuHeights(gpu::Context& context, const GpuSlopes& slopes)
    : slopes_(slopes),
      map_(context, "heights", slopes.grid()),
      staging_(context, "heights readback", slopes.grid().bytes(), gpu::Memory::Readback),
      read_(context) {
  read_.begin();
  read_.copy(map_.buffer, staging_, slopes.grid().bytes());
  read_.host_barrier();
  read_.end();
}

SurfaceErrors GpuHeights::errors(const Truth& truth) {
  run(read_);
  staging_.invalidate();
  const auto z = staging_.as<const float>();
  const size_t pitch = pitch_of(slopes_.grid());
  return errors_of(truth, slopes_.size(), [&](uint32_t x, uint32_t y) { return z[y * pitch + x]; });
}

MultigridSolver::MultigridSolver(gpu::Context& context, const GpuSlopes& slopes, Solve solve)
    : slopes_(slopes),
      surface_(context, slopes.size().width_px, slopes.size().height_px, solve, load_tuning(context).tuning),
      slope_(context, slopes.size().width_px, slopes.size().height_px, surface_.right_sides(),
             load_tuning(context).tuning),
      heights_(context, slopes),
      prepare_(context),
      solve_(context),
      read_right_(context) {
  prepare_.begin();
  slope_.record_given(prepare_, slopes.x(), slopes.y(), surface_);
  prepare_.end();
  solve_.begin();
  surface_.record(solve_, heights_.map());
  solve_.end();
  if (surface_.right_sides() != RightSides::Pixels) return;
  right_ = gpu::DeviceBuffer(context, "right side readback", slopes.grid().bytes(), gpu::Memory::Readback);
  read_right_.begin();
  read_right_.copy(surface_.right_side().buffer, right_, slopes.grid().bytes());
  read_right_.host_barrier();
  read_right_.end();
}

void MultigridSolver::prepare() {
  run(prepare_);
}

void MultigridSolver::solve() {
  run(solve_);
}

SurfaceErrors MultigridSolver::errors(const Truth& truth) {
  prepare();
  solve();
  return heights_.errors(truth);
}

std::vector<float> MultigridSolver::right_side() {
  run(read_right_);
  right_.invalidate();
  const auto f = right_.as<const float>();
  const FrameSize& size = slopes_.size();
  std::vector<float> rows(size_t{size.width_px} * size.height_px);
  for (size_t y = 0; y < size.height_px; ++y) {
    const auto row = f.subspan(y * pitch_of(slopes_.grid()), size.width_px);
    std::copy(row.begin(), row.end(), rows.begin() + static_cast<std::ptrdiff_t>(y * size.width_px));
  }
  return rows;
}

WeightedSolver::WeightedSolver(gpu::Context& context, const GpuSlopes& slopes, uint32_t iterations)
    : slopes_(slopes),
      surface_(context, slopes.size().width_px, slopes.size().height_px, 1.0, iterations),
      heights_(context, slopes),
      ones_(context, "weights of one", slopes.grid().bytes(), gpu::Memory::Upload),
      scalars_(context, "evidence", WeightedSurface::scalar_bytes(), gpu::Memory::Readback),
      solve_(context) {
  const auto ones = ones_.as<float>();
  std::fill(ones.begin(), ones.end(), 1.0f);
  ones_.flush();
  const uint64_t bytes = slopes.grid().bytes();
  solve_.begin();
  solve_.copy(slopes_.x().buffer, surface_.slope_x().buffer, bytes);
  solve_.copy(slopes_.y().buffer, surface_.slope_y().buffer, bytes);
  solve_.copy(ones_, surface_.weights().buffer, bytes);
  solve_.barrier();
  surface_.record(solve_, heights_.map(), scalars_);
  solve_.end();
}

void WeightedSolver::solve() {
  run(solve_);
}

}  // namespace palpate::perf
