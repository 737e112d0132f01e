// Edges between the known cells of a grid: neighbours along rows and columns, both known.
#pragma once

#include <cstdint>
#include <vector>

namespace palpate {

/// Minus the divergence of the gradient of `of` over these edges, in its unit / mm^2; 0 in unknown cells.
/// `known`: a byte for each cell, rows of `width`, of side `cell_mm`. `any_tilt`: of what is left of the
/// gradient when its mean is taken off, that along rows and that along columns.
void known_laplacian(const std::vector<uint8_t>& known, uint32_t width, double cell_mm, bool any_tilt,
                     const std::vector<double>& of, std::vector<double>& out);
/// How many there are.
double known_edges(const std::vector<uint8_t>& known, uint32_t width);

}  // namespace palpate
