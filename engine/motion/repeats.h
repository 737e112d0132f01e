// Repeats: whether a surface fits itself elsewhere, as a grating or a lattice does.
#pragma once

#include "engine/motion/contact_surface.h"

namespace palpate {

/// How well the relief fits itself in another place, as a correlation: the largest over shifts of at most
/// most_mm at which half of the contact is shared, those left out that are reached from none without falling
/// below kRepeats, which the motion tells or what it does not determine. 0 where relief is flatter than
/// `least_slope`. Relief: what a paraboloid leaves. Waves of less than 4 px of the level on which the contact
/// is no more than 64 px wide are not seen.
double fits_elsewhere(const ContactSurface& surface, double most_mm, double least_slope);
/// Correlation from which another place fits nearly as well.
inline constexpr double kRepeats = 0.85;

}  // namespace palpate
