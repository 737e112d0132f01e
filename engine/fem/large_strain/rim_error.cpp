#include "engine/fem/large_strain/rim_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "engine/fem/large_strain/large_strain.h"

namespace palpate::fem {
namespace {

constexpr uint32_t kSkinLayers = 6;                    // along z of the coarsest of the three under a skin
constexpr uint32_t kFewest = 8, kMost = 24;            // cells along x of the three grids
constexpr double kLeastOrder = 0.3, kMostOrder = 1.6;  // apart from the square of the rest
constexpr double kNoError = 1e-5;  // of the force: two grids that agree so well say nothing of an order

using Cells = std::array<uint32_t, 3>;

/// The order at which a quantity goes through three grids: (f1 - f2) / (f2 - f3) rises with it.
double order_of(const std::array<double, 3>& cells, const std::array<double, 3>& value) {
  const double wanted = (value[0] - value[1]) / (value[1] - value[2]);
  double low = kLeastOrder, high = kMostOrder;
  for (int round = 0; round < 50; ++round) {
    const double order = (low + high) / 2;
    const auto power = [&](size_t grid) { return std::pow(cells[grid], -order); };
    ((power(0) - power(1)) / (power(1) - power(2)) < wanted ? low : high) = order;
  }
  return (low + high) / 2;
}

/// Forces of the three grids at one load.
RimError::Load fit_load(const std::array<double, 3>& cells, const std::array<double, 3>& force_N) {
  RimError::Load load;
  load.force_N = force_N[2];
  const double last = force_N[1] - force_N[2];
  if (std::abs(last) < kNoError * std::abs(force_N[2])) return load;
  load.order = order_of(cells, force_N);
  load.scale_N = last / (std::pow(cells[1], -load.order) - std::pow(cells[2], -load.order));
  return load;
}

/// The rim's part of the maps, even over their middle (single nodes of coarse grids are too noisy); the rest
/// shrinks with the cells' square: P(h) = P(0) + a h^order + b h^2.
void add_pressures(const std::array<double, 3>& cells, const std::array<const PressedBlock*, 3>& blocks,
                   RimError::Load& load) {
  std::array<std::array<double, 2>, 2> change{};  // of both powers from grid to grid
  for (size_t g = 0; g < 2; ++g)
    change[g] = {std::pow(cells[g], -load.order) - std::pow(cells[g + 1], -load.order),
                 std::pow(cells[g], -2) - std::pow(cells[g + 1], -2)};
  const double determinant = change[0][0] * change[1][1] - change[1][0] * change[0][1];
  const auto value = [&](size_t grid, size_t n) { return double{blocks[grid]->pressure_Pa.values[n]}; };
  const Map& fine = blocks[2]->pressure_Pa;
  double sum = 0, count = 0;
  for (size_t n = 0; n < fine.values.size(); ++n) {
    load.even_per_N.push_back(value(2, n) / blocks[2]->force_N);
    const size_t x = n % fine.width, y = n / fine.width;
    if (x < fine.width / 6 || y < fine.height / 6 || x >= fine.width - fine.width / 6 ||
        y >= fine.height - fine.height / 6)
      continue;
    const double first = value(0, n) - value(1, n), second = value(1, n) - value(2, n);
    sum += (first * change[1][1] - second * change[0][1]) / determinant;
    ++count;
  }
  load.pressure_per_N = sum / count / load.scale_N;
}

/// Slope of force over press at the last of three loads, by the parabola through them.
double end_slope(const PressedBlock& first, const PressedBlock& middle, const PressedBlock& last) {
  const auto slope = [](const PressedBlock& a, const PressedBlock& b) {
    return (b.force_N - a.force_N) / (b.press_mm - a.press_mm);
  };
  return slope(first, last) + slope(middle, last) - slope(first, middle);
}

}  // namespace

std::optional<std::array<Cells, 3>> RimError::grids(const Cells& cells, bool skin) {
  if (skin) {
    std::array<Cells, 3> three{};
    for (uint32_t g = 0; g < 3; ++g)
      for (size_t c = 0; c < 3; ++c) {
        const uint32_t layers = kSkinLayers * (g + 1);
        if (cells[c] * layers % cells[2] != 0) return std::nullopt;
        three[g][c] = cells[c] * layers / cells[2];
        if (three[g][c] % (c < 2 ? 4 : 2) != 0) return std::nullopt;
      }
    return three;
  }
  const uint32_t common = std::gcd(std::gcd(cells[0], cells[1]), cells[2]);
  const Cells unit = {cells[0] / common, cells[1] / common, cells[2] / common};
  std::vector<uint32_t> times;
  for (uint32_t k = 1; k * unit[0] <= std::min(kMost, cells[0] / 2); ++k) {
    const Cells grid = {k * unit[0], k * unit[1], k * unit[2]};
    const bool halves = grid[0] % 4 == 0 && grid[1] % 4 == 0 && grid[2] % 2 == 0;
    if (halves && grid[0] >= kFewest && grid[1] >= kFewest && grid[2] >= kFewest / 2) times.push_back(k);
  }
  if (times.size() < 3) return std::nullopt;
  // The finest, about half of it, and one between them.
  const uint32_t last = times.back();
  const auto nearest = [&](double wanted, size_t from, size_t to) {
    return *std::min_element(
        times.begin() + static_cast<long>(from), times.begin() + static_cast<long>(to),
        [&](uint32_t a, uint32_t b) { return std::abs(a - wanted) < std::abs(b - wanted); });
  };
  const uint32_t first = nearest(last / 2.0, 0, times.size() - 2);
  const auto after = static_cast<size_t>(std::find(times.begin(), times.end(), first) - times.begin()) + 1;
  const uint32_t middle = nearest(std::sqrt(static_cast<double>(first) * last), after, times.size() - 1);
  std::array<Cells, 3> three{};
  for (size_t c = 0; c < 3; ++c) {
    three[0][c] = first * unit[c];
    three[1][c] = middle * unit[c];
    three[2][c] = last * unit[c];
  }
  return three;
}

std::optional<RimError> RimError::measure(const Scene& scene, const std::vector<double>& press_mm,
                                          const LargeStrainOptions& options) {
  const auto grids_ = grids(scene.cells, scene.skin.has_value());
  if (!grids_ || press_mm.empty() || scene.bottom_slides) return std::nullopt;
  Scene plain = scene;
  plain.inclusion.reset();
  plain.others.clear();
  LargeStrainOptions own = options;
  own.lump_cells.reset();
  own.step_mm = std::max(options.step_mm, 0.1 * scene.block_mm[2]);
  // A load by itself has one on its way, so that its slope is that of a parabola too.
  std::vector<PressLoad> loads;
  if (press_mm.size() == 1) loads.push_back({press_mm[0] / 2, std::nullopt});
  for (const double way : press_mm) loads.push_back({way, std::nullopt});
  std::array<LargeStrainResult, 3> pressed;
  std::array<double, 3> cells{};
  for (size_t g = 0; g < 3; ++g) {
    plain.cells = (*grids_)[g];
    if (!plate_on_nodes(plain)) return std::nullopt;
    cells[g] = plain.cells[0];
    pressed[g] = solve_large_strain(plain, loads, own);
    if (!pressed[g].converged) return std::nullopt;
  }
  RimError rim;
  const std::vector<PressedBlock>& fine = pressed[2].loads;
  for (size_t l = loads.size() - press_mm.size(); l < loads.size(); ++l) {
    Load load = fit_load(cells, {pressed[0].loads[l].force_N, pressed[1].loads[l].force_N, fine[l].force_N});
    load.slope_N_per_mm = l == 0 ? fine[l].force_N / fine[l].press_mm
                                 : end_slope(l > 1 ? fine[l - 2] : PressedBlock{}, fine[l - 1], fine[l]);
    if (load.scale_N != 0) add_pressures(cells, {&pressed[0].loads[l], &pressed[1].loads[l], &fine[l]}, load);
    rim.loads_.push_back(std::move(load));
  }
  return rim;
}

double RimError::force_N(size_t load, uint32_t cells) const {
  return at(load).scale_N * std::pow(static_cast<double>(cells), -at(load).order);
}

}  // namespace palpate::fem
