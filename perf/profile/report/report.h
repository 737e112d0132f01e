// A profile as one HTML page that needs nothing beside it: no network, no other file.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "perf/profile/profile.h"
#include "perf/profile/report/compare.h"
#include "perf/profile/report/plots.h"

namespace palpate::perf {

/// A plot and its SVG, which may be empty where there is no plotting program.
struct DrawnPlot {
  NamedPlot plot;
  std::string svg;
};

std::string html_report(const Profile& profile, const std::vector<DrawnPlot>& plots);
std::string html_report(const MachineComparison& comparison, const std::vector<DrawnPlot>& plots);

}  // namespace palpate::perf
