// Options for the look of pictures, for commands that draw without a window.
#pragma once

#include <vector>

#include "viz/display/picture.h"

namespace palpate {

class CommandLine;

struct LookOptions {
  /// --depth-range, --exaggeration, --view, --colours, --colour-map, --colour-range, --section,
  /// --calibrations, --skin-strain
  void add(CommandLine& command);
  void apply(viz::PictureOptions& look) const;

 private:
  double range_mm_ = 0;
  double exaggeration_ = 0;
  std::vector<double> view_deg_;
  viz::Quantity quantity_ = viz::Quantity::Depth;
  viz::ColourMap map_ = viz::ColourMap::Viridis;
  double colour_range_ = 0;
  std::vector<double> section_;
  bool calibrations_ = false;
  viz::SkinStrain skin_strain_ = viz::SkinStrain::Off;
};

}  // namespace palpate
