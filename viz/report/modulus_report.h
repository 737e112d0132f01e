// Report of palpate modulus: tables, JSON and plots of a result.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/facts.h"
#include "engine/elasticity/modulus/modulus.h"
#include "viz/report/plot.h"

namespace palpate {

struct ModulusReport {
  ModulusSetup setup;
  std::vector<PressFrame> frames;
  ModulusAnswer answer;
  double expected_MPa = 0;         ///< known beforehand, to compare with; 0: not
  std::vector<std::string> notes;  ///< one line each
};

Facts facts_of(const ModulusReport& report);
/// One line a way, and one line a reading of each way: measured, fitted, residual.
std::string ways_csv(const ModulusAnswer& answer);
std::string points_csv(const ModulusAnswer& answer);

/// Residuals of all methods over the force; and of the chosen way what was measured with the fit, and the
/// moduli and their intervals on the right (as the paper's Fig. 16).
Plot residual_plot(const ModulusReport& report);
Plot modulus_plot(const ModulusReport& report);

}  // namespace palpate
