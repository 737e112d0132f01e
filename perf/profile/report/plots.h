// Plots of a profile, as gnuplot scripts.
#pragma once

#include <string>
#include <vector>

#include "perf/profile/profile.h"
#include "viz/report/plot_script.h"

namespace palpate::perf {

struct Plot {
  std::string name;     ///< of its files, without extension
  std::string caption;  ///< what it shows and how to read it
  uint32_t width_px = 0;
  uint32_t height_px = 0;
  std::string script;  ///< everything but the terminal
};

std::vector<Plot> plots_of(const Profile& profile);
/// Frame time of all machines over the pixels, and the error of the surface's solvers over their time.
std::vector<Plot> comparison_plots(const std::vector<Profile>& profiles,
                                   const std::vector<std::string>& names);

/// Terminal and script together, ready for run_gnuplot.
std::string full_script(const Plot& plot, PlotKind kind);

}  // namespace palpate::perf
