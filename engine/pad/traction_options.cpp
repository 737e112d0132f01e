#include <cmath>
#include <string>

#include "engine/pad/traction.h"
#include "palpate/error.h"

namespace palpate {
namespace {

void refuse(const std::string& wanted, const std::string& found, const std::string& remedy) {
  throw Error(Failure::Input, wanted, found, remedy);
}

}  // namespace

void check_traction(const TractionGrid& grid, const TractionOptions& options) {
  if (grid.width < 2 || grid.height < 2 || !(grid.cell_mm > 0) || !std::isfinite(grid.cell_mm))
    refuse("a grid of 2 x 2 cells or more, with their side in mm",
           std::to_string(grid.width) + " x " + std::to_string(grid.height) + " of " +
               std::to_string(grid.cell_mm) + " mm",
           "a larger frame, or smaller cells");
  const auto positive = [](double value) { return value > 0 && std::isfinite(value); };
  if (!positive(options.slope_sd) || !positive(options.shift_sd_mm) || !positive(options.tolerance) ||
      !(options.error_length_mm >= 0) || options.most_iterations == 0)
    refuse("standard errors, tolerance and iterations > 0", "others", "the defaults of TractionOptions");
}

TractionWeights traction_weights(const Material& material, const TractionOptions& options) {
  const double slope_per_MPa = 2 / effective_modulus_MPa(material);
  const double most = std::pow(slope_per_MPa, 2), prior = most * std::pow(options.slope_sd, 2);
  return {prior, 1 / (most + prior)};
}

}  // namespace palpate
