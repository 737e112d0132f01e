// Files of a profile in its output folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "perf/profile/profile.h"
#include "perf/profile/report/compare.h"

namespace palpate::perf {

/// Writes the results after each part: profile.json and the CSV files, each replaced in one step.
void write_figures(const Profile& profile, const std::filesystem::path& out);
/// The plots (SVG and PNG) and report.html. Returns what hindered the plots, one line; empty: nothing.
std::string write_report(const Profile& profile, const std::filesystem::path& out);
/// compare.json, compare.csv, plots and compare.html. Returns as write_report.
std::string write_comparison(const MachineComparison& comparison, const std::filesystem::path& out);

}  // namespace palpate::perf
