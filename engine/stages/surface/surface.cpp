#include "engine/stages/surface/surface.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "engine/base/divide_up.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/numeric/dense.h"
#include "engine/numeric/jacobi_weights.h"
#include "shaders/coarsest.spv.h"
#include "shaders/restrict.spv.h"
#include "shaders/shared/tile.h"

namespace palpate {
namespace {

// The finest levels of cells, each with a cycle of its own on the way up.
constexpr uint32_t kCycledLevels = 3;
// Where a part is solved: its sources are found anew with every third of the cycles, from heights that the
// two before have smoothed, and with the last.
constexpr uint32_t kCyclesOfSources = 3;

// The pseudo-inverse of A on a small grid, in the padded order of the level's buffer. A is symmetric and
// takes nothing but the constant to 0, so A + 1 1^T / n is invertible, and its inverse differs from the
// pseudo-inverse by 1 1^T / n.
template <typename Level>
std::vector<float> pseudo_inverse(const Level& level) {
  const Grid& g = level.grid;
  const Eigen::Index n = Eigen::Index{g.width} * g.height;
  Eigen::MatrixXd a = Eigen::MatrixXd::Constant(n, n, 1.0 / static_cast<double>(n));
  const auto couple = [&](Eigen::Index i, Eigen::Index j, double strength) {
    a(i, i) += strength;
    a(j, j) += strength;
    a(i, j) -= strength;
    a(j, i) -= strength;
  };
  for (uint32_t y = 0; y < g.height; ++y) {
    for (uint32_t x = 0; x < g.width; ++x) {
      const Eigen::Index here = Eigen::Index{y} * g.width + x;
      const double wide = x + 1 == g.width ? double{level.edge_width} : 1.0;
      const double high = y + 1 == g.height ? double{level.edge_height} : 1.0;
      if (x + 1 < g.width) {
        const double next = x + 2 == g.width ? double{level.edge_width} : 1.0;
        couple(here, here + 1, double{level.across} * high * 2 / (1 + next));
      }
      if (y + 1 < g.height) {
        const double next = y + 2 == g.height ? double{level.edge_height} : 1.0;
        couple(here, here + g.width, double{level.down} * wide * 2 / (1 + next));
      }
    }
  }
  const Eigen::MatrixXd inverse = dense::Cholesky(a).solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(n, n)));
  const size_t pitch = size_t{g.pitch} * 4, padded = pitch * g.height;
  const auto place = [&](Eigen::Index i) {
    return static_cast<size_t>(i / g.width) * pitch + static_cast<size_t>(i % g.width);
  };
  std::vector<float> out(padded * padded);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      out[place(i) * padded + place(j)] = static_cast<float>(inverse(i, j) - 1.0 / static_cast<double>(n));
  return out;
}

}  // namespace

// One solve being recorded: which of a level's two solutions is the present one.
struct Surface::Pass {
  const Surface& surface;
  gpu::Commands& commands;
  const FloatMap& depth;
  std::vector<uint32_t> present = std::vector<uint32_t>(surface.levels_.size(), 0);

  uint32_t last() const { return static_cast<uint32_t>(surface.levels_.size()) - 1; }
  const Level& level(uint32_t l) const { return surface.levels_[l]; }
  // Level 0 keeps its present solution in the caller's map or in the spare one.
  const FloatMap& x(uint32_t l, uint32_t which) const {
    return l > 0 || which > 0 ? level(l).x[which] : depth;
  }
  const FloatMap& x(uint32_t l) const { return x(l, present[l]); }
  const FloatMap& spare(uint32_t l) const { return x(l, 1 - present[l]); }
  void flip(uint32_t l) { present[l] = 1 - present[l]; }

  // Rows of a strip: long ones on big levels, short ones where threads are few.
  uint32_t rows(const Grid& grid) const {
    const Tuning& t = surface.tuning_;
    if (surface.tiled()) return 1;
    return uint64_t{grid.pitch} * grid.height >= t.surface_big_texels ? t.surface_rows_big
                                                                      : t.surface_rows_small;
  }

  shared::GridPush push(uint32_t l, const Grid& written) const {
    const Level& fine = level(l);
    const Grid& coarse = level(std::min(l + 1, last())).grid;
    const double diagonal = 2.0 * (double{fine.across} + double{fine.down});
    shared::GridPush p{};
    p.width = fine.grid.width;
    p.height = fine.grid.height;
    p.pitch = fine.grid.pitch;
    p.coarse_width = coarse.width;
    p.coarse_height = coarse.height;
    p.coarse_pitch = coarse.pitch;
    p.rows = rows(written);
    p.across = fine.across;
    p.down = fine.down;
    p.edge_width = fine.edge_width;
    p.edge_height = fine.edge_height;
    p.step0 = static_cast<float>(1 / (diagonal * jacobi::kLowerRoot));
    p.step1 = static_cast<float>(1 / (diagonal * jacobi::kUpperRoot));
    return p;
  }

  // An invocation writes columns of one texel, or of as many as it says.
  std::array<uint32_t, 3> groups(const Grid& written, uint32_t texels = 1) const {
    const uint32_t strips = (written.height + rows(written) - 1) / rows(written);
    const uint32_t columns = divide_up(written.pitch, texels);
    return {(columns * strips + workgroup() - 1) / workgroup(), 1, 1};
  }
  uint32_t workgroup() const { return surface.tiled() ? kSmallWorkgroup : surface.tuning_.surface_workgroup; }
  /// In tiles a workgroup owns one of the finer level.
  void dispatch_tiles(const gpu::Kernel& kernel, uint32_t l, std::initializer_list<gpu::Argument> arguments) {
    const Grid& grid = level(l).grid;
    commands.dispatch(
        kernel, arguments, push(l, grid),
        {divide_up(grid.width, shared::kTileWidth), divide_up(grid.height, shared::kTileHeight), 1});
    commands.barrier();
  }

  /// Fills the right sides of the next two levels.
  void restrict_right(uint32_t l) {
    const Grid& coarse = level(l + 1).grid;
    const bool both = l + 2 <= last();
    const FloatMap& coarser_right = both ? level(l + 2).right : surface.unused_coarse_;
    const Grid written = coarser(coarse);
    commands.dispatch(surface.restrict_,
                      {&level(l).right.texels, &level(l + 1).right.buffer, &coarser_right.buffer},
                      push(l, written), groups(written));
    commands.barrier();
  }
  void restrict_residual(uint32_t l) {
    if (surface.tiled())
      return dispatch_tiles(surface.restrict_residual_, l,
                            {&level(l).right.words, &x(l).words, &level(l + 1).right.buffer});
    const Grid& coarse = level(l + 1).grid;
    commands.dispatch(surface.restrict_residual_,
                      {&level(l).right.texels, &x(l).texels, &x(l).words, &level(l + 1).right.buffer},
                      push(l, coarse), groups(coarse));
    commands.barrier();
  }
  /// Sweeps from zero, and the coarser level's right side from what they leave.
  void descend(uint32_t l) {
    const Level& v = level(l);
    if (surface.tiled())
      return dispatch_tiles(surface.descend_, l, {&v.right.words, &x(l).buffer, &level(l + 1).right.buffer});
    const Grid& coarse = level(l + 1).grid;
    commands.dispatch(surface.descend_,
                      {&v.right.texels, &v.right.pairs, &x(l).buffer, &level(l + 1).right.buffer},
                      push(l, coarse), groups(coarse));
    commands.barrier();
  }
  /// Heights of the coarser level, interpolated and swept, and the coarser level's right side from what they
  /// leave. `corrected`: with what is still to be added to them of the level after theirs.
  void ascend(uint32_t l, bool corrected) {
    const Level& v = level(l);
    if (corrected)
      return dispatch_tiles(
          surface.ascend_corrected_, l,
          {&v.right.words, &x(l + 1).words, &x(l).buffer, &level(l + 1).right.buffer, &x(l + 2).words});
    if (surface.tiled())
      return dispatch_tiles(surface.ascend_, l,
                            {&v.right.words, &x(l + 1).words, &x(l).buffer, &level(l + 1).right.buffer});
    const Grid& coarse = level(l + 1).grid;
    commands.dispatch(
        surface.ascend_,
        {&v.right.texels, &v.right.pairs, &x(l + 1).texels, &x(l).buffer, &level(l + 1).right.buffer},
        push(l, coarse), groups(coarse));
    commands.barrier();
  }
  void interpolate(const FloatMap& cells, const FloatMap& pixels, bool corrected = false) {
    const Level& v = level(0);
    if (corrected)
      return dispatch_tiles(surface.interpolate_corrected_, 0, {&cells.words, &pixels.buffer, &x(2).words});
    if (surface.tiled()) return dispatch_tiles(surface.interpolate_, 0, {&cells.words, &pixels.buffer});
    commands.dispatch(surface.interpolate_, {&cells.texels, &cells.pairs, &pixels.buffer}, push(0, v.grid),
                      groups(v.grid, 2));
    commands.barrier();
  }
  void correct_and_smooth(uint32_t l) {
    const Level& v = level(l);
    if (surface.tiled()) {
      dispatch_tiles(surface.smooth_, l, {&x(l + 1).words, &x(l).words, &spare(l).buffer, &v.right.words});
    } else {
      commands.dispatch(surface.smooth_,
                        {&v.right.texels, &v.right.words, &x(l + 1).pairs, &x(l).texels, &spare(l).buffer},
                        push(l, v.grid), groups(v.grid));
      commands.barrier();
    }
    flip(l);
  }
  void correct(uint32_t l) {
    if (surface.tiled()) {
      dispatch_tiles(surface.correct_, l, {&x(l + 1).words, &x(l).words, &spare(l).buffer});
    } else {
      const Level& v = level(l);
      commands.dispatch(surface.correct_, {&x(l + 1).pairs, &x(l).texels, &spare(l).buffer}, push(l, v.grid),
                        groups(v.grid));
      commands.barrier();
    }
    flip(l);
  }
  void solve_coarsest() {
    const Level& v = level(last());
    const uint32_t texels = v.grid.pitch * v.grid.height;
    commands.dispatch(surface.coarsest_, {&surface.inverse_texels_, &v.right.texels, &x(last()).buffer},
                      shared::CoarsestPush{texels}, {(texels + workgroup() - 1) / workgroup(), 1, 1});
    commands.barrier();
  }

  /// The coarse levels in one workgroup: a full-multigrid pass, or a cycle from zero.
  void solve_coarse_levels(const gpu::Kernel& kernel) {
    const uint32_t first = surface.coarse_first_;
    shared::CoarsePush coarse{};
    coarse.count = last() - first + 1;
    coarse.pitch = level(first).grid.pitch;
    coarse.root0 = static_cast<float>(jacobi::kLowerRoot);
    coarse.root1 = static_cast<float>(jacobi::kUpperRoot);
    for (uint32_t i = 0; i < coarse.count; ++i) {
      const shared::GridPush p = push(first + i, level(first + i).grid);
      coarse.levels[i] = {p.width, p.height, p.across, p.down, p.edge_width, p.edge_height};
      if (first + i <= kCycledLevels) coarse.cycled |= 1u << i;
    }
    commands.dispatch(kernel, {&level(first).right.words, &surface.inverse_words_, &x(first).buffer}, coarse,
                      {1, 1, 1});
    commands.barrier();
  }

  /// A V(2,0) cycle from zero.
  void cycle(uint32_t l) {
    if (l == last()) return solve_coarsest();
    if (l == surface.coarse_first_) return solve_coarse_levels(surface.coarse_cycle_);
    descend(l);
    cycle(l + 1);
    correct(l);
  }
  /// Removes the residual's coarse part from the present solution, without smoothing.
  void solve_residual(uint32_t l) {
    restrict_residual(l);
    cycle(l + 1);
  }

  // Full multigrid down to level `finest`: solved on the coarsest level, and from there each level starts
  // from the coarser one's solution. Cubics carry smooth heights up so well that coarse levels need no cycle
  // of their own. Tiles leave a level's last correction to whoever reads it, as the answer says of `finest`.
  bool full_multigrid(uint32_t finest) {
    const bool together = surface.coarse_first_ > finest;
    const uint32_t coarse = together ? surface.coarse_first_ : last();
    for (uint32_t l = finest; l < coarse; l += 2) restrict_right(l);
    if (together)
      solve_coarse_levels(surface.coarse_pass_);
    else
      solve_coarsest();
    bool to_correct = false;
    for (uint32_t l = coarse - 1; l >= finest; --l) {
      ascend(l, std::exchange(to_correct, false));
      if (l > kCycledLevels) continue;
      cycle(l + 1);
      to_correct = surface.tiled();
      if (l == finest && surface.edge_) {
        correct_and_smooth(l);  // what flows across single faces counts
        to_correct = false;
      } else if (!to_correct) {
        correct(l);
      }
    }
    return to_correct;
  }

  /// Sources on the edge of what is known, from what the present solution lets flow across it.
  void add_sources(uint32_t l, bool first) { surface.edge_->record(commands, level(l).right, x(l), first); }

  void run(uint32_t extra_cycles) {
    if (last() == 0) return solve_coarsest();
    const bool edge = surface.edge_.has_value();
    // An even number of flips at level 0 must leave the solution in the caller's map.
    present[0] = extra_cycles % 2;
    const bool to_correct = full_multigrid(1);
    if (edge && surface.right_sides_ == RightSides::Cells) {
      add_sources(1, true);
      solve_residual(1);
      correct(1);
    }
    interpolate(x(1), x(0), to_correct);
    for (uint32_t i = 0; i < extra_cycles; ++i) {
      const bool sources = i % kCyclesOfSources == kCyclesOfSources - 1 || i + 1 == extra_cycles;
      if (edge && sources) add_sources(0, i < kCyclesOfSources);
      solve_residual(0);
      correct_and_smooth(0);
    }
  }
};

bool Surface::set_known(gpu::Context& context, std::span<const uint8_t> known) {
  edge_.reset();
  const Grid& pixels = levels_.front().grid;
  const uint32_t solved = right_sides_ == RightSides::Cells ? 1 : 0;
  const std::optional<Capacitance> edge =
      capacitance(faces_of_known(known, pixels.width, pixels.height, solved + 1));
  if (edge && edge->cells.empty()) return true;
  if (!edge || edge->islands > 1 || solved + 1 >= levels_.size() || !levels_[solved].x[1].buffer)
    return false;
  if (!restrict_residual_.pipeline()) make_correcting(context);
  edge_.emplace(context, *edge, levels_[solved].grid);
  return true;
}

Surface::Surface(gpu::Context& context, uint32_t width, uint32_t height, Solve solve, const Tuning& tuning,
                 bool keep_pixels)
    : tuning_(tuning), extra_cycles_(solve == Solve::Converged ? kConvergedCycles : 0) {
  Grid grid = grid_for(width, height);
  double cell_width = 1, cell_height = 1, edge_width = 1, edge_height = 1;
  const bool on_gpu = solve != Solve::Exact;
  for (uint32_t l = 0;; ++l) {
    const bool coarsest = !on_gpu || uint64_t{grid.width} * grid.height <= tuning.coarsest_cells;
    const std::string name = "surface level " + std::to_string(l);
    Level level;
    level.grid = grid;
    level.across = grid.width > 1 ? static_cast<float>(cell_height / cell_width) : 0.0f;
    level.down = grid.height > 1 ? static_cast<float>(cell_width / cell_height) : 0.0f;
    level.edge_width = static_cast<float>(edge_width);
    level.edge_height = static_cast<float>(edge_height);
    if (l == 0 && solve == Solve::Live && !coarsest && !keep_pixels) {
      right_sides_ = RightSides::Cells;
    } else {
      level.right = FloatMap(context, name + " right side", grid);
    }
    if (l > 0) level.x[0] = FloatMap(context, name + " solution", grid);
    if (on_gpu && (l > 0 || extra_cycles_ > 0) && !coarsest)
      level.x[1] = FloatMap(context, name + " next solution", grid);
    levels_.push_back(std::move(level));
    if (coarsest) break;
    const auto halve = [](uint32_t cells, double& cell, double& edge) {
      if (cells == 1) return;
      cell *= 2;
      edge = cells % 2 == 0 ? (1 + edge) / 2 : edge / 2;
    };
    halve(grid.width, cell_width, edge_width);
    halve(grid.height, cell_height, edge_height);
    grid = coarser(grid);
  }
  if (levels_.size() == 1) extra_cycles_ = 0;
  unused_coarse_ = FloatMap(context, "unused coarse right side", coarser(levels_.back().grid));
  if (!on_gpu) return;

  const Level& last = levels_.back();
  const std::vector<float> inverse = pseudo_inverse(last);
  inverse_ =
      gpu::DeviceBuffer(context, "coarsest inverse", inverse.size() * sizeof(float), gpu::Memory::Constant);
  std::copy(inverse.begin(), inverse.end(), inverse_.as<float>().begin());
  inverse_.flush();
  inverse_texels_ = gpu::TexelView(context, inverse_, VK_FORMAT_R32G32B32A32_SFLOAT);

  using enum gpu::Binding;
  gpu::KernelInterface direct = interface({Texels, Texels, Storage}, false);
  direct.push_bytes = sizeof(shared::CoarsestPush);
  coarsest_ = gpu::Kernel(context, {"coarsest", k_coarsest}, direct);
  if (levels_.size() == 1) return;
  restrict_ = gpu::Kernel(context, {"restrict", k_restrict}, interface({Texels, Storage, Storage}, false));
  if (tiled())
    make_tiles(context);
  else
    make_strips(context);
  if (extra_cycles_ > 0) make_correcting(context);
}

void Surface::record_coarse_right_side(gpu::Commands& commands) const {
  if (levels_.size() > 1) Pass{*this, commands, levels_.front().right}.restrict_right(0);
}

void Surface::record_interpolation(gpu::Commands& commands, const FloatMap& cells,
                                   const FloatMap& depth) const {
  Pass{*this, commands, depth}.interpolate(cells, depth);
}

void Surface::record(gpu::Commands& commands, const FloatMap& depth) const {
  const auto scope = commands.scope("surface");
  Pass{*this, commands, depth}.run(extra_cycles_);
}

uint64_t Surface::memory_bytes() const {
  uint64_t bytes = inverse_.bytes() + (edge_ ? edge_->memory_bytes() : 0);
  for (const Level& level : levels_)
    bytes += level.right.buffer.bytes() + level.x[0].buffer.bytes() + level.x[1].buffer.bytes();
  return bytes;
}

}  // namespace palpate
