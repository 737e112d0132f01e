// Findings of a profile, each in one sentence: the first line of its report, the titles of its plots.
#pragma once

#include <string>
#include <vector>

#include "perf/profile/profile.h"

namespace palpate::perf {

/// In the order in which they were measured.
std::vector<std::string> readings_of(const Profile& profile);

/// The largest frames of each reading that reach 30 a second: "up to" where larger ones were measured and do
/// not, else "at", as larger ones were not tried.
std::string headline(const Profile& profile);
/// The stage that takes most of the largest frame of a reading.
std::string slowest_stage(const Profile& profile, const std::string& reading);
/// The time within which 99 of 100 of the largest frames of a reading are done.
std::string usual_latency(const Profile& profile, const std::string& reading);
/// The largest share of the measured ceiling that a stage reaches.
std::string best_bandwidth(const Profile& profile, const std::string& reading);

}  // namespace palpate::perf
