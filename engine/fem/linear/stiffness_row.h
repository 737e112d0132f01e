// The inner loops of the stiffness product, made for the widest vectors that the processor has.
#pragma once

#include "engine/fem/linear/stiffness.h"

namespace palpate {

/// Adds what layer k of cells does to its upper plane of nodes (`upper`) and its lower one.
void add_layer(const LayerStiffness<float>& stiffness, const ForwardGrid& grid, uint32_t k,
               const float* displacement, float* force, bool upper, bool lower);
void add_layer(const LayerStiffness<double>& stiffness, const ForwardGrid& grid, uint32_t k,
               const double* displacement, double* force, bool upper, bool lower);

}  // namespace palpate
