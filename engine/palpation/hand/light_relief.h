// The skin's relief as a pad that reads pressure shows it: ridges press more than what lies between them.
#pragma once

#include "engine/palpation/hand/hand_press.h"

namespace palpate {

/// Pitch of the nodes that a relief is read at, mm: whole pixels, 0.12 mm or more.
double relief_pitch_mm(double pixel_mm);

/// Pressure over its mean within 4 mm, less 1, as a height: a tenth of a millimetre of relief where pressure
/// is twice its mean. A lump, a tilt and the load change the mean alone. Heights are right up to a factor,
/// which no place depends on. Contact: where the mean within 0.6 mm is three tenths of the map's median or
/// more. NaN where a node was not seen.
SkinRelief relief_of_pressure(const PressureMap& pressure_Pa, double force_N);

/// Nodes where less than three tenths of the map's median presses, and those beside them, become NaN: there
/// the pad hangs over the block's rim, or has lifted off.
void hide_untouched(PressureMap& pressure_Pa);

}  // namespace palpate
