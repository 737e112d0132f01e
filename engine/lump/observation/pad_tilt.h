// Tilt of a pad on pressed tissue, from the first moments of what it sees.
#pragma once

#include <array>

#include "engine/tissue/pressure_map.h"

namespace palpate::lump {

/// A plate's tilt against the tissue's floor, degrees; > 0: it goes deeper towards larger x, or y. NaN where
/// nothing presses.
struct PadTilt {
  double x_deg = 0, y_deg = 0;
  double x_sd_deg = 0, y_sd_deg = 0;

  double size_deg() const;
};

/// Tissue between the pad and a floor, and how well it is known: shares of a standard error.
struct TissueLayer {
  double young_Pa = 4000, thickness_mm = 20;
  double young_sd = 0.06, thickness_sd = 0.03;
};

/// The centre of pressure lies off the window's middle by the pressure's rise over its mean times the
/// window's second moment; the rise over the tissue's stiffness against further compression is the tilt, as
/// in a column bent, less what the tissue gives by spreading there (by finite elements of a block twice as
/// wide as it is thick). What else makes pressure rise counts as tilt: the block's rim, a lump beside the
/// window's middle. The error holds `bump_sd`, the rise of that kind as a share of the mean at the window's
/// edge, and that of the layer and of the window's size and place.
PadTilt pad_tilt(const PressureMap& pressure_Pa, const TissueLayer& tissue, double bump_sd = 0.05);

/// Compression of tissue, share of its thickness, under a mean pressure; and by what share the pressure
/// rises with a share of the thickness more. Neo-Hookean, bonded to a floor twice as wide as it is thick.
double compression_under(double pressure_Pa, double young_Pa);
double rise_with_compression(double compression);
/// Load of a level plate that compresses by `deeper` more, share of the one that compresses so; 0: lifted
/// off.
double load_share(double compression, double deeper);

}  // namespace palpate::lump
