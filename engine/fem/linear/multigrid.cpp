#include "engine/fem/linear/multigrid.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "engine/base/simd.h"
#include "engine/fem/linear/level.h"
#include "engine/fem/linear/transfer.h"
#include "engine/numeric/sparse.h"
#include "palpate/error.h"

namespace palpate::fem {
namespace {

/// Unknowns that the coarsest level's direct solve takes at most: its factor then holds some 50 MB.
constexpr size_t kMostCoarse = 12000;

}  // namespace

struct Multigrid::Level : GridLevel {
  std::vector<float> inverse, x, residual, step, product;

  /// `Grid` and `Fixed` as GridLevel takes them.
  template <typename Grid, typename Fixed>
  Level(Grid&& g, double poisson, Fixed&& f, const Smoothing& smoothing)
      : GridLevel(std::forward<Grid>(g), poisson, std::forward<Fixed>(f), smoothing),
        inverse(stiffness.inverse_blocks(fixed)),
        x(3 * grid.nodes()),
        residual(x.size()),
        step(x.size()),
        product(x.size()) {}
};

struct Multigrid::Coarsest {
  std::vector<int> unknown;  // of each displacement; -1: fixed
  std::optional<sparse::Factor> factor;
  Eigen::VectorXd right;
  size_t values = 0;

  explicit Coarsest(const Level& level) {
    const CellGrid& grid = level.grid;
    const size_t nodes = grid.nodes();
    unknown.assign(3 * nodes, -1);
    const size_t plane = size_t{grid.cells[0] + 1} * (grid.cells[1] + 1);
    const size_t lower = grid.slit ? (*grid.slit + 1) * plane : nodes;  // shares with the plane above it
    int count = 0;
    for (size_t n = 0; n < nodes; ++n)
      for (size_t c = 0; c < 3; ++c)
        if ((level.fixed[n] >> c & 1) == 0)
          unknown[c * nodes + n] =
              c == 2 && n >= lower && n < lower + plane ? unknown[c * nodes + n - plane] : count++;
    std::vector<sparse::Entry> entries;
    for (uint32_t k = 0; k < grid.cells[2]; ++k) {
      if (grid.slit == k) continue;
      const std::array<double, 576> element =
          element_matrix(level.stiffness.cell_size_mm(k), level.stiffness.poisson());
      for (uint32_t j = 0; j < grid.cells[1]; ++j)
        for (uint32_t i = 0; i < grid.cells[0]; ++i) {
          std::array<int, 24> at{};
          for (uint32_t a = 0; a < 24; ++a) {
            const uint32_t corner = a / 3;
            at[a] = unknown[(a % 3) * nodes +
                            grid.node(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2))];
          }
          for (size_t a = 0; a < 24; ++a)
            for (size_t b = 0; b < 24; ++b)
              if (at[a] >= 0 && at[b] >= 0)
                entries.emplace_back(at[a], at[b], grid.young[grid.cell(i, j, k)] * element[24 * a + b]);
        }
    }
    factor.emplace(sparse::Factor::Kind::Llt, count, entries);
    if (!factor->ok())
      throw Error(Failure::Usage, "a block held by its supports", "a block that can move freely",
                  "a bonded or sliding bottom");
    right.resize(count);
    values = factor->values();
  }

  void solve(const float* residual, float* x) {
    right.setZero();
    for (size_t n = 0; n < unknown.size(); ++n)
      if (unknown[n] >= 0) right(unknown[n]) += double{residual[n]};
    const Eigen::VectorXd found = factor->solve(right);
    for (size_t n = 0; n < unknown.size(); ++n)
      x[n] = unknown[n] >= 0 ? static_cast<float>(found(unknown[n])) : 0.0f;
  }
};

Multigrid::Multigrid(const CellGrid& grid, double poisson, const FixedNodes& fixed, WorkTeam& team,
                     const Smoothing& smoothing)
    : team_(team) {
  levels_.push_back(std::make_unique<Level>(grid, poisson, fixed, smoothing));
  while (std::optional<CellGrid> half = halve(levels_.back()->grid)) {
    FixedNodes half_fixed = halve(levels_.back()->grid, *half, levels_.back()->fixed);
    levels_.push_back(std::make_unique<Level>(std::move(*half), poisson, std::move(half_fixed), smoothing));
  }
  const auto& coarse = levels_.back()->grid;
  if (3 * coarse.nodes() > kMostCoarse)
    throw Error(Failure::Usage, "cells that can be halved, sides of 2^n times a small number",
                "a coarsest grid of " + std::to_string(coarse.cells[0]) + " x " +
                    std::to_string(coarse.cells[1]) + " x " + std::to_string(coarse.cells[2]),
                "64x64x32 or another power of two times 1, 3 or 5");
  coarsest_ = std::make_unique<Coarsest>(*levels_.back());
}

Multigrid::~Multigrid() = default;

const Stiffness& Multigrid::finest() const {
  return levels_.front()->stiffness;
}

uint64_t Multigrid::bytes() const {
  uint64_t sum = coarsest_->values * (sizeof(double) + sizeof(int)) + coarsest_->unknown.size() * sizeof(int);
  for (const auto& level : levels_)
    sum += (level->x.size() * 4 + level->inverse.size()) * sizeof(float) + level->own_bytes();
  return sum;
}

// In: the residual of x. Out: x and its residual after the steps; from zero, x need not be set.
void Multigrid::smooth(Level& level, bool from_zero) {
  const size_t nodes = level.grid.nodes();
  WorkTeam& team = nodes < kFewestForTeam ? alone_ : team_;
  for (size_t s = 0; s < level.steps.size(); ++s) {
    const auto keep = static_cast<float>(level.steps[s].keep), gain = static_cast<float>(level.steps[s].gain);
    const bool fresh = s == 0, set = fresh && from_zero;
    team.run([&](uint32_t part) {
      const auto [begin, end] = team.share(static_cast<uint32_t>(nodes), part);
      const float* r = level.residual.data();
      const float* b = level.inverse.data();
      float* d = level.step.data();
      float* x = level.x.data();
      const auto update = [&](size_t c, size_t n, float wanted) {
        const float moved = fresh ? gain * wanted : keep * d[c * nodes + n] + gain * wanted;
        d[c * nodes + n] = moved;
        x[c * nodes + n] = set ? moved : x[c * nodes + n] + moved;
      };
      PALPATE_INDEPENDENT
      for (size_t n = begin; n < end; ++n) {
        const float rx = r[n], ry = r[nodes + n], rz = r[2 * nodes + n];
        const float xy = b[3 * nodes + n], xz = b[4 * nodes + n], yz = b[5 * nodes + n];
        update(0, n, b[n] * rx + xy * ry + xz * rz);
        update(1, n, xy * rx + b[nodes + n] * ry + yz * rz);
        update(2, n, xz * rx + yz * ry + b[2 * nodes + n] * rz);
      }
    });
    level.stiffness.apply(level.step.data(), level.product.data(), &level.fixed, team);
    team.run([&](uint32_t part) {
      const auto [begin, end] = team.share(static_cast<uint32_t>(3 * nodes), part);
      for (size_t n = begin; n < end; ++n) level.residual[n] -= level.product[n];
    });
  }
}

void Multigrid::cycle(size_t index) {
  Level& level = *levels_[index];
  if (index + 1 == levels_.size()) return coarsest_->solve(level.residual.data(), level.x.data());
  Level& coarse = *levels_[index + 1];
  WorkTeam& team = level.grid.nodes() < kFewestForTeam ? alone_ : team_;
  smooth(level, true);
  restrict_to(level.grid, coarse.grid, coarse.fixed, level.residual.data(), coarse.residual.data(), team);
  cycle(index + 1);
  std::fill(level.step.begin(), level.step.end(), 0.0f);
  prolong_add(level.grid, coarse.grid, level.fixed, coarse.x.data(), level.step.data(), team);
  level.stiffness.apply(level.step.data(), level.product.data(), &level.fixed, team);
  team.run([&](uint32_t part) {
    const auto [begin, end] = team.share(static_cast<uint32_t>(3 * level.grid.nodes()), part);
    for (size_t n = begin; n < end; ++n) {
      level.x[n] += level.step[n];
      level.residual[n] -= level.product[n];
    }
  });
  smooth(level, false);
}

void Multigrid::precondition(const float* residual, float* correction) {
  Level& level = *levels_.front();
  std::copy_n(residual, level.residual.size(), level.residual.data());
  cycle(0);
  std::copy_n(level.x.data(), level.x.size(), correction);
}

}  // namespace palpate::fem
