// Refractive index of a clear liquid or gel from three laser spots on a wall (Eq. 1-12). The beam is
// reflected by a glass plate to the spot N; with the liquid on the plate there are two: M2 from the liquid's
// surface, and M1 from the glass through the liquid, between N and M2.
#pragma once

#include <span>

namespace palpate::optics {

/// A length with its standard uncertainty, mm.
struct MeasuredLength {
  double mm = 0;
  double sd_mm = 0;
};

/// Four lengths, each measured by itself.
struct LaserSpots {
  MeasuredLength od, on;  ///< tan of the angle of incidence is OD / ON
  MeasuredLength m1m2;    ///< between the two spots with the liquid
  MeasuredLength nm2;     ///< from the bare glass's spot to the surface's: twice the liquid's thickness
  double n_air = 1.000271;
  double n_air_sd = 0;
};

struct MeasuredIndex {
  double index = 0;
  double standard_error = 0;  ///< by propagation of the lengths' uncertainties, first order
  double incidence_rad = 0;
  double refraction_rad = 0;
  double sd_od = 0, sd_on = 0, sd_m1m2 = 0, sd_nm2 = 0, sd_air = 0;  ///< the parts of the standard error
};
/// n = n_air sin(atan(OD/ON)) / sin(atan((M1M2/NM2) OD/ON)); Eq. 12 has the two names swapped. Throws
/// Error(Failure::Input) on lengths <= 0, uncertainties < 0, spots in the wrong order (M1M2 >= NM2: the
/// liquid would bend light less than air), and n_air < 1.
MeasuredIndex index_from_spots(const LaserSpots& spots);

/// Several measurements of one liquid.
struct CombinedIndex {
  double index = 0;  ///< mean weighted by 1 / variance; the plain mean where no uncertainty is known
  double standard_error =
      0;                  ///< of the mean: from the parts' own, widened by sqrt(chi^2 / (n - 1)) where > 1
  double chi_square = 0;  ///< of the parts about the mean; 0 where no uncertainty is known
  bool widened = false;   ///< the parts scatter more than their own errors say
};
/// Throws Error(Failure::Input) where it is empty, or where some have an uncertainty and some have none.
CombinedIndex combine(std::span<const MeasuredIndex> parts);

}  // namespace palpate::optics
