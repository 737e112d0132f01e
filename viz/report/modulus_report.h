// Report of palpate modulus: tables, JSON and plots of a result.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/facts.h"
#include "engine/elasticity/modulus/modulus.h"
#include "viz/report/plot_script.h"

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

/// Scripts for gnuplot: residuals of all methods over the force; and of the chosen way what was measured
/// beside the fit, with the moduli and their intervals on the right (as the paper's Fig. 16).
std::string residual_script(const ModulusReport& report, PlotKind kind);
std::string modulus_script(const ModulusReport& report, PlotKind kind);

}  // namespace palpate
