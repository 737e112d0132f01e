// Errors of the slopes that a depth was made of.
#pragma once

#include <random>
#include <vector>

#include "engine/pad/traction.h"

namespace palpate {

/// Gives the depths of a grid's cells slopes that err by `sd`, integrated as a camera's are.
void add_slope_noise(std::vector<float>& depth_mm, const TractionGrid& grid, double sd, std::mt19937& random);

}  // namespace palpate
