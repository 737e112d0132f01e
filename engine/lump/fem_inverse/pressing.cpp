#include "engine/lump/fem_inverse/pressing.h"

#include <cmath>
#include <utility>

#include "engine/fem/large_strain/extrapolation.h"

namespace palpate::lump {
namespace {

/// A lump this near is taken to lie in the block's middle where two grids are compared: what is between them
/// hardly changes over such a way, and a quarter of the block is enough.
constexpr double kNearMiddle_mm = 0.3;
constexpr double kLeastOrder = 1.8;  // for what two grids leave open

}  // namespace

Pressing::Pressing(const Observation& observation, const std::optional<Case::Lump>& lump,
                   const ResponseOptions& options, uint32_t times)
    : block_mm{observation.block_mm[0], observation.block_mm[1]},
      poisson(options.poisson),
      cells(options.cells) {
  for (uint32_t& side : cells) side *= times;
  block.lump = lump;
  block.thickness_mm = observation.block_mm[2];
  block.young_Pa = observation.young_Pa;
  block.press_mm = {observation.block_mm[2] / 10};
  turned = lump && lump->along_y;
}

fem::LargeStrainOptions solver_options(const ResponseOptions& options, StopAsked stop) {
  fem::LargeStrainOptions solver;
  solver.residual = options.residual;
  solver.step_mm = options.step_mm;
  solver.threads = options.threads;
  solver.stop = std::move(stop);
  return solver;
}

size_t count_cells(const fem::Scene& scene, bool quarter) {
  return size_t{scene.cells[0]} * scene.cells[1] * scene.cells[2] / (quarter ? 4 : 1);
}

Eigen::VectorXd read(const fem::PressedSurface& surface, const ComparedNodes& nodes, bool turned) {
  const fem::PressureField field(surface);
  const PressureMap& map = nodes.observation().pressure_Pa.front();
  const double gauss = 0.5 / std::sqrt(3.0), dx = gauss * map.pitch_mm[0], dy = gauss * map.pitch_mm[1];
  Eigen::VectorXd values(static_cast<Eigen::Index>(nodes.count()));
  for (size_t n = 0; n < nodes.count(); ++n) {
    double sum = 0;
    for (int point = 0; point < 4; ++point) {
      const double x = nodes.x_mm(n) + (point & 1 ? dx : -dx), y = nodes.y_mm(n) + (point & 2 ? dy : -dy);
      sum += turned ? field.at(y, x) : field.at(x, y);
    }
    values(static_cast<Eigen::Index>(n)) = sum / 4;
  }
  return values;
}

std::optional<FittedLump> for_comparison(const ComparedNodes& nodes, std::optional<FittedLump> lump,
                                         const ResponseOptions& options) {
  if (lump && lump->cells.in_middle(Pressing(nodes.observation(), lump->lump, options).scene().cells) &&
      std::hypot(lump->lump.offset_mm[0], lump->lump.offset_mm[1]) < kNearMiddle_mm)
    lump->lump.offset_mm = {0, 0};
  return lump;
}

std::vector<double> at_no_size(const std::vector<uint32_t>& times) {
  std::vector<double> fraction;
  for (const uint32_t own : times) {
    double product = 1;
    for (const uint32_t other : times)
      if (other != own) product *= 1 / (1 - std::pow(static_cast<double>(other) / own, 2));
    fraction.push_back(product);
  }
  return fraction;
}

std::vector<double> open_fractions(const std::vector<uint32_t>& times) {
  std::vector<double> open = at_no_size(times);
  if (times.size() > 2) {
    const std::vector<double> finer = at_no_size({times.begin() + 1, times.end()});
    for (size_t g = 0; g < finer.size(); ++g) open[g + 1] -= finer[g];
  } else if (times.size() == 2) {
    open[1] -= 1 + fem::extrapolation_fraction(times[1], times[0], kLeastOrder);
    open[0] = -open[1];
  } else {
    open[0] = 0;
  }
  return open;
}

}  // namespace palpate::lump
