// Plots of a profile.
#pragma once

#include <string>
#include <vector>

#include "perf/profile/profile.h"
#include "viz/report/plot.h"

namespace palpate::perf {

struct NamedPlot {
  std::string name;     ///< of its files, without extension
  std::string caption;  ///< what it shows and how to read it
  Plot plot;
};

/// Whether a reading was measured at sizes enough for a curve over them; else the tables alone have its
/// figures.
bool has_curves(const std::vector<SizeFigure>& sizes, const std::string& reading);

std::vector<NamedPlot> plots_of(const Profile& profile);
/// Frame time of all machines over the pixels, and the error of the surface's solvers over their time.
std::vector<NamedPlot> comparison_plots(const std::vector<Profile>& profiles,
                                        const std::vector<std::string>& names);

}  // namespace palpate::perf
