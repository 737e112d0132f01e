// The pad: an elastic layer between the object and its window.
#pragma once

#include <limits>

#include "palpate/sensor.h"

namespace palpate {

struct Material {
  double young_MPa = std::numeric_limits<double>::infinity();  ///< > 0; infinity is a rigid body
  double poisson = 0;                                          ///< 0 to 0.5
};

/// E*, 1/E* = (1 - v1^2)/E1 + (1 - v2^2)/E2 (Eq. 45). Throws Error(Failure::Input) outside the ranges of
/// Material.
double effective_modulus_MPa(const Material& pad, const Material& indenter = {});

enum class Base {
  Bonded,        ///< the pad is glued to its rigid base
  Frictionless,  ///< the pad slides on it
};

struct Pad {
  Material material;
  double thickness_mm = std::numeric_limits<double>::infinity();  ///< on a rigid base; infinity: a half space
  Base base = Base::Bonded;
};

/// The pad of a sensor file's sections.
Pad pad_of(const LayerCalibration& layer);
Pad pad_of(const ElasticCalibration& elastic);

}  // namespace palpate
