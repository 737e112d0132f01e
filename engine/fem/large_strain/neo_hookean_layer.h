// Numbers that all cells of one layer of a grid share.
#pragma once

#include <array>

namespace palpate::fem {

/// Numbers of a layer's bricks at each Gauss point.
struct NeoHookeanLayer {
  double weight;                                   ///< of a point, mm^3
  std::array<std::array<double, 24>, 8> gradient;  ///< of each corner's shape, 3 x corner + component
};

}  // namespace palpate::fem
