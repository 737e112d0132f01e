// Blocks that CalculiX pressed (tests/data/calculix): a program of other elements, solvers and authors.
#pragma once

#include <string>
#include <vector>

#include "engine/fem/scene.h"

namespace palpate {

struct CalculixCase {
  struct Load {
    double press_mm = 0, force_N = 0;
    PressureMap
        pressure_Pa;  ///< means over squares of the pitch, the outermost nodes on the block's rim at rest
  };
  std::string name;
  fem::Scene scene;  ///< with `inclusion` where there is a lump
  std::vector<Load> loads;
};

/// One of tests/data/calculix by its name; throws where it is not there or not as its README says.
CalculixCase calculix_case(const std::string& name);

/// A map without its outermost nodes, whose squares reach over the block's rim.
PressureMap without_rim(const PressureMap& map);

}  // namespace palpate
