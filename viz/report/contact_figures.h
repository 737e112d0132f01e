// The paper's contact example and its Figures 7 and 8, made with the corrected formulas.
#pragma once

#include <string>
#include <vector>

#include "viz/report/plot.h"

namespace palpate {

/// Sect. 2.5 of the paper: a steel ball on three layers of PDMS.
struct PaperExample {
  double paper_modulus_MPa = 0;     ///< E* from 1 / sum(1/E_i), Eq. 50
  double weighted_modulus_MPa = 0;  ///< E* from sum(t_i) / sum(t_i/E_i), three layers of one thickness
  struct Case {
    double force_N, radius_mm, modulus_MPa;
    double contact_mm, pressure_max_MPa, depth_mm;
    double force_error;  ///< Hertz's force at this depth over the sphere's own on the half space, less 1
    std::vector<std::string> warnings;
  };
  std::vector<Case> cases;  ///< the paper's; its ball as a *diameter* of 5 mm; a force at which Hertz holds
};
PaperExample paper_example();

/// A figure as a table.
struct Figure {
  std::string header;
  std::vector<std::vector<double>> columns;
  std::string notes;  ///< what a reader must know, a line each
};
/// Fig. 7: pressure through the middle of a ball of 2 mm diameter under 0.5, 1 and 1.5 N, points 0.03 mm
/// apart; and the same under a thousandth of these forces, where Hertz holds.
Figure figure7();
Plot figure7_plot(const Figure& figure);
/// Fig. 8: the profile summed over points 0.03 mm apart, against force, for several radii and moduli of the
/// indenter; and the sum over the whole area, which depends on neither.
Figure figure8();
Plot figure8_plot(const Figure& figure);

}  // namespace palpate
